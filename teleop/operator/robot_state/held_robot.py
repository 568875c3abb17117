"""Whether the robot stands though it is asked to move: by its poses, since wheels that slip against a wall turn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from localization.geometry import wrap_angle
from localization.types import SECOND, Pose
from teleop.operator.message_decoding import map_from_base
from teleop.operator.operating_data import operating_data
from teleop.operator.robot_state.source_ages import STALE

_RULE: Final = operating_data("alarms")["held"]
_WINDOW: Final = round(_RULE["window"] * SECOND)


@dataclass(frozen=True, slots=True)
class HeldRobot:
    """What was asked of the robot last, and its last poses; a value."""

    asked: bool = False
    """Whether it is asked to move."""
    poses: tuple[tuple[int, Pose], ...] = ()
    """Its poses of the last moment, each with its arrival [ns]."""
    since: int | None = None
    """Arrival of the pose from which on it has stood though it was asked to move [ns]."""

    def asked_to(self, state: Mapping[str, Any]) -> HeldRobot:
        """Return the value after a ``/teleop/state``."""
        asked = _exceeds(_RULE["asked"], state.get("linear", 0.0), state.get("angular", 0.0))
        return replace(self, asked=asked, since=self.since if asked else None)

    def at(self, transforms: Any, now: int) -> HeldRobot:
        """Return the value after a ``/tf`` that arrived at a time [ns]."""
        pose = map_from_base(transforms)
        if pose is None:
            return replace(self, poses=(), since=None)
        recent = [known for known in self.poses if now - known[0] <= STALE + _WINDOW]
        while len(recent) > 1 and now - recent[1][0] >= _WINDOW:
            recent.pop(0)
        poses = (*recent, (now, pose))
        first, before = poses[0]
        seconds = (now - first) / SECOND
        if 2 * (now - first) < _WINDOW:  # too short a time for a speed
            return replace(self, poses=poses)
        way = math.dist(pose.position[:2], before.position[:2]) / seconds
        turned = wrap_angle(pose.yaw - before.yaw) / seconds
        stands = self.asked and not _exceeds(_RULE["stands"], way, turned)
        since = (now if self.since is None else self.since) if stands else None
        return replace(self, poses=poses, since=since)

    def seconds(self, now: int) -> float | None:
        """Return for how long it has been held at a time [s]; None if it is not, or its poses are old."""
        if self.since is None or now - self.poses[-1][0] > STALE:
            return None
        return (now - self.since) / SECOND


def _exceeds(limits: Mapping[str, float], linear: float, angular: float) -> bool:
    return abs(linear) > limits["linear"] or abs(angular) > limits["angular"]
