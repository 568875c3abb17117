"""Messages about the arm."""

from __future__ import annotations

from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_to_dict, transform_to_dict
from localization.logs.ros_stamps import stamp_to_dict
from localization.types import SECOND
from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.parts import arm_bodies, placed
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.arm.goal_results import TimedPath
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics import estimate_messages as estimate
from teleop.robot.topics.message_parts import Message, Messages, array, header

_SELDOM: Final = 100_000_000
"""Time between two states of an arm that stands still [ns]."""
_RUMBLE: Final = 1
"""``sensor_msgs/JoyFeedback.TYPE_RUMBLE``."""
_GRIPPER_DEGREES: Final = 180.0
"""Of the gripper's servo where the jaws are widest apart; 0 where they are closed."""
BASE: Final = "arm_base"


def arm_state(tick: DriveRecord) -> Messages:
    """Return what the arm does and why, often while it moves."""
    arm = tick.arm
    if arm is None or not _due(arm):
        return ()
    return (
        {
            "header": header(arm.stamp, BASE),
            "mode": arm.mode.value,
            "reason": arm.reason,
            "way_out": arm.way_out,
            "way_out_text": arm.way_out_text,
            "controller": arm.controller,
            "angles": arm.angles,
            "wanted": arm.wanted,
            "load": list(arm.load),
            "tip": pose_to_dict(arm.tip),
            "target": pose_to_dict(arm.target),
            "clearance": arm.clearance,
            "nearest": arm.nearest,
            "opening": arm.opening,
            "grip_force": arm.grip_force,
            "holding": bool(arm.held),
            "stowed": arm.stowed,
            "speed_limit": arm.speed_limit if np.isfinite(arm.speed_limit) else 0.0,
        },
    )


def servo_status(tick: DriveRecord) -> Messages:
    """Return the state as MoveIt Servo reports it."""
    arm = tick.arm
    if arm is None or not _due(arm):
        return ()
    return ({"code": int(arm.servo), "message": arm.reason},)


def joint_degrees(tick: DriveRecord) -> Messages:
    """Return the commanded angles in degrees, as the paper sends them to its arm, and the gripper's servo's."""
    arm = tick.arm
    if arm is None:
        return ()
    return (array(np.append(np.degrees(arm.wanted), _GRIPPER_DEGREES * arm.wanted_share)),)


def servo_pulses(tick: DriveRecord) -> Messages:
    """Return the widths of the servos' pulses [us]."""
    if tick.arm is None:
        return ()
    return (array(np.rint(tick.arm.pulses).astype(np.uint16)),)


def feedback(tick: DriveRecord) -> Messages:
    """Return the vibration that operators shall feel, as long as there is any, and its end."""
    arm = tick.arm
    if arm is None or not (arm.rumble or arm.rumble_ended):
        return ()
    return ({"array": [{"type": _RUMBLE, "id": 0, "intensity": arm.rumble}]},)


def arm_info(arm: ArmFit) -> Message:
    """Return what does not change."""
    table = arm.table
    return {
        "name": table.name,
        "joints": [joint.name for joint in table.joints],
        "turns": [joint.turns for joint in table.joints],
        "lower": list(table.lower),
        "upper": list(table.upper),
        "stall": [joint.servo.torque(table.supply) for joint in table.joints],
        "gripper_joint": table.gripper.joint,
        "opening": table.gripper.opening,
        "force": table.gripper.force,
        "pose_names": list(table.poses),
        "pose_angles": [angle for pose in table.poses.values() for angle in pose],
        "mount": pose_to_dict(arm.base_from_arm_base),
    }


class ArmLinks:
    """Where the arm's links are, for ``/tf``; owns the newest state."""

    def __init__(self, table: ArmTable) -> None:
        """Take the arm's table."""
        self._bodies = arm_bodies(table)[1:]
        self._state: ArmState | None = None

    def driven(self, tick: DriveRecord) -> None:
        """Note the newest state."""
        self._state = tick.arm

    def tf(self, tick: EstimateRecord) -> Messages:
        """Return the transforms of the robot, with those of the arm's links: one message, since newer ones replace it."""
        (message,) = estimate.tf(tick)
        return ({"transforms": [*message["transforms"], *self.links()]},)

    def links(self) -> list[Message]:
        """Return the transform of each moving body in its parent, as of the newest state."""
        state = self._state
        if state is None:
            return []
        angles = dict(zip(state.joints, state.angles, strict=False))
        return [
            {
                "header": header(state.stamp, body.parent),
                "child_frame_id": body.name,
                "transform": transform_to_dict(placed(body, angles, state.opening)),
            }
            for body in self._bodies
        ]


def trajectory(path: TimedPath, table: ArmTable) -> Message:
    """Return a motion as ``trajectory_msgs/JointTrajectory``."""
    return {
        "header": header(0, BASE),
        "joint_names": [joint.name for joint in table.joints],
        "points": [
            point(np.array(angles), time)
            for time, angles in zip(path.times, path.positions, strict=True)
        ],
    }


def point(
    positions: FloatArray, time: float = 0.0, velocities: FloatArray | None = None
) -> Message:
    """Return a ``trajectory_msgs/JointTrajectoryPoint`` at a time from the start [s]."""
    return {
        "positions": positions,
        "velocities": np.zeros(0) if velocities is None else velocities,
        "time_from_start": stamp_to_dict(round(time * SECOND)),
    }


def _due(arm: ArmState) -> bool:
    return arm.moving or arm.stamp % _SELDOM == 0
