"""The P3-AT's bumper rings: where something touches the robot, and which segments that presses.

Five segments in front and five behind [AriaCoda ``p3at-sh.p``: ``NumFrontBumpers``,
``NumRearBumpers``], which share 135 degrees at each end [ARIA ``ArBumpers``: ``angleRange``].
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from robot_sim.array_types import FloatArray

SEGMENTS: Final = 5
"""Of each ring."""
SPAN: Final = math.radians(135.0)
"""What the segments of one ring share [rad]."""

_NONE: Final = (False,) * SEGMENTS


@dataclass(frozen=True, slots=True)
class Bumpers:
    """Which segments are pressed: each ring from the robot's left to its right, as ROSARIA has it."""

    front: tuple[bool, ...] = _NONE
    rear: tuple[bool, ...] = _NONE

    def __post_init__(self) -> None:
        for name in ("front", "rear"):
            if len(getattr(self, name)) != SEGMENTS:
                raise ValueError(
                    f"a bumper ring has {SEGMENTS} segments, got {getattr(self, name)}"
                )

    @property
    def pressed(self) -> bool:
        """Whether any segment is."""
        return any(self.front) or any(self.rear)

    def __or__(self, other: Bumpers) -> Bumpers:
        """Return what is pressed in either."""
        return Bumpers(
            tuple(a or b for a, b in zip(self.front, other.front, strict=True)),
            tuple(a or b for a, b in zip(self.rear, other.rear, strict=True)),
        )


def pressed_by(patches: Iterable[FloatArray]) -> Bumpers:
    """Return the segments that things press which touch the robot here and there.

    Args:
        patches: Of each thing the points (K, 2) or (K, 3) in ``base_link`` [m] where it touches. A
            flat thing touches at the ends of its patch; it presses what lies between as well.
    """
    front, rear = list(_NONE), list(_NONE)
    for patch in patches:
        # A few points: plain numbers are several times as quick as numpy.
        points = patch[:, :2].tolist()
        ahead = [math.atan2(y, x) for x, y in points if x >= 0.0]
        behind = [math.atan2(-y, -x) for x, y in points if not x >= 0.0]
        for ring, bearings in ((front, ahead), (rear, behind)):
            for i in _segments(bearings):
                ring[i] = True
    # The rear ring was looked at from behind, where the robot's left is on the right.
    return Bumpers(tuple(front), tuple(rear[::-1]))


def _segments(bearings: Sequence[float]) -> range:
    """Segments between the extreme bearings [rad] of points ahead of a ring, from its left end."""
    if not bearings:
        return range(0)
    leftmost, rightmost = max(bearings), min(bearings)
    half, width = 0.5 * SPAN, SPAN / SEGMENTS
    if rightmost > half or leftmost < -half:
        return range(0)
    first = math.floor((half - leftmost) / width)
    last = math.floor((half - rightmost) / width)
    return range(max(0, first), min(SEGMENTS - 1, last) + 1)
