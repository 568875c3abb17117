"""The arm's joints as a ROS message, for the wire and for logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from localization.logs.ros_types import JOINT_STATE, Message, build, header_message

if TYPE_CHECKING:  # imported only where there is an arm
    from teleop.robot.arm.arm_state import ArmState


def arm_joints_message(arm: ArmState) -> Message:
    """Return ``JointState`` of the measured angles, rates and torques; of the gripper its opening and force."""
    return build(
        JOINT_STATE,
        header=header_message(arm.stamp, "arm_base"),
        name=list(arm.joints),
        position=np.append(arm.angles, arm.opening),
        velocity=np.append(arm.rates, arm.opening_rate),
        effort=np.append(arm.torques, arm.grip_force),
    )
