from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.filter.ekf import EkfConfig
from localization.maps.prepared_map import PreparedMap
from localization.motion.motion_model import MotionModel
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Inertial,
    Odometry,
    Pose,
    Reading,
    Scan,
    Twist,
    WheelSpeeds,
)
from tests.localization.filter.driven_filter import DrivenFilter
from tests.support import floats
from tests.support_rooms import HALL, MOUNTS, TICK, TRACK, Drive

START = Pose.planar(2.6, 1.6, 0.2)
LOOP = ((1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (2.0, 0.0, 0.8), (3.0, 0.4, -0.3), (1.0, 0.0, 0.0))
HORIZONTAL = ("laser_horizontal",)


def added_up(drive: Drive, stamp: int) -> Odometry:
    """What a base says that is 3 % wrong in distance and 4 % in turning, and started elsewhere."""
    step = drive.pose(0).inverse() @ drive.pose(stamp)
    return Odometry(stamp, Pose.planar(9.0, 4.0, 1.0) @ _scaled(step))


def _scaled(step: Pose) -> Pose:
    return Pose.planar(1.03 * step.position[0], 1.03 * step.position[1], 1.04 * step.yaw)


def seen_by(suite: SensorConfiguration, drive: Drive) -> Iterator[Reading]:
    """The readings of a drive that a robot with such sensors has."""
    for reading in drive.readings():
        match reading:
            case Scan():
                yield reading
            case WheelSpeeds():
                if suite.wheels:
                    yield reading
            case Inertial():
                if suite.gyro:
                    yield reading
                if Odometry in suite.leader:
                    yield added_up(drive, reading.stamp)


def localize(
    world: PreparedMap, suite: SensorConfiguration, drive: Drive, scanners: tuple[str, ...]
) -> list[Estimate]:
    """The estimates of a drive, hinted at its start."""
    mounts = {name: MOUNTS[name] for name in scanners}
    localizer = Localizer(world, mounts, LocalizerConfig.of(suite))
    estimates, stamp = [], 0
    for i, reading in enumerate(seen_by(suite, drive)):
        estimate = localizer.add(reading)
        if estimate.stamp > stamp:
            estimates.append(estimate)
            stamp = estimate.stamp
        if i == 20:
            localizer.add(
                Hint(reading.stamp, START @ Pose.planar(0.2, -0.2, 0.1), np.zeros((6, 6)))
            )
    return estimates


# A transverse scanner shows roll, pitch and height; a level one alone does not, and the suite is flat.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("scanners", "flat"), [(tuple(MOUNTS), False), (HORIZONTAL, True)], ids=["both", "horizontal"]
)
@pytest.mark.parametrize("motion", list(Motion))
def test_any_suite_of_sensors_keeps_track_of_the_robot_and_of_its_own_error(
    hall: PreparedMap, motion: Motion, scanners: tuple[str, ...], flat: bool
) -> None:
    drive = Drive(HALL, START, *LOOP, noise=0.012, seed=4, scanners=scanners)
    estimates = localize(hall, SensorConfiguration(motion, flat), drive, scanners)
    placed = [e for e in estimates if e.map_from_base is not None and e.stamp > 2 * SECOND]
    errors, sigmas = [], []
    for estimate in placed:
        assert estimate.map_from_base is not None
        error = drive.pose(estimate.stamp).inverse() @ estimate.map_from_base
        errors.append([*error.position, error.yaw])
        sigmas.append(np.sqrt(np.trace(estimate.covariance[:2, :2])))
    off = np.abs(np.array(errors))
    assert len(placed) > 50
    assert off[:, :2].max() < (0.01 if suite_is_rich(motion) else 0.05)
    assert off[:, 3].max() < np.deg2rad(2.0)
    assert off[:, 2].max() < (0.001 if flat else 0.02)
    # Honest: the error is of the size that the covariance says, on average and at its worst.
    ratios = np.hypot(off[:, 0], off[:, 1]) / sigmas
    assert np.sqrt(np.mean(ratios**2)) < 1.2
    assert ratios.max() < 4.0
    assert {e.health for e in placed} <= {Health.TRACKING, Health.DEGRADED}


def suite_is_rich(motion: Motion) -> bool:
    """Whether speed is measured between sweeps."""
    return motion not in (Motion.GYRO, Motion.SCANNER)


def test_what_a_suite_lacks_is_not_missed(hall: PreparedMap) -> None:
    drive = Drive(HALL, START, (3.0, 0.3, 0.0), scanners=HORIZONTAL)
    last = localize(hall, SensorConfiguration(Motion.ODOMETRY), drive, HORIZONTAL)[-1]
    assert not any("nothing from" in reason for reason in last.reasons)


