"""Dead reckoning of a base whose wheels and inertial unit are made up, and so are their errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

from localization.filter.dead_reckoning import DeadReckoner
from localization.filter.ekf_config import EkfConfig
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import SECOND, Inertial, Odometry, Pose

PERIOD = SECOND // 20
FORCE = np.array([0.0, 0.0, 9.81])


@dataclass(frozen=True)
class Course:
    """A drive of constant speed and turn rate over a slope, with the errors of its sensors."""

    seconds: float = 10.0
    speed: float = 0.5
    rate: float = 0.4
    pitch: float = 0.0
    heading: float = 0.0
    scale: float = 0.0
    heading_error: float = 0.0
    wheel_turn: float = 1.0
    """Turn that the wheels measure, as a multiple of the true one."""
    bias: float = 0.0
    oriented: bool = True
    sigma: tuple[float, float, float] | None = (0.01, 0.01, 0.02)
    gyro: bool = True

    def pose(self, stamp: int) -> Pose:
        """True pose, from the origin."""
        seconds = stamp / SECOND
        turn = self.rate * seconds
        chord = self.speed * seconds * np.sinc(0.5 * turn / math.pi)
        flat = Pose.planar(chord * math.cos(0.5 * turn), chord * math.sin(0.5 * turn), turn)
        return Pose.from_euler([0, 0, 0], pitch=self.pitch, yaw=self.heading) @ flat

    def readings(self) -> Iterator[Inertial | Odometry]:
        """What the sensors say, in order."""
        tilted = Pose.from_euler([0, 0, 0], yaw=self.heading_error)
        odom = Pose.planar(3.0, -2.0, 0.7)
        for i in range(int(self.seconds * SECOND) // PERIOD + 1):
            stamp = i * PERIOD
            if self.gyro:
                orientation = (tilted @ self.pose(stamp)).quaternion_wxyz
                yield Inertial(
                    stamp,
                    np.array([0.0, 0.0, self.rate + self.bias]),
                    FORCE,
                    orientation if self.oriented else None,
                    None if self.sigma is None or not self.oriented else np.array(self.sigma),
                )
            if i:
                half = 0.5 * self.wheel_turn * self.rate * PERIOD / SECOND
                arc = (1.0 + self.scale) * self.speed * PERIOD / SECOND
                chord = arc * (math.sin(half) / half if half else 1.0)
                odom = odom @ Pose.planar(
                    chord * math.cos(half), chord * math.sin(half), 2.0 * half
                )
            yield Odometry(stamp, odom)


def noise(*, gyro: bool = True, flat: bool = False) -> EkfConfig:
    motion = Motion.ODOMETRY_AND_GYRO if gyro else Motion.ODOMETRY
    return EkfConfig.of(SensorConfiguration(motion, flat))


def reckoned(
    readings: Iterator[Inertial | Odometry],
    *,
    flat: bool = False,
    gyro: bool = True,
    config: EkfConfig | None = None,
) -> DeadReckoner:
    state = DeadReckoner.begun(config or noise(gyro=gyro, flat=flat), flat=flat, gyro=gyro)
    for reading in readings:
        state = state.take(reading)
    return state


def at(state: DeadReckoner) -> Pose:
    """Pose in the unit's world, if it reports a heading."""
    return Pose.planar(0.0, 0.0, state.first_yaw or 0.0) @ state.pose


def off(state: DeadReckoner, true: Pose) -> float:
    return float(np.linalg.norm(at(state).position - true.position))


END = 10 * SECOND


@pytest.mark.parametrize("wheel_turn", [0.5, 1.0, 1.85, 7.0, -1.0])
def test_reported_orientation_makes_the_turns_of_the_wheels_irrelevant(wheel_turn: float) -> None:
    course = Course(wheel_turn=wheel_turn, heading=0.6, pitch=0.1)
    state = reckoned(course.readings())
    assert off(state, course.pose(END)) < 0.005
    assert abs(at(state).yaw - course.pose(END).yaw) < 1e-3
    assert state.wheel_turned == 0


def test_drive_begins_at_the_origin_with_the_first_heading_that_is_reported() -> None:
    course = Course(heading=1.2)
    readings = list(course.readings())
    late = [r for r in readings if isinstance(r, Odometry) or r.stamp >= SECOND]
    for given in (readings, late):
        state = reckoned(iter(given))
        assert off(state, course.pose(END)) < 0.02
    assert reckoned(iter(readings)).first_yaw == pytest.approx(1.2)


