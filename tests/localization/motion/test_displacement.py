from __future__ import annotations

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.motion.displacement import (
    arc_step,
    odometry_step,
    planar_step,
    speed_step,
    with_turn,
)
from localization.motion.odometry_noise import (
    OdometryNoise,
    StepVariance,
    planar_covariance,
    step_variance,
)
from localization.types import SECOND, Odometry, Pose, Twist, WheelSpeeds
from tests.support import floats, poses
from tests.support_rooms import apart

NOISE = OdometryNoise()
TURNS = floats(-3.0, 3.0)
WAYS = floats(-3.0, 3.0)
STEPS = st.builds(Pose.planar, WAYS, WAYS, TURNS)


def arc_length(step: Pose) -> float:
    """Return the signed length of a motion's arc in the direction in which the robot looks [m].

    A chord is turned from the start by half of the arc's turn, and shorter than the arc.
    """
    half = 0.5 * step.yaw
    x, y = step.position[:2].tolist()
    longer = half / math.sin(half) if abs(half) > 1e-6 else 1.0
    return float((x * math.cos(half) + y * math.sin(half)) * longer)


def added(step: Pose, seconds: float = 0.1) -> StepVariance:
    return step_variance(step, seconds, NOISE)


@given(st.builds(Pose.planar, floats(-50, 50), floats(-50, 50), floats(-3.1, 3.1)), STEPS)
def test_step_between_two_poses_leads_from_one_to_the_other(before: Pose, step: Pose) -> None:
    assert apart(planar_step(before, before @ step), step)[0] < 1e-9
    assert planar_step(before, before @ step).yaw == pytest.approx(step.yaw, abs=1e-9)


@given(poses(20.0), poses(3.0))
def test_step_is_planar_whatever_the_attitude(before: Pose, other: Pose) -> None:
    step = planar_step(before, before @ other)
    assert step.position[2] == 0.0
    assert step.rotation[2] == pytest.approx([0.0, 0.0, 1.0])


@given(WAYS, TURNS)
def test_arc_has_the_length_and_the_turn_it_was_made_of(distance: float, turn: float) -> None:
    step = arc_step(distance, turn)
    assert step.yaw == pytest.approx(turn, abs=1e-9)
    assert arc_length(step) == pytest.approx(distance, abs=1e-9)


@given(WAYS, TURNS)
def test_arc_is_the_sum_of_its_parts(distance: float, turn: float) -> None:
    parts = Pose.identity()
    for _ in range(50):
        parts = parts @ arc_step(distance / 50, turn / 50)
    assert apart(parts, arc_step(distance, turn))[0] < 1e-9


@given(STEPS)
def test_sideways_motion_has_no_length_ahead(step: Pose) -> None:
    half = 0.5 * step.yaw
    aside = Pose.planar(-0.4 * math.sin(half), 0.4 * math.cos(half), step.yaw)
    assert arc_length(aside) == pytest.approx(0.0, abs=1e-12)


@given(STEPS, TURNS)
def test_step_with_another_turn_is_of_the_same_length(step: Pose, turn: float) -> None:
    turned = with_turn(step, turn)
    assert turned.yaw == pytest.approx(turn, abs=1e-9)
    assert np.hypot(*turned.position[:2]) == pytest.approx(np.hypot(*step.position[:2]))
    assert apart(with_turn(turned, step.yaw), step)[0] < 1e-9


@given(floats(0.1, 3.0), floats(0.3, 1.5), floats(0.5, 1.9))
def test_arc_with_another_turn_is_the_chord_of_nearly_that_arc(
    way: float, turn: float, ratio: float
) -> None:
    """The chord's direction is exact; its length is that of the arc counted, some per cent off."""
    turned, arc = with_turn(arc_step(way, turn), ratio * turn), arc_step(way, ratio * turn)
    direction = math.atan2(turned.position[1], turned.position[0])
    assert direction == pytest.approx(math.atan2(arc.position[1], arc.position[0]), abs=1e-9)


