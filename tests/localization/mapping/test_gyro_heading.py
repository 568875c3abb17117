"""Headings of key frames by a gyro: in the pose graph, and from the readings of a drive."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.gyro_heading import GyroFactors, GyroHeading, GyroHeadingConfig
from localization.mapping.loop_optimization import odometry_graph
from localization.mapping.odometry_front_end import Odometer, OdometerConfig, OdometrySweep
from localization.mapping.planar_pose import between, compose
from localization.mapping.pose_front_end import PoseOdometer, PoseOdometerConfig
from localization.mapping.pose_graph import Edge, solved_graph
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import Inertial, Pose, Reading
from tests.support_rooms import HALL, MOUNTS, Drive, by_odometry

DEGREE = float(np.deg2rad(1.0))
SECONDS = 2.0
"""From one key frame to the next."""
EDGE = np.diag(np.square([0.01, 0.01, 0.05 * DEGREE]))


def rounds(count: int = 160) -> FloatArray:
    """True poses (K, 3) of key frames in a circle of 3 m, half a metre apart."""
    poses = [np.zeros(3)]
    for _ in range(count):
        poses.append(compose(poses[-1], np.array([0.5, 0.0, 0.5 / 3.0])))
    return np.array(poses)


def measured(truth: FloatArray, bend: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Poses by scans that turn by so much (K - 1,) too far, and the covariances that they claim."""
    poses = [truth[0]]
    for (a, b), more in zip(itertools.pairwise(truth), bend, strict=True):
        poses.append(compose(poses[-1], between(a, b) + [0.0, 0.0, more]))
    return np.array(poses), [EDGE] * len(bend)


def by_gyro(
    truth: FloatArray, *, bias: float, known: float = 0.01 * DEGREE, gap: int | None = None
) -> GyroFactors:
    """What a gyro with the noise of the settings measures, and a bias that nobody took off.

    Args:
        truth: poses (K, 3).
        bias: the bias [rad/s].
        known: what it may be, one sigma [rad/s].
        gap: number of a turn that it does not measure.
    """
    config, rng = GyroHeadingConfig(), np.random.default_rng(2)
    headings = [GyroHeading()]
    for k, (a, b) in enumerate(itertools.pairwise(truth)):
        turn = float(between(a, b)[2]) + bias * SECONDS
        turn += config.noise * np.sqrt(SECONDS) * float(rng.standard_normal())
        headings.append(headings[-1].after(turn, SECONDS, known, measured=k != gap))
    factors = GyroFactors.of(headings, config)
    assert factors is not None
    return factors


def heading_error(poses: FloatArray, truth: FloatArray) -> float:
    """Largest [rad]."""
    return max(abs(wrap_angle(float(e))) for e in (poses - truth)[:, 2])


def bent(count: int) -> FloatArray:
    """Scans that turn by a tenth of a degree a second too far, for half a minute."""
    bend = np.zeros(count)
    bend[40:55] = 0.1 * DEGREE * SECONDS
    return bend


def test_heading_is_held_to_the_gyro_to_a_hundredth_of_a_degree_a_second() -> None:
    truth = rounds()
    odometry, covariances = measured(truth, bent(160))
    assert heading_error(odometry, truth) > 2.9 * DEGREE
    alone = odometry_graph(odometry, covariances).poses
    assert heading_error(alone, truth) > 2.9 * DEGREE
    held = odometry_graph(odometry, covariances, by_gyro(truth, bias=0.0)).poses
    error = np.diff((held - truth)[40:56, 2]).sum()
    walk = 0.02 * DEGREE * np.sqrt(15 * SECONDS)
    assert abs(error) < 0.01 * DEGREE * 15 * SECONDS + 2.0 * walk
    assert heading_error(held, truth) < 0.7 * heading_error(alone, truth)


def test_bias_that_was_not_taken_off_is_found_from_scans_and_loops() -> None:
    """Over the drive it amounts to 16 degrees."""
    truth = rounds()
    gyro = by_gyro(truth, bias=0.05 * DEGREE, known=0.1 * DEGREE)
    odometry, covariances = measured(truth, np.zeros(160))
    loops = [
        Edge(k, 0, between(truth[0], truth[k]), EDGE, uncertain=True) for k in (37, 75, 113, 151)
    ]
    edges = [
        Edge(
            k + 1,
            k,
            between(odometry[k], odometry[k + 1]),
            c + np.diag([0, 0, (0.5 * DEGREE) ** 2]),
        )
        for k, c in enumerate(covariances)
    ]
    graph = solved_graph(odometry, edges + loops, gyro)
    assert heading_error(graph.poses, truth) < 0.5 * DEGREE
    assert graph.weights.min() > 0.9
    columns = graph.covariance_columns(160)
    assert columns.shape == (161, 3, 3)
    free = solved_graph(odometry, edges + loops).covariance_columns(160)
    assert columns[160][2, 2] < free[160][2, 2]


