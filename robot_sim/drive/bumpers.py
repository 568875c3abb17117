"""Bumper rings of the P3-AT: which segments are pressed by contacts with the robot.

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
"""Number of segments of each ring."""
SPAN: Final = math.radians(135.0)
"""Angle that the segments of one ring cover together [rad]."""

_NONE: Final = (False,) * SEGMENTS


@dataclass(frozen=True, slots=True)
class Bumpers:
    """Pressed segments of both rings, each from the robot's left to its right, as in ROSARIA."""

    front: tuple[bool, ...] = _NONE
    """Pressed segments of the front ring."""
    rear: tuple[bool, ...] = _NONE
    """Pressed segments of the rear ring."""

    def __post_init__(self) -> None:
        for name in ("front", "rear"):
            if len(getattr(self, name)) != SEGMENTS:
                raise ValueError(
                    f"a bumper ring has {SEGMENTS} segments, got {getattr(self, name)}"
                )

    @property
    def pressed(self) -> bool:
        """Whether any segment is pressed."""
        return any(self.front) or any(self.rear)

    def __or__(self, other: Bumpers) -> Bumpers:
        """Return the segments that are pressed in either."""
        return Bumpers(
            tuple(a or b for a, b in zip(self.front, other.front, strict=True)),
            tuple(a or b for a, b in zip(self.rear, other.rear, strict=True)),
        )


def pressed_by(patches: Iterable[FloatArray]) -> Bumpers:
    """Return the segments that are pressed by objects with the given contact points.

    Args:
        patches: Contact points (K, 2) or (K, 3) in ``base_link`` [m] of each object. A flat object
            touches at the ends of its patch; the segments between them are pressed as well.
    """
    front, rear = list(_NONE), list(_NONE)
    for patch in patches:
        # For a few points plain numbers are several times faster than NumPy.
        points = patch[:, :2].tolist()
        ahead = [math.atan2(y, x) for x, y in points if x >= 0.0]
        behind = [math.atan2(-y, -x) for x, y in points if not x >= 0.0]
        for ring, bearings in ((front, ahead), (rear, behind)):
            for i in _segments(bearings):
                ring[i] = True
    # Bearings of the rear ring are as seen from behind, where the robot's left is on the right.
    return Bumpers(tuple(front), tuple(rear[::-1]))


def _segments(bearings: Sequence[float]) -> range:
    """Return the segments between the extreme bearings [rad] of points, from a ring's left end."""
    if not bearings:
        return range(0)
    leftmost, rightmost = max(bearings), min(bearings)
    half, width = 0.5 * SPAN, SPAN / SEGMENTS
    if rightmost > half or leftmost < -half:
        return range(0)
    first = math.floor((half - leftmost) / width)
    last = math.floor((half - rightmost) / width)
    return range(max(0, first), min(SEGMENTS - 1, last) + 1)
