"""Odometry from the poses of a base: stamps in bursts, pauses, wheels that are wrong."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.mapping.base_poses import BasePoses
from localization.mapping.odometry_front_end import OdometrySweep
from localization.mapping.planar_pose import between, compose
from localization.mapping.pose_front_end import PoseOdometer
from localization.mapping.slam import map_drive
from localization.mapping.slam_config import SlamConfig
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import SECOND, Odometry, Pose, Reading, Scan
from tests.localization.pipeline.wheel_log import SCANNER, scan_of
from tests.support_rooms import HALL, MOUNTS as ALL_MOUNTS

MOUNTS = {SCANNER: ALL_MOUNTS[SCANNER]}


def scan_at(place: FloatArray, stamp: int, seed: int) -> Scan:
    """What the level scanner sees, at one instant."""
    return scan_of(HALL, Pose.planar(*place), stamp, 30.0, np.random.default_rng(seed))


def circle(n: int = 120) -> FloatArray:
    """True poses (n, 3) every 5 cm of a circle of 1.2 m in the hall."""
    turn = 0.05 / 1.2 * np.arange(n)
    return np.column_stack([4.4 + 1.2 * np.sin(turn), 1.7 + 1.2 * (1.0 - np.cos(turn)), turn])


def wheels(truth: FloatArray, wrong: Callable[[FloatArray], FloatArray]) -> list[FloatArray]:
    """Poses by wheels whose every displacement is wrong in some way."""
    poses = [np.array([7.0, -3.0, 1.0])]
    for a, b in itertools.pairwise(truth):
        poses.append(compose(poses[-1], wrong(between(a, b))))
    return poses


def log_of(truth: FloatArray, odometry: list[FloatArray], stamps: list[int]) -> list[Reading]:
    readings: list[Reading] = []
    for i, (place, pose, stamp) in enumerate(zip(truth, odometry, stamps, strict=True)):
        readings += [scan_at(place, stamp, i), Odometry(stamp, Pose.planar(*pose))]
    return readings


def followed(readings: list[Reading]) -> list[OdometrySweep]:
    odometer = PoseOdometer(MOUNTS)
    return [step for r in readings if (step := odometer.add(r)) is not None]


def error(steps: list[OdometrySweep], truth: FloatArray, stamps: list[int]) -> float:
    at = dict(zip(stamps, truth, strict=True))
    first = at[steps[0].sweep.stamp]
    return max(float(np.hypot(*(between(first, at[s.sweep.stamp]) - s.at)[:2])) for s in steps)


def even(n: int) -> list[int]:
    return [SECOND + k * SECOND // 5 for k in range(n)]


def bursts(n: int) -> list[int]:
    """Every second the logger stamps five lines within a millisecond."""
    return [SECOND * (1 + k // 5) + 200_000 * (k % 5) for k in range(n)]


@pytest.mark.parametrize("factor", [(1.0, 1.0), (1.0, 1.85), (1.0, 0.5), (1.08, 0.7)])
def test_drive_is_followed_whatever_stamps_and_wheels_do(factor: tuple[float, float]) -> None:
    truth = circle()
    way, turn = factor
    when = bursts(len(truth))
    steps = followed(log_of(truth, wheels(truth, lambda s: s * [way, way, turn]), when))
    assert len(steps) > 100
    assert error(steps, truth, when) < 0.06


def test_wheels_that_turn_against_the_motion_for_a_while_are_overruled() -> None:
    truth = circle()
    odometry = wheels(truth, lambda s: s)
    back = odometry[60]
    for k in range(60, 80):
        step = between(truth[k], truth[k + 1]) * [-1.0, 1.0, 1.0]
        odometry[k + 1] = back = compose(back, step)
    for k in range(80, len(truth) - 1):
        odometry[k + 1] = compose(odometry[k], between(truth[k], truth[k + 1]))
    stamps = even(len(truth))
    steps = followed(log_of(truth, odometry, stamps))
    assert error(steps, truth, stamps) < 0.06


def test_stamps_change_nothing() -> None:
    truth = circle(60)
    odometry = wheels(truth, lambda s: s * [1.05, 1.05, 1.2])
    one, two = (followed(log_of(truth, odometry, make(60))) for make in (even, bursts))
    assert np.array([s.at for s in one]) == pytest.approx(np.array([s.at for s in two]))


def test_turn_during_a_pause_is_the_difference_of_the_poses() -> None:
    truth = circle(80)
    turned = np.array(truth)
    turned[40:, 2] += np.deg2rad(80.0)
    stamps = [s + (3 * SECOND if k >= 40 else 0) for k, s in enumerate(even(80))]
    steps = followed(log_of(turned, wheels(turned, lambda s: s * [1.0, 1.0, 1.04]), stamps))
    assert error(steps, turned, stamps) < 0.06


@pytest.mark.slow
def test_map_of_poses_and_scans_alone_is_true() -> None:
    truth = circle(160)
    stamps = even(160)
    rng = np.random.default_rng(5)
    odometry = wheels(truth, lambda s: s * [1.03, 1.03, 1.3] + rng.standard_normal(3) * 0.004)
    config = SlamConfig.of(SensorConfiguration(Motion.ODOMETRY, flat=True))
    survey = map_drive(log_of(truth, odometry, stamps), MOUNTS, config)
    places = survey.trajectory.positions[:, :2]
    first = truth[stamps.index(int(survey.trajectory.stamps[0]))]
    true = [between(first, truth[stamps.index(int(t))])[:2] for t in survey.trajectory.stamps]
    assert np.hypot(*(places - true).T).max() < 0.06
    cloud = survey.cloud("hall")
    assert cloud.position_noise == survey.accuracy.position_noise > 0.0
    assert cloud.heading_noise > 0.0


def test_poses_of_one_instant_are_one_and_late_ones_are_put_in_order() -> None:
    poses = BasePoses()
    for stamp, x in ((2, 2.0), (1, 1.0), (2, 2.5), (4, 4.0)):
        poses.add(Odometry(stamp * SECOND, Pose.planar(x, 0.0, 0.0)))
    track = poses.track()
    assert [knot[0] for knot in track.knots] == [SECOND, 2 * SECOND, 4 * SECOND]
    middle = track.pose_at(3 * SECOND)
    assert middle is not None
    assert middle.position[0] == pytest.approx(3.25)


@pytest.mark.parametrize("x", [np.nan, 1e9])
def test_impossible_odometry_is_refused_and_counted(x: float) -> None:
    odometer = PoseOdometer(MOUNTS)
    bad = Odometry(SECOND, Pose.planar(0.0, 0.0, 0.0))
    object.__setattr__(bad.odom_from_base, "position", np.array([x, 0.0, 0.0]))
    assert odometer.add(bad) is None
    assert odometer.refused == 1
    stray = scan_at(circle(1)[0], SECOND, 0)
    object.__setattr__(stray, "scanner", "other")
    odometer.add(stray)
    assert odometer.refused == 2
