"""Faults of scanners: dead, or dirty, with everything else as it was."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from localization.types import Reading, Scan, Twist
from robot_sim import ScannerConfig, ScannerFault, SensorError, Simulation, SimulationConfig, World
from robot_sim.sensors.scanner_fault import DirtyWindow
from robot_sim.sensors.sensor_suite import sensor_suite

SECOND = 1_000_000_000
HORIZONTAL, VERTICAL = "laser_horizontal", "laser_vertical"


def readings(world: World, config: SimulationConfig, seconds: float = 1.0) -> Iterator[Reading]:
    simulation = Simulation(world, seed=5, config=config)
    simulation.command(Twist.planar(0.3, 0.2))
    for _ in range(round(seconds * 50)):
        yield from simulation.step()


def bits(reading: Reading) -> bytes:
    if isinstance(reading, Scan):
        text = f"{reading.stamp} {reading.scanner}".encode()
        return text + reading.ranges.tobytes() + reading.intensities.tobytes()
    return repr(reading).encode()


def faulty(*faults: ScannerFault, effects: bool = False) -> SimulationConfig:
    scanners = sensor_suite(realistic=effects).scanners
    return SimulationConfig(scanners=scanners, scanner_faults=faults)


def without(found: Sequence[Reading], scanner: str) -> list[bytes]:
    return [bits(r) for r in found if not (isinstance(r, Scan) and r.scanner == scanner)]


@pytest.mark.parametrize("effects", [False, True])
def test_fault_of_one_scanner_changes_no_bit_of_any_other_reading(
    room: World, effects: bool
) -> None:
    plain = list(readings(room, faulty(effects=effects)))
    dead = ScannerFault(HORIZONTAL, SECOND // 4, SECOND // 2)
    dirty = ScannerFault(HORIZONTAL, SECOND // 2, dirt=0.4)
    found = list(readings(room, faulty(dead, dirty, effects=effects)))
    assert without(found, HORIZONTAL) == without(plain, HORIZONTAL)
    assert len(found) < len(plain)


@pytest.mark.parametrize("effects", [False, True])
def test_scanner_is_the_same_to_the_bit_before_and_after_its_fault(
    room: World, effects: bool
) -> None:
    plain = list(readings(room, faulty(effects=effects)))
    fault = ScannerFault(HORIZONTAL, 300_000_000, 200_000_000, dirt=0.5)
    found = list(readings(room, faulty(fault, effects=effects)))
    changed = [
        a.stamp
        for a, b in zip(plain, found, strict=True)
        if bits(a) != bits(b) and isinstance(a, Scan)
    ]
    assert changed == [300_000_000, 400_000_000]


def test_dead_scanner_sends_no_sweep_of_which_a_part_falls_into_the_fault(room: World) -> None:
    # A sweep takes the first 75 ms of each 100 ms.
    fault = ScannerFault(HORIZONTAL, 250_000_000, 160_000_000)
    found = list(readings(room, faulty(fault)))
    stamps = {name: [r.stamp for r in found if isinstance(r, Scan) and r.scanner == name]
              for name in (HORIZONTAL, VERTICAL)}  # fmt: skip
    sweeps = {100_000_000 * i for i in range(10)}
    assert set(stamps[HORIZONTAL]) == sweeps - {200_000_000, 300_000_000, 400_000_000}
    assert set(stamps[VERTICAL]) == sweeps


@pytest.mark.parametrize("share", [0.0, 0.1, 0.35, 1.0])
def test_dirt_covers_its_share_of_beams_in_at_most_three_runs_of_neighbours(
    room: World, share: float
) -> None:
    fault = ScannerFault(HORIZONTAL, 0, dirt=share)
    scans = [r for r in readings(room, faulty(fault), 0.3) if isinstance(r, Scan)]
    mine = [s for s in scans if s.scanner == HORIZONTAL]
    for scan in mine:
        # All of a closed room is within range, and nothing nearer than range_min.
        assert np.count_nonzero(~np.isfinite(scan.ranges)) == round(share * len(scan.ranges))
        edges = np.flatnonzero(np.diff(np.isfinite(scan.ranges).astype(int)))
        assert len(edges) <= 6
    # The dirt stays where it is.
    assert len({np.isfinite(s.ranges).tobytes() for s in mine}) == 1
    assert all(np.isfinite(s.ranges).all() for s in scans if s.scanner == VERTICAL)


def covered(seed: int, dirt: float) -> np.ndarray:
    """Return ranges of 3 m as a dirty window reports them."""
    fault = ScannerFault(HORIZONTAL, 0, dirt=dirt)
    window = DirtyWindow([fault], 541, 1, np.random.SeedSequence(seed))
    ranges = np.full(541, 3.0)
    window.cover(ranges, np.zeros(0), np.arange(541), 0)
    return ranges


def test_bright_dirt_reads_as_too_near_and_dark_dirt_as_nothing(room: World) -> None:
    kinds = set(np.concatenate([covered(seed, 0.5) for seed in range(8)]).tolist())
    assert kinds == {0.04, 3.0, np.inf}
    found = readings(room, faulty(*(ScannerFault(s, 0, dirt=0.9) for s in (HORIZONTAL, VERTICAL))))
    values = np.concatenate([r.ranges for r in found if isinstance(r, Scan)])
    assert np.isnan(values).any()
    assert np.isposinf(values).any()


def test_which_beams_are_dirty_depends_on_the_seed() -> None:
    masks = {(covered(seed, 0.3) == 3.0).tobytes() for seed in range(20)}
    assert len(masks) == 20


def test_dirt_is_at_the_same_angles_in_each_sweep_of_an_interlaced_picture() -> None:
    config = ScannerConfig.of(HORIZONTAL, "sick_lms200", resolution_deg=0.5)
    assert config.interlace > 1
    fault = ScannerFault(HORIZONTAL, 0, dirt=0.3)
    window = DirtyWindow([fault], config.beams, config.interlace, np.random.SeedSequence(1))
    picture = np.full(config.beams, np.nan)
    for part in range(config.interlace):
        ranges = np.full(config.beams_of(part), 3.0)
        window.cover(ranges, np.zeros(0), np.arange(len(ranges)), part)
        picture[part :: config.interlace] = ranges
    assert np.count_nonzero(picture != 3.0) == round(0.3 * config.beams)
    assert len(np.flatnonzero(np.diff((picture != 3.0).astype(int)))) <= 6


def test_fault_of_a_scanner_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(SensorError, match=r"no scanner 'laser_top'.*laser_horizontal, laser_vert"):
        faulty(ScannerFault("laser_top", 0))
    with pytest.raises(SensorError, match=r"share from 0 to 1, got 1\.5"):
        ScannerFault(HORIZONTAL, 0, dirt=1.5)
    with pytest.raises(SensorError, match="must last >= 0 ns, got -1"):
        ScannerFault(HORIZONTAL, 0, -1)