def test_turn_that_the_gyro_did_not_measure_is_that_of_the_scans() -> None:
    truth = rounds(20)
    gyro = by_gyro(truth, bias=0.0, gap=10)
    assert 11 not in gyro.source
    assert len(gyro.source) == 19
    odometry, covariances = measured(truth, np.zeros(20))
    poses = odometry_graph(odometry, covariances, gyro).poses
    assert heading_error(poses, truth) < 0.4 * DEGREE


def test_without_a_gyro_there_are_no_factors() -> None:
    assert GyroFactors.of([None, None, None], GyroHeadingConfig()) is None
    assert GyroFactors.of([GyroHeading()], GyroHeadingConfig()) is None


DRIVE = Drive(HALL, Pose.planar(4.0, 1.4, 0.0), (0.6, 0.0, 0.0), (8.0, 0.5, 1.0 / 3.0), seed=3)


def test_odometry_sums_up_what_the_gyro_turned() -> None:
    odometer = Odometer(MOUNTS, OdometerConfig(sensors=SensorConfiguration(flat=True)))
    steps = [step for r in DRIVE.readings() if (step := odometer.add(r)) is not None]
    first, last = steps[0].gyro, steps[-1].gyro
    assert first is not None
    assert last is not None
    turned = 8.0 / 3.0
    assert last.turn - first.turn == pytest.approx(turned, abs=0.5 * DEGREE + 0.04)
    # Less the rest at the beginning, during which the robot cannot have turned.
    assert 7.9 < last.seconds < 8.4
    assert last.gaps == 0


def odometry_and_gyro(turn: float, silent: tuple[float, float] = (9.0, 9.0)) -> list[Reading]:
    """The drive's readings with poses by wheels that turn too far, in place of rim speeds."""
    return [
        r
        for r in by_odometry(DRIVE, turn=turn, begin=Pose.planar(9.0, 4.0, 1.0), level=True)
        if not (isinstance(r, Inertial) and silent[0] <= r.stamp * 1e-9 < silent[1])
    ]


def followed(readings: list[Reading], *, gyro: bool) -> list[OdometrySweep]:
    mounts = {"laser_horizontal": MOUNTS["laser_horizontal"]}
    odometer = PoseOdometer(mounts, PoseOdometerConfig(gyro=gyro))
    return [step for r in readings if (step := odometer.add(r)) is not None]


@pytest.mark.slow
def test_poses_of_an_odometry_are_turned_by_the_gyro_beside_it() -> None:
    steps = followed(odometry_and_gyro(1.85), gyro=True)
    first, last = steps[0], steps[-1]
    true = DRIVE.pose(first.sweep.stamp).inverse() @ DRIVE.pose(last.sweep.stamp)
    assert first.gyro is not None
    assert last.gyro is not None
    assert wrap_angle(last.gyro.turn - first.gyro.turn - true.yaw) == pytest.approx(0, abs=0.02)
    assert last.gyro.gaps == first.gyro.gaps
    assert wrap_angle(float(last.at[2]) - true.yaw) == pytest.approx(0.0, abs=0.5 * DEGREE)
    assert np.hypot(*(last.at[:2] - true.position[:2])) < 0.05
    wheels = followed(odometry_and_gyro(1.85), gyro=False)
    assert all(step.gyro is None for step in wheels)


@pytest.mark.slow
def test_gap_of_the_gyro_is_counted_and_bridged_by_the_wheels() -> None:
    steps = followed(odometry_and_gyro(1.0, silent=(3.0, 5.0)), gyro=True)
    gaps = [(s.sweep.stamp * 1e-9, s.gyro.gaps) for s in steps if s.gyro is not None]
    assert len({count for stamp, count in gaps if 0.5 < stamp < 3.1}) == 1
    assert len({count for stamp, count in gaps if stamp > 5.2}) == 1
    assert gaps[-1][1] > 10
    true = DRIVE.pose(steps[0].sweep.stamp).inverse() @ DRIVE.pose(steps[-1].sweep.stamp)
    assert np.hypot(*(steps[-1].at[:2] - true.position[:2])) < 0.05
