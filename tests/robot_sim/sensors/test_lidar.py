"""Scanners against geometry that can be worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory
from localization.geometry import rotation_from_quaternion
from localization.types import Pose, Scan, Twist
from robot_sim.array_types import FloatArray
from robot_sim.robot.p3at import MOUNTS
from robot_sim.sensors.echoes import Echoes
from robot_sim.sensors.lidar import PoseHistory, ScannerConfig
from robot_sim.sensors.light_paths import LightTracer
from robot_sim.sensors.sensor_suite import sensor_suite
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.loading import load_world
from robot_sim.worlds.world import World
from tests.robot_sim.driving import readings_of

EXACT = (
    ScannerConfig("laser_horizontal", sigma=0.0),
    ScannerConfig("laser_vertical", sigma=0.0),
)


def room_ranges(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return distances from inside the test room to its six inner faces, by slabs."""
    low, high = np.zeros(3), np.array([10.0, 8.0, 2.5])
    with np.errstate(divide="ignore", invalid="ignore"):
        to_faces = np.where(directions > 0.0, high - origins, low - origins) / directions
    to_faces[directions == 0.0] = np.inf
    return np.asarray(to_faces.min(axis=1))


INTERLACED = replace(
    ScannerConfig.of("laser_horizontal", "sick_lms200"), sigma=0.0, range_max=20.0, range_min=0.0
)
"""An LMS-200 at 0.5 deg: odd beams come a turn of the mirror after the even ones."""


@pytest.mark.parametrize(("scanners", "count"), [(EXACT, 52), ((INTERLACED,), 195)])
@pytest.mark.parametrize(("forward", "turn"), [(0.0, 0.0), (0.7, 0.0), (0.0, 2.0), (0.3, -1.0)])
def test_every_beam_is_cast_at_its_own_time(
    room: World, forward: float, turn: float, scanners: tuple[ScannerConfig, ...], count: int
) -> None:
    simulation = Simulation(
        room, config=SimulationConfig(scanners=scanners), start=Pose.planar(3.0, 4.0, 0.3)
    )
    simulation.command(Twist.planar(forward, turn))
    truths, scans = [simulation.truth()], []
    for _ in range(130):
        scans += [r for r in simulation.step() if isinstance(r, Scan)]
        truths.append(simulation.truth())
    path = Trajectory.from_poses((t.stamp, t.map_from_base) for t in truths)
    assert len(scans) == count
    # Late sweeps, at a steady speed: poses of the ticks may then be interpolated.
    for scan in scans[-4:]:
        mount = MOUNTS[scan.scanner]
        at, turned = path.at(scan.stamp + scan.offsets)
        rays = np.stack([np.cos(scan.angles), np.sin(scan.angles), 0.0 * scan.angles], axis=1)
        directions = np.einsum("nij,nj->ni", turned, rays @ mount.rotation.T)
        expected = room_ranges(at + turned @ mount.position, directions)
        # Within a tick the path is an arc: its chord is off by v w dt^2 / 8 and less.
        np.testing.assert_allclose(scan.ranges, expected, atol=2e-4)


def test_sweep_has_one_stamp_and_a_time_for_each_beam(room: World) -> None:
    scans = readings_of(Scan, Simulation(room, config=SimulationConfig(scanners=EXACT)), 10)
    assert [(s.stamp, s.scanner) for s in scans] == [
        (0, "laser_horizontal"),
        (0, "laser_vertical"),
        (100_000_000, "laser_horizontal"),
        (100_000_000, "laser_vertical"),
    ]
    scan = scans[0]
    assert len(scan.ranges) == 541
    assert scan.angles[0] == pytest.approx(-math.radians(135.0))
    assert scan.angles[-1] == pytest.approx(math.radians(135.0), abs=1e-5)
    assert scan.offsets[-1] == pytest.approx(75_000_000, abs=100)


def test_phase_shifts_the_sweeps(room: World) -> None:
    late = ScannerConfig("laser_vertical", phase_ns=33_333_333)
    scans = readings_of(Scan, Simulation(room, config=SimulationConfig(scanners=(late,))), 20)
    assert [s.stamp for s in scans] == [33_333_333, 133_333_333, 233_333_333]


def test_noise_is_gaussian_of_the_configured_size(room: World) -> None:
    def ranges(sigma: float) -> np.ndarray:
        scanner = ScannerConfig("laser_horizontal", sigma=sigma)
        simulation = Simulation(room, config=SimulationConfig(scanners=(scanner,)))
        return np.array([s.ranges for s in readings_of(Scan, simulation, 200)[5:]])

    errors = (ranges(0.012) - ranges(0.0)).ravel()
    assert abs(errors.mean()) < 0.001
    assert errors.std() == pytest.approx(0.012, rel=0.03)
    assert np.mean(np.abs(errors) < 0.012) == pytest.approx(0.683, abs=0.02)


def test_surfaces_beyond_the_range_give_infinity(field: World) -> None:
    scans = readings_of(Scan, Simulation(field), 4)
    horizontal, vertical = scans
    assert np.isposinf(horizontal.ranges).all()
    # The vertical scanner sees the floor at its sides and no ceiling.
    assert np.isposinf(vertical.ranges[100:440]).all()
    assert np.isfinite(vertical.ranges[[0, -1]]).all()


def test_surfaces_below_the_least_range_give_nan(room: World) -> None:
    scanner = ScannerConfig("laser_horizontal", range_min=5.0)
    (scan,) = readings_of(Scan, Simulation(room, config=SimulationConfig(scanners=(scanner,))), 5)
    assert np.isnan(scan.ranges[np.abs(scan.angles + math.pi / 2) < 0.1]).all()
    assert np.isfinite(scan.ranges[np.abs(scan.angles) < 0.1]).all()


