"""Courses: what is made of a client's motion, and what is refused with joint and value."""

from __future__ import annotations

import math

import numpy as np
import pytest

from localization.geometry import FloatArray
from teleop.robot.arm.courses import MOST_POINTS, Course, CourseError, planned, timed
from teleop.robot.arm.timed_curve import TimedCurve
from tests.teleop.robot.arm.support import TABLE

STANDING = np.zeros(5)
SWING = np.array([[0.0] * 5, [0.5, 0.4, -0.2, 0.0, 0.1], [0.0, 0.8, 0.0, 0.3, 0.0]])
TIMES = (0.0, 1.0, 2.0)


def curve_of(course: Course) -> TimedCurve:
    (piece,) = course.pieces
    assert isinstance(piece, TimedCurve)
    return piece


def test_a_timed_motion_begins_and_ends_at_rest_at_its_points() -> None:
    curve = curve_of(timed(TIMES, SWING, STANDING, TABLE))
    angles, rates, accelerations = curve.at(np.array([0.0, curve.length, curve.length + 1.0]))
    np.testing.assert_allclose(angles, SWING[[0, 2, 2]], atol=1e-12)
    np.testing.assert_allclose(rates, 0.0, atol=1e-9)
    np.testing.assert_allclose(accelerations, 0.0, atol=1e-6)


def test_a_timed_motion_passes_its_points_in_time_and_lasts_a_tick_longer() -> None:
    course = timed(TIMES, SWING, STANDING, TABLE)
    curve = curve_of(course)
    assert course.note == ""
    assert curve.stretch == 1.0
    assert curve.length / curve.pace.rate < 2.15
    middle = curve.at(np.array([0.5 * curve.length]))[0, 0]
    # A corner of half a radian per second is rounded by less than half a degree.
    np.testing.assert_allclose(middle, SWING[1], atol=math.radians(0.5))


def test_a_timed_motion_stays_between_the_extremes_of_its_points() -> None:
    chance = np.random.default_rng(0)
    points = chance.uniform(-0.7, 0.7, (60, 5))
    points[0] = 0.0
    curve = curve_of(timed(list(np.arange(60) * 0.3), points, STANDING, TABLE))
    passed = curve.at(np.linspace(0.0, curve.length, 3000))[0]
    assert (passed <= points.max(axis=0) + 1e-9).all()
    assert (passed >= points.min(axis=0) - 1e-9).all()


def test_derivatives_are_those_of_the_angles() -> None:
    curve = curve_of(timed(TIMES, SWING, STANDING, TABLE))
    step = 1e-5
    places = np.linspace(0.1, curve.length - 0.1, 50)
    before, here, after = (curve.at(places + shift) for shift in (-step, 0.0, step))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), here[1], atol=1e-5)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * step), here[2], atol=1e-3)


def test_a_dense_recording_keeps_its_duration() -> None:
    times = np.arange(500) * 0.02
    points = np.outer(np.sin(2.0 * times), [0.8, 0.3, 0.2, 0.1, 0.4])
    course = timed(list(times), points, STANDING, TABLE)
    curve = curve_of(course)
    assert course.note == ""
    lag = 0.5 * (curve.length - times[-1])
    passed = curve.at(times + lag)[0]
    assert np.abs(passed - points).max() < math.radians(1.2)


def test_what_is_too_fast_is_stretched_and_said() -> None:
    far = np.array([[0.0] * 5, [1.0, 0.0, 0.0, 0.0, 0.0]])
    course = timed((0.0, 0.05), far, STANDING, TABLE)
    curve = curve_of(course)
    assert curve.stretch > 4.0
    assert course.note.startswith(f"stretched to {curve.stretch:.2f} times its duration")
    assert curve.length / curve.pace.rate < 0.7


def test_times_a_nanosecond_apart_take_no_longer_than_the_bounds_ask_for() -> None:
    to_and_fro = np.array([[0.0] * 5, [1.0, 0.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0, 0.0]])
    curve = curve_of(timed((0.0, 1e-9, 2e-9), to_and_fro, STANDING, TABLE))
    assert curve.length / curve.pace.rate < 2.0


def test_a_first_point_later_than_zero_is_reached_from_where_the_arm_stands() -> None:
    goal = np.array([[0.8, 0.3, -0.4, 0.0, 0.0]])
    course = timed((2.0,), goal, STANDING, TABLE)
    np.testing.assert_array_equal(course.begin, STANDING)
    np.testing.assert_array_equal(course.end, goal[0])
    assert curve_of(course).length == pytest.approx(2.0, abs=0.1)


def test_one_point_at_time_zero_where_the_arm_stands_is_done_at_once() -> None:
    course = timed((0.0,), STANDING[None] + 0.01, STANDING, TABLE)
    assert course.pieces == ()


def test_a_planned_way_is_straight_between_its_corners() -> None:
    way = np.array([[0.0] * 5, [0.0] * 5, [1.0, -0.5, 0.0, 0.0, 0.0], [1.0, 0.5, 0.2, 0.0, 0.0]])
    course = planned(way, TABLE)
    assert len(course.pieces) == 2
    assert course.pieces[0].length == pytest.approx(1.0)
    half = course.pieces[0].at(np.array([0.5]))[0, 0]
    np.testing.assert_allclose(half, [0.5, -0.25, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(course.pieces[1].at(np.array([2.0]))[0, 0], way[-1])


BEYOND = np.array([[0.0] * 5, [0.0, 2.5, 0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("times", "points", "words"),
    [
        ((0.0, 1.0), BEYOND, r"points\[1\]: arm_joint_2 must be -45.0 to 135.0 degrees, got 143.2"),
        (
            (0.0, 1.0),
            BEYOND[::-1] - 0.4,
            r"points\[0\]: arm_joint_2 must begin within 3 degrees of"
            r" where it stands, 0.0, got 120.3; or give it a time later than 0",
        ),
        ((0.0, 0.0), SWING[:2], r"points\[1\]: times must rise from 0 on, got 0 s"),
        ((1.0, 0.5), SWING[:2], r"points\[1\]: times must rise from 0 on, got 0.5 s"),
        ((-1.0, 0.5), SWING[:2], r"points\[0\]: times must rise from 0 on, got -1 s"),
        ((0.0, 1e9), SWING[:2], r"it must take at most 600 s, got 1e\+09 s"),
        ((0.0, 1.0), SWING[:2] * math.nan, "points must be finite numbers"),
        ((0.0, math.inf), SWING[:2], "points must be finite numbers"),
        (
            (),
            np.empty((0, 5)),
            "points must be 1 to 1000 of 5 angles, each with its time; got 0 times",
        ),
        ((0.0, 1.0), SWING, r"got 2 times and points of shape \(3, 5\)"),
        (tuple(range(MOST_POINTS + 1)), np.zeros((MOST_POINTS + 1, 5)), "points must be 1 to 1000"),
    ],
)
def test_a_bad_motion_is_refused_with_joint_and_value(
    times: tuple[float, ...],
    points: FloatArray,
    words: str,
) -> None:
    with pytest.raises(CourseError, match=words):
        timed(times, points, STANDING, TABLE)
