"""A hand whose pose and clutch come in messages of their own, as from Unity: joined by their stamps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from localization.logs.ros_stamps import stamp_from_message
from localization.types import SECOND
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.clients.arm_input_messages import hand_frame, read_pose
from teleop.rosbridge.errors import MessageError

_TOGETHER: Final = SECOND // 2
"""Largest difference between the stamps of a pose and a clutch [ns]: the watchdog's time, after which either is silence."""


class HandJoin:
    """Owns the newest pose and the newest clutch of a client."""

    def __init__(self) -> None:
        self._hand: Hand | None = None
        self._clutch: tuple[int, bool, float] | None = None

    def pose(self, message: Mapping[str, Any]) -> Hand:
        """Take a ``geometry_msgs/PoseStamped``; return the hand, with an open clutch if that is not known of its time."""
        stamp = stamp_from_message(message["header"]["stamp"])
        frame = hand_frame(message["header"]["frame_id"])
        engaged, trigger = False, 0.0
        if self._clutch is not None and abs(stamp - self._clutch[0]) <= _TOGETHER:
            _, engaged, trigger = self._clutch
        pose = read_pose(message["pose"])
        self._hand = Hand(pose, engaged, trigger, stamp=stamp, frame=frame)
        return self._hand

    def joy(self, message: Mapping[str, Any]) -> Hand | None:
        """Take a ``sensor_msgs/Joy``; return the hand if the clutch is open: that does not wait for a pose.

        Raises:
            MessageError: If a button or an axis is missing or invalid.
        """
        buttons, axes = message["buttons"], message["axes"]
        if not len(buttons) or not len(axes):
            raise MessageError("buttons[0] must be the clutch and axes[0] the trigger")
        trigger = float(axes[0])
        if not 0.0 <= trigger <= 1.0:
            raise MessageError(f"axes[0] must be 0 (open) to 1 (closed), got {trigger:g}")
        engaged = bool(buttons[0])
        self._clutch = stamp_from_message(message["header"]["stamp"]), engaged, trigger
        if engaged or self._hand is None:
            return None
        self._hand = replace(self._hand, engaged=False, trigger=trigger)
        return self._hand
