"""Which verdict answers the hint that this station sent: the robot repeats old ones, and answers others too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from localization.logs.ros_geometry import pose_from_message
from localization.types import Pose
from teleop.operator.message_decoding import stamp_of

_SAME: Final = 1e-4
"""A pose that came back differs by rounding only [m, and of a rotation matrix's entries]."""
TAKEN: Final = ("accepted", "kept")
"""Verdicts by which the robot is where the hint said, near enough."""


@dataclass(frozen=True, slots=True, eq=False)
class SentHint:
    """A hint that this station sent."""

    map_from_base: Pose
    """The hinted pose."""
    stamp: int
    """The robot's time when it was sent [ns]."""

    def answered_by(self, message: Mapping[str, Any]) -> bool:
        """Return whether a ``HintVerdict`` answers this hint."""
        stamp = stamp_of(message)
        if stamp is None or stamp < self.stamp:
            return False  # latched: it was given before
        answered = pose_from_message(message["hint"])
        apart = np.abs(answered.position - self.map_from_base.position).max()
        turned = np.abs(answered.rotation - self.map_from_base.rotation).max()
        return bool(apart < _SAME and turned < _SAME)
