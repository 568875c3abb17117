"""Slip and centres of rotation against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import Twist
from robot_sim.drive.wheel_slip import centres_of_rotation, contact_positions, slip_of
from robot_sim.robot.imperfections import MANDOW_2007
from robot_sim.robot.platforms import HUSKY, JACKAL, P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.simulation import Simulation
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND, run

speeds = st.floats(-2.0, 2.0)
turns = st.floats(0.01, 3.0) | st.floats(-3.0, -0.01)
robots = st.sampled_from([P3AT(), HUSKY, JACKAL])


@given(robot=robots, turn=turns)
def test_in_place_the_centres_lie_chi_half_tracks_to_each_side(
    robot: SkidSteer, turn: float
) -> None:
    rim = 0.5 * robot.effective_track * turn
    rate = rim / robot.true_rolling_radius("left")
    slip = slip_of(robot, 0.0, 0.0, turn, np.array([-rate, rate, -rate, rate]))
    assert slip.icr_x == pytest.approx(0.0)
    assert slip.icr_left == pytest.approx(0.5 * robot.effective_track)
    assert slip.icr_right == pytest.approx(-0.5 * robot.effective_track)
    share = np.hypot(slip.longitudinal, slip.lateral) / abs(rim)
    a, b = 0.5 * robot.wheelbase, 0.5 * robot.track
    np.testing.assert_allclose(share, math.hypot(1 - 1 / robot.chi, a / b / robot.chi))


@given(vx=speeds, vy=speeds, turn=turns, left=speeds, right=speeds)
def test_tread_stands_still_at_its_centre_of_rotation(
    vx: float, vy: float, turn: float, left: float, right: float
) -> None:
    x, y_left, y_right = centres_of_rotation(vx, vy, turn, left, right)
    assert vy + turn * x == pytest.approx(0.0, abs=1e-9)
    assert vx - turn * y_left == pytest.approx(left, abs=1e-9)
    assert vx - turn * y_right == pytest.approx(right, abs=1e-9)


@given(robot=robots, v=speeds, turn=turns)
def test_wheels_that_roll_without_slip_along_have_the_axles_as_centres(
    robot: SkidSteer, v: float, turn: float
) -> None:
    b, radius = 0.5 * robot.track, robot.true_rolling_radius("left")
    left, right = (v - turn * b) / radius, (v + turn * b) / radius
    slip = slip_of(robot, v, 0.0, turn, np.array([left, right, left, right]))
    np.testing.assert_allclose(slip.longitudinal, 0.0, atol=1e-12)
    np.testing.assert_allclose(slip.lateral, turn * contact_positions(robot)[0], atol=1e-12)
    assert (slip.icr_left, slip.icr_right) == pytest.approx((b, -b))


def test_centres_of_rotation_are_nan_while_the_robot_does_not_turn() -> None:
    for turn in (0.0, 9e-4, -9e-4, math.nan):
        assert all(math.isnan(c) for c in centres_of_rotation(0.5, 0.0, turn, 0.5, 0.5))


def test_rims_run_on_the_tyres_true_radii() -> None:
    robot = replace(P3AT(), imperfections=MANDOW_2007)
    slip = slip_of(robot, 0.0, 0.0, 0.0, np.ones(4))
    assert -slip.longitudinal[0] == pytest.approx(0.9464 * 0.111, abs=6e-4)
    assert -slip.longitudinal[1] == pytest.approx(0.9253 * 0.111, abs=6e-4)


def test_truth_has_slip_and_centres_of_a_robot_turning_in_place(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    assert math.isnan(simulation.truth().slip.icr_left)
    run(simulation, 100, Twist.planar(0.0, 1.0))
    slip, robot = simulation.truth().slip, field.robot
    assert slip.icr_left == pytest.approx(0.5 * robot.effective_track, rel=0.02)
    assert slip.icr_right == pytest.approx(-0.5 * robot.effective_track, rel=0.02)
    assert abs(slip.icr_x) < 0.01
    assert (np.sign(slip.lateral) == [1.0, 1.0, -1.0, -1.0]).all()
    assert (np.sign(slip.longitudinal) == [1.0, -1.0, 1.0, -1.0]).all()
    with pytest.raises(ValueError, match="read-only"):
        slip.lateral[0] = 0.0
