"""The simulation as a whole: time, order, determinism, failure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.types import Inertial, Pose, Reading, Scan, Twist, WheelSpeeds
from robot_sim.errors import PhysicsError, SimulationError, UnknownSceneError, WorldError
from robot_sim.lidar import ScannerConfig
from robot_sim.simulation import TICK_NS, Simulation, SimulationConfig
from robot_sim.worlds import World


def fingerprint(reading: Reading) -> bytes:
    """Return all numbers of a reading, bit by bit."""
    if isinstance(reading, Scan):
        return reading.ranges.tobytes()
    if isinstance(reading, Inertial):
        return reading.angular_velocity.tobytes() + reading.specific_force.tobytes()
    assert isinstance(reading, WheelSpeeds)
    return np.array([reading.left, reading.right]).tobytes()


def run(world: World, *, seed: int, config: SimulationConfig | None = None) -> list[Reading]:
    simulation = Simulation(world, seed=seed, config=config)
    readings: list[Reading] = []
    for tick in range(60):
        simulation.command(Twist.planar(0.4, 0.6 if tick > 30 else -0.3))
        readings += simulation.step()
    return readings


def test_same_seed_gives_the_same_bits_and_another_seed_does_not(room: World) -> None:
    first, again, other = (run(room, seed=s) for s in (7, 7, 8))
    assert [fingerprint(r) for r in first] == [fingerprint(r) for r in again]
    moving = [(a, b) for a, b in zip(first, other, strict=True) if a.stamp > 100_000_000]
    assert all(fingerprint(a) != fingerprint(b) for a, b in moving)


def test_a_sensor_less_leaves_the_others_as_they_are(room: World) -> None:
    def without_horizontal(readings: list[Reading]) -> list[bytes]:
        return [fingerprint(r) for r in readings
                if not (isinstance(r, Scan) and r.scanner == "laser_horizontal")]  # fmt: skip

    alone = SimulationConfig(scanners=(ScannerConfig("laser_vertical"),))
    full, less = run(room, seed=2), run(room, seed=2, config=alone)
    assert without_horizontal(full) == without_horizontal(less)


def end(reading: Reading) -> int:
    return reading.end_stamp if isinstance(reading, Scan) else reading.stamp


def test_readings_come_in_the_order_in_which_they_end_and_when_due(room: World) -> None:
    simulation = Simulation(room)
    seen: list[Reading] = []
    for tick in range(1, 51):
        readings = simulation.step()
        assert simulation.stamp == simulation.truth().stamp == tick * TICK_NS
        assert all(simulation.stamp - TICK_NS < end(r) <= simulation.stamp for r in readings)
        assert [type(r) for r in readings[-2:]] == [WheelSpeeds, Inertial]
        seen += readings
    ends = [end(r) for r in seen]
    assert ends == sorted(ends)
    assert sum(isinstance(r, Scan) for r in seen) == 20


def test_start_pose_overrides_the_spawn(room: World) -> None:
    simulation = Simulation(room, start=Pose.planar(6.0, 5.0, 1.0))
    pose = simulation.truth().map_from_base
    np.testing.assert_allclose(pose.position, [6.0, 5.0, 0.0], atol=1e-3)
    assert pose.yaw == pytest.approx(1.0)


def test_robot_cannot_start_inside_a_wall(room: World) -> None:
    with pytest.raises(WorldError, match="stand inside east_0"):
        Simulation(room, start=Pose.planar(9.95, 4.0, 0.0))


def test_unknown_scene_lists_those_there_are() -> None:
    with pytest.raises(UnknownSceneError, match=r"'moon'; available: .*office") as caught:
        Simulation("moon")
    assert "office" in caught.value.available


@pytest.mark.parametrize("poison", [np.nan, np.inf, 1e11])
def test_unstable_physics_is_one_clear_line_and_leaves_no_file(
    field: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, poison: float
) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = Simulation(field, config=SimulationConfig(scanners=()))
    simulation.step()
    simulation._data.qvel[0] = poison
    with pytest.raises(
        PhysicsError, match=r"unstable at 0\.0[24]0 s: a \w+ is not finite"
    ) as caught:
        simulation.step()
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, SimulationError)
    assert list(tmp_path.iterdir()) == []


def test_spinning_robot_has_the_twist_that_its_poses_show(field: World) -> None:
    simulation = Simulation(field, config=SimulationConfig(scanners=()))
    simulation.command(Twist.planar(0.4, 0.5))
    for _ in range(200):
        simulation.step()
    before = simulation.truth()
    simulation.step()
    moved = before.map_from_base.inverse() @ simulation.truth().map_from_base
    np.testing.assert_allclose(moved.position / 0.02, before.twist.linear, atol=5e-3)
    assert moved.yaw / 0.02 == pytest.approx(before.twist.angular[2], rel=1e-3)
