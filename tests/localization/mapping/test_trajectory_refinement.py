"""A drive whose poses are bent is straightened by what its sweeps saw together."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import ate
from localization.geometry import FloatArray
from localization.mapping.drive_knots import RefinementConfig
from localization.mapping.odometry_front_end import OdometrySweep
from localization.mapping.planar_pose import between, compose
from localization.mapping.trajectory_refinement import refined_trajectory
from localization.types import Pose
from tests.support_rooms import HALL

pytest.importorskip("open3d", reason="planes are made by Open3D")

COUNT = 90
ANGLES = np.linspace(0.0, 2.2 * np.pi, COUNT)
TRUE = np.column_stack(
    [4.0 + 1.5 * np.sin(ANGLES), 2.8 - 1.2 * np.cos(ANGLES), np.arctan2(1.2 * np.sin(ANGLES), 1.5 * np.cos(ANGLES))]
)  # fmt: skip
"""x, y and yaw on an oval about the hall's middle, a little more than once around."""


def trajectory(places: FloatArray) -> Trajectory:
    return Trajectory.from_poses((1 + i, Pose.planar(*p)) for i, p in enumerate(places.tolist()))


def steps() -> list[OdometrySweep]:
    """The sweeps of the drive, with odometry that gains 1 % and turns by 0.17 degrees per metre."""
    rolled = [np.zeros(3)]
    for a, b in itertools.pairwise(TRUE):
        rolled.append(compose(rolled[-1], between(a, b) * [1.01, 1.01, 1.0] + [0, 0, 0.0003]))
    none = np.zeros((3, 3))
    return [
        OdometrySweep(HALL.sweep(Pose.planar(*place), noise=0.01, seed=i, stamp=1 + i), at, at, 0.0, (0.0, 0.0), none, none)
        for i, (place, at) in enumerate(zip(TRUE.tolist(), rolled, strict=True))
    ]  # fmt: skip


def bent() -> FloatArray:
    """The drive as it might be after loops were closed: 2 cm and half a degree off in long waves."""
    places = TRUE.copy()
    phase = ANGLES - ANGLES[0]
    places[:, 0] += 0.02 * np.sin(2.0 * phase)
    places[:, 1] += 0.02 * np.sin(3.0 * phase)
    places[:, 2] += 0.009 * np.sin(phase)
    return places


@pytest.mark.slow
def test_bent_drive_is_straightened_to_millimetres() -> None:
    before, truth = trajectory(bent()), trajectory(TRUE)
    after = refined_trajectory(steps(), before)
    assert ate(before, truth, aligned=True).horizontal.rmse > 0.015
    error = ate(after, truth, aligned=True)
    assert error.horizontal.rmse < 0.003
    assert error.heading.rmse < np.deg2rad(0.1)


def test_first_pose_and_level_heights_stay() -> None:
    before = trajectory(bent())
    after = refined_trajectory(steps(), before, RefinementConfig(rounds=1))
    assert after.pose(0).position == pytest.approx(before.pose(0).position, abs=1e-6)
    assert after.pose(0).yaw == pytest.approx(before.pose(0).yaw, abs=1e-6)
    assert np.abs(after.positions[:, 2]).max() < 1e-6
    assert after.stamps.tolist() == before.stamps.tolist()


@pytest.mark.slow
def test_drifting_height_is_corrected_on_uneven_ground() -> None:
    wandering = [Pose.from_euler([x, y, 0.0], yaw=yaw) for x, y, yaw in TRUE.tolist()]
    height = 0.02 * np.sin(ANGLES)
    lifted = Trajectory.from_poses(
        (1 + i, Pose(pose.position + [0.0, 0.0, z], pose.quaternion_wxyz))
        for i, (pose, z) in enumerate(zip(wandering, height, strict=True))
    )
    after = refined_trajectory(steps(), lifted, RefinementConfig(level=False))
    assert np.abs(after.positions[:, 2] - after.positions[0, 2]).max() < 0.006