def test_slope_that_is_reported_gives_height_unless_the_ground_is_level() -> None:
    course = Course(rate=0.0, pitch=-0.1)
    assert reckoned(course.readings()).pose.position[2] == pytest.approx(
        0.5 * 10 * math.sin(0.1), abs=1e-3
    )
    level = reckoned(course.readings(), flat=True)
    assert level.pose.position.tolist() == pytest.approx([5.0, 0.0, 0.0], abs=1e-6)


def test_gyro_turns_the_drive_between_reports_and_without_any() -> None:
    course = Course(oriented=False, wheel_turn=1.85)
    assert off(reckoned(course.readings()), course.pose(END)) < 0.01
    whole = Course(wheel_turn=1.85, heading=0.3)
    seldom = (
        replace(r, orientation=None, orientation_sigma=None)
        if isinstance(r, Inertial) and r.stamp % SECOND
        else r
        for r in whole.readings()
    )
    assert off(reckoned(seldom), whole.pose(END)) < 0.01


def test_wheels_turn_the_drive_where_there_is_no_gyro_and_say_how_unsure_they_are() -> None:
    course = Course(gyro=False)
    state = reckoned(course.readings(), gyro=False)
    assert off(state, course.pose(END)) < 1e-6
    oriented = reckoned(Course().readings())
    assert state.covariance[5, 5] > 100.0 * oriented.covariance[5, 5]


@pytest.mark.parametrize("wheel_turn", [0.5, 0.7, 1.4, 1.85])
@pytest.mark.parametrize("rate", [0.05, 0.1])
def test_covariance_covers_wheels_that_turn_too_little_or_too_much(
    wheel_turn: float, rate: float
) -> None:
    course = Course(gyro=False, rate=rate, wheel_turn=wheel_turn)
    state = reckoned(course.readings(), gyro=False)
    error = state.pose.position - course.pose(END).position
    # Chi-square of two degrees of freedom, 99 %; beyond a radian the error is not Gaussian any more.
    assert error[:2] @ np.linalg.solve(state.covariance[:2, :2], error[:2]) < 9.2


Kept = Callable[[Inertial | Odometry], bool]


@pytest.mark.parametrize(
    ("oriented", "kept", "by_wheels"),
    [
        (True, lambda r: isinstance(r, Odometry) or not 4 < r.stamp / SECOND < 8, range(71, 90)),
        (True, lambda r: isinstance(r, Inertial) or not 4 < r.stamp / SECOND < 7, range(1)),
        (False, lambda r: isinstance(r, Odometry) or r.stamp % SECOND < 0.6 * SECOND, None),
    ],
    ids=["unit falls silent", "pause of the odometry with a turn", "gyro returns"],
)
def test_readings_that_are_missing_are_bridged_by_the_others_and_no_turn_counts_twice(
    oriented: bool, kept: Kept, by_wheels: range | None
) -> None:
    course = Course(heading=0.5 if oriented else 0.0, oriented=oriented)
    state = reckoned(filter(kept, course.readings()))
    assert off(state, course.pose(END)) < 0.02
    assert by_wheels is None or state.wheel_turned in by_wheels