def test_odometry_that_runs_ahead_is_taken_only_where_it_leads_and_goes_on(
    hall: PreparedMap,
) -> None:
    ahead = [Odometry(60 * SECOND + i * TICK, Pose.identity()) for i in (0, 1, 2)]
    for suite, refused in (
        (SensorConfiguration(Motion.ODOMETRY), 1),
        (SensorConfiguration(Motion.WHEELS), 3),
    ):
        localizer = Localizer(hall, MOUNTS, LocalizerConfig.of(suite))
        localizer.add(Odometry(TICK, Pose.identity()))
        localizer.add(WheelSpeeds(TICK, 0.0, 0.0))
        for reading in ahead:
            localizer.add(reading)
        assert localizer.refused == refused


def test_unknown_motion_is_refused_with_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"motion must be one of .*'odometry'.* got 'legs'"):
        SensorConfiguration("legs")  # type: ignore[arg-type]


@given(
    start=st.tuples(floats(-50, 50), floats(-50, 50), floats(-3.1, 3.1)),
    speed=floats(-1.5, 1.5),
    turn=floats(-2.0, 2.0),
    seconds=floats(0.02, 0.9),
)
def test_poses_along_an_arc_give_its_chord_and_turn_whatever_the_time(
    start: tuple[float, float, float], speed: float, turn: float, seconds: float
) -> None:
    source = MotionModel(SensorConfiguration(Motion.ODOMETRY), track=TRACK, silence=SECOND)
    began, ends = 5 * SECOND, 5 * SECOND + round(seconds * SECOND)
    seconds = (ends - began) / SECOND
    half = 0.5 * turn * seconds
    chord = speed * seconds * np.sinc(half / np.pi)
    step = Pose.planar(chord * np.cos(half), chord * np.sin(half), 2.0 * half)
    source, first = source.take(Odometry(began, Pose.planar(*start)), (0.0, 0.0))
    assert first is not None
    for stamp in (ends, began + 1, began + 30 * SECOND):
        _, then = source.take(Odometry(stamp, Pose.planar(*start) @ step), (0.0, 0.0))
        assert then is not None
        assert then.step is not None
        assert then.step.yaw == pytest.approx(turn * seconds, abs=1e-9)
        assert float(np.hypot(*then.step.position[:2])) == pytest.approx(abs(chord), abs=1e-9)


def beginning_to_turn(wheels_every: int, *, ticks: int = 60) -> Iterator[Reading]:
    """A robot that begins to turn abruptly, its rim speeds estimates as means over so many ticks."""
    rates = [min(1.5, 12.0 * TICK / SECOND * max(0, i - 25)) for i in range(ticks)]
    for i, rate in enumerate(rates, start=1):
        if i % wheels_every == 0:
            across = 0.5 * TRACK * float(np.mean(rates[i - wheels_every : i]))
            yield WheelSpeeds(i * TICK, -across, across)
        yield Inertial(i * TICK, np.array([0.0, 0.0, rate]), np.array([0.0, 0.0, 9.81]))


@pytest.mark.parametrize("wheels_every", [1, 10])
def test_wheels_are_compared_with_the_gyro_over_the_time_they_cover(wheels_every: int) -> None:
    source = MotionModel(SensorConfiguration(), track=TRACK, silence=SECOND // 2)
    ekf = DrivenFilter(EkfConfig(effective_track=TRACK))
    compared, at_once = [], []
    before = np.zeros(3)
    for reading in beginning_to_turn(wheels_every):
        source, increment = source.take(reading, (0.0, 0.0))
        if increment is not None and increment.witnessed:
            rims = increment.left, increment.right
            assert increment.witness[2] == pytest.approx((rims[1] - rims[0]) / TRACK, abs=1e-12)
            assert increment.covered == pytest.approx(wheels_every * TICK / SECOND)
            compared.append(ekf.update_wheel_yaw(increment.witness, *rims))
            newest = DrivenFilter(ekf.config)
            newest.state = replace(newest.state, twist=Twist(np.zeros(3), before))
            at_once.append(newest.update_wheel_yaw(increment.rate, *rims))
        if increment is not None:
            before = increment.rate
    assert len(compared) == 60 // wheels_every
    # The newest gyro reading alone is ahead of wheels that come ten times less often.
    assert all(compared)
    assert all(at_once) is (wheels_every == 1)