@given(STEPS, floats(0.0, 5.0))
def test_variances_are_never_negative(step: Pose, seconds: float) -> None:
    assert min(astuple(added(step, seconds))) >= 0.0


def test_without_motion_and_time_nothing_is_added() -> None:
    assert astuple(added(Pose.identity(), 0.0)) == (0.0,) * 6


@given(WAYS, TURNS, st.integers(2, 40))
def test_variances_of_parts_add_up_however_often_the_odometry_is_read(
    way: float, turn: float, parts: int
) -> None:
    """Only the chord is a little shorter than the arc."""
    whole = np.array(astuple(step_variance(arc_step(way, turn), 0.0, NOISE)))
    part = np.array(astuple(step_variance(arc_step(way / parts, turn / parts), 0.0, NOISE)))
    short = abs(np.sinc(0.5 * turn / np.pi))
    assert (whole <= parts * part + 1e-15).all()
    assert (whole >= short * parts * part - 1e-15).all()


@given(floats(0.01, 3.0), TURNS)
def test_stamps_hardly_matter(way: float, turn: float) -> None:
    """A burst, a pause and everything between: what wheels counted is as good."""
    step = arc_step(way, turn)
    burst, usual, pause, longer = (
        np.array(astuple(added(step, seconds))) for seconds in (1e-4, 0.1, 3.0, 600.0)
    )
    assert longer == pytest.approx(pause)
    assert (pause - burst)[:2].max() <= NOISE.idle**2 + 1e-15
    assert usual[0] == pytest.approx(burst[0], rel=0.01)


def test_wheels_of_real_floors_are_within_the_bounds_of_the_noise() -> None:
    """Five to seven degrees per metre at the 95th percentile were measured."""
    sigma = math.degrees(math.sqrt(added(Pose.planar(1.0, 0.0, 0.0), 2.0).heading))
    assert 5.0 <= 1.96 * sigma <= 7.0


def test_base_that_counts_anew_gives_no_step() -> None:
    far = Odometry(SECOND, Pose.planar(50.0, 0.0, 0.0))
    assert odometry_step(far, Odometry(2 * SECOND, Pose.identity())) is None


def test_rim_speeds_are_steps_but_over_a_pause() -> None:
    before, after = WheelSpeeds(0, 0.0, 0.0), WheelSpeeds(SECOND // 20, 0.4, 0.6)
    step = speed_step(before, after, 0.5)
    assert step is not None
    assert (arc_length(step), step.yaw) == pytest.approx((0.025, 0.02))
    assert speed_step(before, replace(after, stamp=2 * SECOND), 0.5) is None
    assert speed_step(before, replace(after, stamp=0), 0.5) is None


def test_velocities_at_both_ends_are_averaged_and_none_is_rest() -> None:
    moving = Odometry(
        SECOND // 10, Pose.identity(), Twist(np.array([1.0, 0.2, 0.0]), np.array([0.0, 0.0, 0.4]))
    )
    for before, share in ((replace(moving, stamp=0), 1.0), (Odometry(0, Pose.identity()), 0.5)):
        step = speed_step(before, moving, 0.5)
        assert step is not None
        # Half of the turn leads the way to the left, by next to nothing.
        assert (arc_length(step), step.yaw) == pytest.approx((0.1 * share, 0.04 * share), rel=1e-3)
        assert step.position[1] == pytest.approx(0.02 * share + 0.002 * share**2, rel=1e-3)


def test_covariance_of_a_displacement_holds_the_ratio_of_its_turns() -> None:
    turn = Pose.planar(0.0, 0.0, 1.0)
    plain, loose = (planar_covariance(turn, 0.1, NOISE, ratio) for ratio in (0.0, 0.2))
    assert loose[2, 2] - plain[2, 2] == pytest.approx(0.04)
    variance = added(turn)
    assert np.diag(plain) == pytest.approx([variance.along, variance.aside, variance.heading])
