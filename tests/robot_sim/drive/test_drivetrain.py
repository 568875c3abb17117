"""Limits and ramps of the drivetrain, alone and under the robot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.types import Twist, WheelSpeeds
from robot_sim.drive.drivetrain import DriveConfig, Drivetrain, SlipFault, ramp
from robot_sim.robot.p3at import P3AT
from robot_sim.simulation import Simulation, SimulationConfig
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND, readings_of, run

speeds = st.floats(-5.0, 5.0)


@given(now=speeds, target=speeds)
def test_ramp_never_overshoots_and_never_exceeds_its_steps(now: float, target: float) -> None:
    after = ramp(now, target, gain=0.1, loss=0.2)
    assert abs(after - now) <= 0.2 + 1e-12
    assert min(now, target) - 1e-12 <= after <= max(now, target) + 1e-12
    if abs(after) > abs(now):
        assert abs(after - now) <= 0.1 + 1e-12


def settled(forward: float, turn: float) -> tuple[float, float]:
    """Return the forward speed and yaw rate that a drive settles at."""
    drive = Drivetrain(DriveConfig(), P3AT())
    drive.command(Twist.planar(forward, turn))
    for _ in range(2000):
        left, right = drive.advance(0.01)
    radius = P3AT().rolling_radius
    return 0.5 * (left + right) * radius, (right - left) * radius / P3AT().effective_track


@given(forward=speeds, turn=speeds)
@settings(max_examples=25, deadline=None)
def test_limits_hold_and_the_curve_is_kept(forward: float, turn: float) -> None:
    v, w = settled(forward, turn)
    c, robot = DriveConfig(), P3AT()
    assert abs(v) <= c.max_speed + 1e-9
    assert abs(w) <= c.max_turn + 1e-9
    rim = abs(v) + abs(w) * 0.5 * robot.effective_track
    assert rim <= robot.wheel_rate * robot.rolling_radius + 1e-9
    assert v * turn == pytest.approx(w * forward, abs=1e-9)


@given(
    commands=st.lists(st.tuples(speeds, speeds), min_size=1, max_size=6),
    ticks=st.integers(1, 40),
)
@settings(max_examples=25, deadline=None)
def test_advance_tick_equals_single_steps(commands: list[tuple[float, float]], ticks: int) -> None:
    at_once, stepwise = Drivetrain(DriveConfig(), P3AT()), Drivetrain(DriveConfig(), P3AT())
    for forward, turn in commands:
        at_once.command(Twist.planar(forward, turn))
        stepwise.command(Twist.planar(forward, turn))
        for _ in range(ticks):
            rates = at_once.advance_tick(10, 0.002)
            assert rates.tolist() == [list(stepwise.advance(0.002)) for _ in range(10)]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_drivetrain_rejects_commands_that_are_not_finite(bad: float) -> None:
    drive = Drivetrain(DriveConfig(), P3AT())
    with pytest.raises(ValueError, match="finite"):
        drive.command(Twist.planar(bad, 0.0))
    with pytest.raises(ValueError, match="finite"):
        drive.command(Twist.planar(0.0, bad))


def test_drive_config_rejects_limits_that_are_not_positive() -> None:
    with pytest.raises(ValueError, match="braking"):
        DriveConfig(braking=0.0)


def test_slip_fault_rejects_a_negative_duration() -> None:
    with pytest.raises(ValueError, match="slip"):
        SlipFault(0, -1, 2.0)


def test_robot_speeds_up_by_its_ramp_drives_straight_and_brakes_in_its_distance(
    field: World,
) -> None:
    simulation = Simulation(field, config=BLIND)
    run(simulation, 30, Twist.planar(0.6, 0.0))
    # 0.5 m/s^2 for 0.6 s, and the wheels follow the ramp 27 ms behind.
    assert simulation.truth().twist.linear[0] == pytest.approx(0.286, abs=0.01)
    run(simulation, 400)
    pose = simulation.truth().map_from_base
    assert simulation.truth().twist.linear[0] == pytest.approx(0.6, rel=0.01)
    assert abs(pose.position[1]) < 0.001
    assert abs(pose.yaw) < math.radians(0.01)

    run(simulation, 60, Twist.planar(0.0, 0.0))
    stopped = simulation.truth()
    # v^2 / 2a = 0.18 m
    assert 0.17 < stopped.map_from_base.position[0] - pose.position[0] < 0.21
    assert abs(stopped.twist.linear[0]) < 0.002


def test_robot_follows_the_commanded_curvature(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    run(simulation, 300, Twist.planar(0.4, 0.5))
    twist = simulation.truth().twist
    assert twist.linear[0] == pytest.approx(0.4, rel=0.02)
    assert twist.angular[2] == pytest.approx(0.5, rel=0.04)


def test_blocked_wheels_do_not_catch_up_after_a_stop() -> None:
    world = parse_world(
        "bounds = [-9, -9, 9, 9]\nspawn = [0, 0, 0]\nceiling = false", name="blocked"
    )
    simulation = Simulation(world, config=BLIND)
    wheels = slice(6, 10)
    simulation._model.dof_damping[wheels] = 1e4
    run(simulation, 300, Twist.planar(0.6, 0.0))
    assert simulation.truth().twist.linear[0] < 0.1
    run(simulation, 60, Twist.planar(0.0, 0.0))
    held = simulation.truth().map_from_base.position[0]
    # Six seconds of unmet command are 33 rad of wheel, 3.6 m of way.
    simulation._model.dof_damping[wheels] = 0.0
    run(simulation, 200)
    assert abs(simulation.truth().map_from_base.position[0] - held) < 0.02
    assert np.abs(simulation._wheel_rates).max() < 0.001


def test_encoders_report_the_rim_speed_within_their_errors(field: World) -> None:
    simulation = Simulation(field, seed=3, config=BLIND)
    simulation.command(Twist.planar(0.5, 0.0))
    readings = readings_of(WheelSpeeds, simulation, 500)[200:]
    left = np.array([r.left for r in readings])
    assert left.mean() == pytest.approx(0.5, rel=0.012)
    assert left.std() == pytest.approx(DriveConfig().encoder_noise, rel=0.2)
    assert all(float(np.float32(r.left)) == r.left for r in readings)


def test_encoders_report_zero_at_rest(field: World) -> None:
    readings = readings_of(WheelSpeeds, Simulation(field, config=BLIND), 60)[10:]
    assert {(r.left, r.right) for r in readings} == {(0.0, 0.0)}


def test_slip_fault_scales_both_sides_while_active(field: World) -> None:
    slip = SlipFault(start_ns=4_000_000_000, duration_ns=1_000_000_000, factor=2.0)
    config = SimulationConfig(drive=DriveConfig(slips=(slip,)), scanners=())
    simulation = Simulation(field, config=config)
    simulation.command(Twist.planar(0.4, 0.0))
    for reading in readings_of(WheelSpeeds, simulation, 300)[150:]:
        expected = 0.8 if slip.active(reading.stamp) else 0.4
        assert reading.left == pytest.approx(expected, rel=0.04)
        assert reading.right == pytest.approx(expected, rel=0.04)
    assert simulation.truth().twist.linear[0] == pytest.approx(0.4, rel=0.01)
