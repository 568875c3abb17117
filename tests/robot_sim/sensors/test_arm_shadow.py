"""Beams that the arm blocks are invalid, all others are as without an arm; an arm below the plane blocks none."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from localization.types import Pose, Scan
from robot_sim.arm.arm_table import load_arm
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.robot.p3at import MOUNTS
from robot_sim.sensors.arm_shadow import ArmShadow
from robot_sim.sensors.scanner_config import ScannerConfig
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import WorldOptions
from tests.robot_sim.conftest import ROOM

TABLE = load_arm()
SHARP = SimulationConfig(scanners=tuple(ScannerConfig(name, sigma=0.0) for name in MOUNTS))
EDGE = 0.02
"""How far from the arm a beam passes at least that must not be invalid [m]."""


def simulation_with_arm(mount: str, text: str = "") -> Simulation:
    options = WorldOptions(arm="s2", arm_mount=mount)
    return Simulation(parse_world(ROOM + text, name="room", options=options), config=SHARP)


def settled_scans(simulation: Simulation, goal: FloatArray, ticks: int = 100) -> dict[str, Scan]:
    """Move the arm somewhere, and return the last scan of each scanner."""
    assert simulation.arm is not None
    scans: dict[str, Scan] = {}
    for _ in range(ticks):
        simulation.arm.command(goal, 0.0)
        scans |= {r.scanner: r for r in simulation.step() if isinstance(r, Scan)}
    return scans


def blocked(simulation: Simulation, mount: Pose, angles: FloatArray, thicker: float) -> BoolArray:
    """Return which beams of a resting scanner meet the arm by MuJoCo's own rays, the arm thicker by so much [m]."""
    model, data = copy.copy(simulation.world.model), simulation._data
    arm = [g for g in range(model.ngeom) if model.geom(g).name.startswith("arm_")]
    model.geom_group[:] = 0
    model.geom_group[arm] = 1
    model.geom_size[arm] += thicker
    scanner = simulation.truth().map_from_base @ mount
    groups, geom = np.array([0, 1, 0, 0, 0, 0], dtype=np.uint8), np.zeros(1, dtype=np.int32)
    fan = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
    met = [
        mujoco.mj_ray(model, data, scanner.position, ray, groups, 1, -1, geom)
        for ray in fan @ scanner.rotation.T
    ]
    return np.array(met) >= 0.0


def test_a_folded_arm_on_the_bracket_blocks_no_beam() -> None:
    simulation = simulation_with_arm("bracket")
    scans = settled_scans(simulation, np.array(TABLE.poses["stow"]))
    assert set(scans) == set(MOUNTS)
    assert not any(np.isnan(scan.ranges).any() for scan in scans.values())


@pytest.mark.parametrize(
    ("mount", "degrees", "scanner"),
    [
        ("bracket", (20.0, 80.0, -20.0, 0.0, 0.0), "laser_horizontal"),
        ("plate", (0.0, 35.0, -130.0, 0.0, 0.0), "laser_horizontal"),
        ("plate", (-60.0, 20.0, 10.0, 40.0, 60.0), "laser_horizontal"),
    ],
)
def test_blocked_beams_are_invalid_and_no_others(
    mount: str, degrees: tuple[float, ...], scanner: str
) -> None:
    simulation = simulation_with_arm(mount)
    scan = settled_scans(simulation, np.radians(degrees))[scanner]
    invalid = np.isnan(scan.ranges)
    meets = blocked(simulation, MOUNTS[scanner], scan.angles, 0.0)
    assert meets.sum() >= 5
    assert invalid[meets].all()
    assert not invalid[~blocked(simulation, MOUNTS[scanner], scan.angles, EDGE)].any()


def test_a_scanner_whose_plane_is_tilted_has_the_same_shadow() -> None:
    """A plane across the outstretched arm, as that of the vertical scanner, which no arm on its mounts reaches."""
    simulation = simulation_with_arm("bracket")
    settled_scans(simulation, np.radians((30.0, 20.0, -20.0, 0.0, 0.0)))
    mount = Pose.from_euler((0.45, 0.0, 0.6), roll=0.2, pitch=-0.5 * np.pi, yaw=0.1)
    shadow = ArmShadow(simulation._physics.model, simulation._data, {"somewhere": mount})
    angles = np.radians(np.linspace(-180.0, 179.5, 720))
    ranges, times = np.full(len(angles), np.inf), np.zeros(len(angles), dtype=np.int64)
    shadow.cover("somewhere", angles, times, ranges, np.zeros(0))
    invalid, meets = np.isnan(ranges), blocked(simulation, mount, angles, 0.0)
    assert meets.sum() >= 10
    assert invalid[meets].all()
    assert not invalid[~blocked(simulation, mount, angles, EDGE)].any()


def test_a_beam_that_ends_before_the_arm_is_measured() -> None:
    # A wall between the scanner and the outstretched arm to its side, which leans over it.
    post = '[[furniture]]\ntype = "pillar"\nname = "post"\nat = [4.3, 3.35]\nsize = [0.05, 0.05, 2.0]\n'
    simulation = simulation_with_arm("bracket", post)
    scan = settled_scans(simulation, np.radians((80.0, 30.0, 30.0, 0.0, 0.0)))["laser_horizontal"]
    near = scan.ranges[np.isfinite(scan.ranges)].min()
    assert near < 0.5
    free = ~blocked(simulation, MOUNTS[scan.scanner], scan.angles, EDGE)
    assert np.isfinite(scan.ranges[free]).all()


def test_beams_are_invalid_where_the_arm_was_when_they_were_sent() -> None:
    """While the arm swings through the plane, only beams near where it is in that sweep are invalid."""
    simulation = simulation_with_arm("plate")
    start, goal = np.radians((-80.0, 0.0, 0.0, 0.0, 0.0)), np.radians((80.0, 0.0, 0.0, 0.0, 0.0))
    settled_scans(simulation, start)
    assert simulation.arm is not None
    spans = []
    for tick in range(100):
        simulation.arm.command(start + min(1.0, tick / 60) * (goal - start), 0.0)
        for reading in simulation.step():
            if isinstance(reading, Scan) and reading.scanner == "laser_horizontal":
                invalid = np.isnan(reading.ranges)
                angles = np.degrees(reading.angles[invalid])
                spans.append((float(angles.min()), float(angles.max())))
    # The arm's column stands 6.5 cm ahead of the scanner, always in its plane; the arm turns from right to left.
    firsts, lasts = (np.array(side) for side in zip(*spans, strict=True))
    assert firsts[0] < -60.0
    assert lasts[0] < 50.0
    assert firsts[-1] > -50.0
    assert lasts[-1] > 60.0


def test_noise_and_other_beams_are_the_same_as_without_a_shadow() -> None:
    """An arm that moves in the plane changes no beam that passes it."""
    scans = []
    for degrees in ((0.0, 35.0, -130.0, 0.0, 0.0), (40.0, 60.0, -60.0, 0.0, 0.0)):
        options = WorldOptions(arm="s2", arm_mount="plate")
        simulation = Simulation(parse_world(ROOM, name="room", options=options), seed=5)
        scans.append(settled_scans(simulation, np.radians(degrees))["laser_horizontal"].ranges)
    both = np.isfinite(scans[0]) & np.isfinite(scans[1])
    assert both.sum() > 350
    # The robot leans by micrometres with the arm; the noise of 12 mm is drawn alike.
    assert np.abs(scans[0][both] - scans[1][both]).max() < 2e-3