@pytest.mark.parametrize("shake", [0, 1, 2])
def test_stamps_of_the_odometry_hardly_matter(shake: int) -> None:
    """In bursts, shaken by 50 ms, or all equal: a step is a displacement."""
    rng = np.random.default_rng(1)
    course = Course(heading=0.2)
    readings: list[Inertial | Odometry] = []
    for r in course.readings():
        if isinstance(r, Odometry):
            stamps = (r.stamp // SECOND * SECOND, max(0, r.stamp + int(5e7 * rng.normal())), 7)
            readings.append(replace(r, stamp=stamps[shake]))
        else:
            readings.append(r)
    assert off(reckoned(iter(readings)), course.pose(END)) < 0.03


def test_sideways_motion_is_kept() -> None:
    begin = Pose.planar(1.0, 2.0, 0.5)
    drive = [Odometry(0, begin), Odometry(PERIOD, begin @ Pose.planar(0.1, 0.3, 0.0))]
    state = reckoned(iter(drive), gyro=False)
    assert state.pose.position.tolist() == pytest.approx([0.1, 0.3, 0.0])


def test_odometry_that_counts_anew_moves_nothing() -> None:
    drive = [Odometry(0, Pose.planar(50, 0, 0)), Odometry(PERIOD, Pose.identity())]
    assert not reckoned(iter(drive), gyro=False).pose.position.any()


def test_bias_of_the_gyro_is_learned_while_the_wheels_rest() -> None:
    rest = Course(speed=0.0, rate=0.0, oriented=False, bias=0.004, seconds=4.0)
    state = reckoned(rest.readings())
    assert state.filter.gyro_bias[2] == pytest.approx(0.004, abs=2e-4)
    assert abs(state.pose.yaw) < 0.002
    driving = reckoned(Course(rate=0.0, oriented=False, bias=0.004).readings())
    assert driving.filter.gyro_bias[2] == 0.0
    assert driving.covariance[5, 5] > 10.0 * state.covariance[5, 5]


def test_bias_that_a_rest_shows_is_taken_back_from_the_way_before_it() -> None:
    bias = 0.004
    drive = Course(rate=0.0, oriented=False, bias=bias)
    readings = list(drive.readings())
    state = reckoned(iter(readings))
    assert state.pose.yaw == pytest.approx(10 * bias, abs=1e-3)
    assert off(state, drive.pose(END)) > 0.05
    (last,) = (r.odom_from_base for r in readings if isinstance(r, Odometry) and r.stamp == END)
    for i in range(1, 60):
        stamp = END + i * PERIOD
        state = state.take(Inertial(stamp, np.array([0.0, 0.0, bias]), FORCE))
        state = state.take(Odometry(stamp, last))
    assert state.pose.yaw == pytest.approx(0.0, abs=0.003)
    assert off(state, drive.pose(END)) < 0.02


def test_robot_that_is_turned_while_its_wheels_rest_has_no_bias() -> None:
    """A robot on a turntable: no bias of a gyro explains such a rate."""
    course = Course(speed=0.0, rate=0.2, wheel_turn=0.0, oriented=False, seconds=4.0)
    state = reckoned(course.readings())
    assert state.filter.gyro_bias[2] == 0.0
    assert state.pose.yaw == pytest.approx(0.8, abs=1e-3)


def test_heading_that_a_unit_does_not_know_is_that_of_its_gyro() -> None:
    course = Course(heading_error=1.0, sigma=(0.01, 0.01, 1000.0), pitch=0.05)
    state = reckoned(course.readings())
    straight = replace(course, pitch=0.0)
    assert off(state, straight.pose(END)) < 0.05
    assert state.first_yaw is None
    assert state.report is not None
    assert state.pose.position[2] != 0.0


def test_orientation_that_never_changes_is_ignored_and_the_gyro_turns_with_its_bias_unknown() -> (
    None
):
    """Drivers without a filter of their own write the same quaternion into each message."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    course = Course(oriented=False)
    repeated = [
        replace(r, orientation=level) if isinstance(r, Inertial) else r for r in course.readings()
    ]
    state, gyro = reckoned(iter(repeated)), reckoned(course.readings())
    assert off(state, course.pose(END)) < 0.01
    assert state.covariance[5, 5] == pytest.approx(gyro.covariance[5, 5], rel=0.1)


def test_heading_after_a_silence_is_the_reported_one_whatever_the_wheels_counted_meanwhile() -> (
    None
):
    course = Course(heading=0.5, wheel_turn=1.85)
    silent = lambda r: isinstance(r, Odometry) or not 4 < r.stamp / SECOND < 8  # noqa: E731
    state = reckoned(filter(silent, course.readings()))
    assert abs(at(state).yaw - course.pose(END).yaw) < 0.02


@pytest.mark.slow
def test_covariance_covers_wheels_that_turn_otherwise_and_a_way_that_is_counted_wrong() -> None:
    """Mean of the squared, normalised errors in the plane: 2 if consistent, less if cautious."""
    rng = np.random.default_rng(4)
    ratios = []
    for _ in range(30):
        along, turn = rng.normal(size=2)
        course = Course(
            rate=0.1, seconds=8.0, scale=0.02 * along, wheel_turn=math.exp(0.3 * turn), gyro=False
        )
        state = reckoned(course.readings(), gyro=False)
        error = (state.pose.position - course.pose(8 * SECOND).position)[:2]
        ratios.append(error @ np.linalg.solve(state.covariance[:2, :2], error))
    assert 0.3 < np.mean(ratios) < 2.7
