from __future__ import annotations

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory, TrajectoryError
from localization.types import Estimate, Health, Pose, Twist


def test_invalid_trajectories_are_rejected() -> None:
    one = np.array([[1.0, 0.0, 0.0, 0.0]])
    with pytest.raises(TrajectoryError, match="pose 1 is not after pose 0"):
        Trajectory(np.array([1, 1]), np.zeros((2, 3)), np.repeat(one, 2, axis=0))
    with pytest.raises(TrajectoryError, match=r"quaternions \(1, 4\)"):
        Trajectory(np.array([1]), np.zeros((1, 3)), np.zeros(4))
    with pytest.raises(TrajectoryError, match="pose 0 must be finite"):
        Trajectory(np.array([1]), np.full((1, 3), np.nan), one)


def test_arrays_are_read_only() -> None:
    trajectory = Trajectory.from_poses([(0, Pose.identity())])
    for name in Trajectory.__slots__:
        with pytest.raises(ValueError, match="read-only"):
            getattr(trajectory, name)[0] = 1


def test_estimates_without_a_pose_are_left_out_and_the_last_of_a_stamp_counts() -> None:
    def estimate(stamp: int, pose: Pose | None) -> Estimate:
        still = Twist.planar(0.0, 0.0)
        return Estimate(stamp, pose, Pose.identity(), np.eye(6), still, Health.TRACKING)

    some = [estimate(1, None), estimate(2, Pose.planar(1.0, 0.0, 0.0))]
    assert Trajectory.from_estimates(some).stamps.tolist() == [2]
    assert len(Trajectory.from_estimates(some[:1])) == 0
    some.append(estimate(2, Pose.planar(3.0, 0.0, 0.0)))
    assert Trajectory.from_estimates(some).positions.tolist() == [[3.0, 0.0, 0.0]]


def test_poses_in_between_are_interpolated_and_knots_returned_as_they_are() -> None:
    ends = [(0, Pose.planar(0.1, 0.2, 0.3)), (10, Pose.planar(0.7, 0.2, 1.3))]
    trajectory = Trajectory.from_poses(ends)
    positions, rotations = trajectory.at(np.array([0, 5, 10]))
    assert positions[[0, 2]].tobytes() == trajectory.positions.tobytes()
    assert rotations[[0, 2]].tobytes() == trajectory.rotations.tobytes()
    assert positions[1] == pytest.approx([0.4, 0.2, 0.0])
    assert rotations[1] == pytest.approx(Pose.planar(0.0, 0.0, 0.8).rotation)