def test_pose_history_interpolates_neighbouring_poses() -> None:
    poses = [Pose.planar(0.0, 0.0, 0.1), Pose.planar(0.002, 0.0, 0.104)]
    track = PoseHistory(
        np.array([0, 2_000_000]),
        np.array([p.position for p in poses]),
        np.array([p.quaternion_wxyz for p in poses]),
    )
    position, rotation = track.at(np.array([500_000]))
    np.testing.assert_allclose(position, [[0.0005, 0.0, 0.0]])
    expected = rotation_from_quaternion(Pose.planar(0.0, 0.0, 0.101).quaternion_wxyz)
    np.testing.assert_allclose(rotation[0], expected, atol=1e-9)


def test_realistic_scanners_repeat_bit_by_bit_and_report_remissions(office: World) -> None:
    suite = sensor_suite("sick_lms111", realistic=True, sun=0.5)

    def drive(seed: int) -> list[Scan]:
        config = SimulationConfig(scanners=suite.scanners)
        simulation = Simulation(office, seed=seed, config=config)
        simulation.command(Twist.planar(0.5, 0.5))
        return readings_of(Scan, simulation, 12)

    first, again, other = drive(3), drive(3), drive(4)
    assert len(first) == 12
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.ranges, b.ranges)
        np.testing.assert_array_equal(a.intensities, b.intensities)
    assert not np.array_equal(first[0].ranges, other[0].ranges, equal_nan=True)
    for scan in first:
        assert len(scan.intensities) == len(scan.ranges) == 541
        assert (scan.intensities >= 0.0).all()
        lit = scan.intensities[np.isfinite(scan.ranges)]
        assert np.median(lit) > 0.1


def test_effects_off_and_on_see_the_same_office(office: World) -> None:
    """Realistic ranges differ from exact ones by what the sheet allows, but for edges and dropouts."""
    exact = tuple(replace(s, sigma=0.0) for s in sensor_suite("sick_lms111").scanners)
    real = sensor_suite("sick_lms111", realistic=True).scanners
    plain, rich = (
        readings_of(Scan, Simulation(office, config=SimulationConfig(scanners=s)), 3)
        for s in (exact, real)
    )
    for a, b in zip(plain, rich, strict=True):
        both = np.isfinite(a.ranges) & np.isfinite(b.ranges)
        assert both.sum() > 0.9 * np.isfinite(a.ranges).sum()
        errors = (b.ranges - a.ranges)[both]
        assert np.percentile(np.abs(errors), 85) < 0.03 + 3.0 * 0.012


@pytest.mark.parametrize("scene", ["office", "glasshouse"])
def test_scanners_cast_together_give_the_same_scans_as_each_alone(
    scene: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = load_world(scene)
    sizes: list[int] = []
    trace_beams = LightTracer.trace_beams

    def counted(tracer: LightTracer, starts: FloatArray, *rest: Any) -> Echoes:
        sizes.append(starts.shape[2])
        return trace_beams(tracer, starts, *rest)

    def drive() -> list[Scan]:
        sizes.clear()
        scanners = sensor_suite("sick_lms111", realistic=True).scanners
        simulation = Simulation(world, seed=5, config=SimulationConfig(scanners=scanners))
        simulation.command(Twist.planar(0.4, 0.6))
        return readings_of(Scan, simulation, 9)

    monkeypatch.setattr(LightTracer, "trace_beams", counted)
    together = drive()
    assert set(sizes) == {2 * 541}
    monkeypatch.setattr(LightTracer, "traces_like", lambda tracer, other: False)
    alone = drive()
    assert set(sizes) == {541}
    assert len(together) == len(alone) >= 8
    for a, b in zip(together, alone, strict=True):
        assert a.scanner == b.scanner
        np.testing.assert_array_equal(a.ranges, b.ranges)
        np.testing.assert_array_equal(a.intensities, b.intensities)


def test_scanners_with_different_effects_are_cast_separately(office: World) -> None:
    """With or without a footprint, far or near: the other scanner sees what it does beside its like."""
    wide, like = sensor_suite("sick_lms111", realistic=True).scanners
    thin = replace(like, effects=replace(like.effects, mixing=None))

    def seen_by_wide(other: ScannerConfig) -> list[Scan]:
        simulation = Simulation(office, seed=2, config=SimulationConfig(scanners=(wide, other)))
        return [scan for scan in readings_of(Scan, simulation, 4) if scan.scanner == wide.name]

    expected = seen_by_wide(like)
    assert expected
    for other in (thin, replace(like, range_max=1.0)):
        for a, b in zip(seen_by_wide(other), expected, strict=True):
            np.testing.assert_array_equal(a.ranges, b.ranges)


def test_scanner_in_the_glasshouse_sees_through_its_walls() -> None:
    world = load_world("glasshouse")
    plain, rich = (
        readings_of(
            Scan,
            Simulation(
                world,
                config=SimulationConfig(
                    scanners=sensor_suite("sick_lms111", realistic=realistic).scanners[:1]
                ),
            ),
            3,
        )[0]
        for realistic in (False, True)
    )
    both = np.isfinite(plain.ranges) & np.isfinite(rich.ranges)
    beyond = rich.ranges[both] - plain.ranges[both] > 0.2
    assert both.sum() > 450
    assert 0.4 < beyond.mean() < 0.8
