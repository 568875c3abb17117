"""Poses of all sweeps from the optimised poses of the key frames."""

from __future__ import annotations

import numpy as np

from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, wrap_angle
from localization.mapping.loop_optimization import raised
from localization.mapping.odometry_front_end import OdometrySweep
from localization.mapping.planar_pose import between, compose
from localization.types import Pose

_STOOD = (1e-3, np.deg2rad(0.5))
"""Motion before the first sweep below which the robot stood still [m, rad]: wheels turn no slower, and a gyro
bias of 2 deg/s appears as that turn in the quarter of a second until the first sweep."""


def placed_sweeps(
    steps: list[OdometrySweep], keys: list[int], poses: FloatArray, heights: FloatArray
) -> Trajectory:
    """Return the poses of all sweeps, interpolated between the corrections of the key frames.

    Args:
        steps: The sweeps with their odometry.
        keys: Numbers of the key frames among them.
        poses: Optimised planar poses of the key frames (K, 3).
        heights: Optimised heights of the key frames (K,) [m].
    """
    # The map begins where the odometry did, a little before the first sweep. If the robot stood still
    # meanwhile, its apparent rotation was the gyro's bias, which was not known yet.
    begun = raised(steps[0].at, steps[0].height)
    if float(np.hypot(*steps[0].at[:2])) < _STOOD[0] and abs(begun.yaw) < _STOOD[1]:
        begun = Pose.from_euler([0.0, 0.0, steps[0].height])
    to_map = begun @ raised(poses[0], float(heights[0])).inverse()
    placed = []
    segment = np.searchsorted(keys, np.arange(len(steps)), side="right") - 1
    for i, step in enumerate(steps):
        k = int(segment[i])
        pose, height = _carried(step, steps[keys[k]], poses[k], float(heights[k]))
        if k + 1 < len(keys):
            share = (i - keys[k]) / (keys[k + 1] - keys[k])
            other, above = _carried(step, steps[keys[k + 1]], poses[k + 1], float(heights[k + 1]))
            turn = wrap_angle(float(other[2] - pose[2]))
            pose = pose + share * np.array([*(other - pose)[:2], turn])
            height += share * (above - height)
        roll, pitch = step.tilt
        tilted = Pose.from_euler(
            [pose[0], pose[1], height], roll=roll, pitch=pitch, yaw=float(pose[2])
        )
        placed.append((step.sweep.stamp, to_map @ tilted))
    return Trajectory.from_poses(placed)


def _carried(
    step: OdometrySweep, key: OdometrySweep, pose: FloatArray, height: float
) -> tuple[FloatArray, float]:
    """Return planar pose (3,) and height [m] of a sweep, by odometry from a key frame."""
    return compose(pose, between(key.at, step.at)), height + step.height - key.height
