"""Poses of sensors on a robot, from the static transforms of its log and from the user."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from localization.logs.motion_messages import WHEEL_RADIUS
from localization.logs.ros_geometry import pose_from_transform
from localization.logs.ros_types import Message
from localization.types import InvalidReadingError, Pose

_WORLD_FRAMES: Final = frozenset({"map", "odom", "world", "earth"})


@dataclass(frozen=True, slots=True)
class SensorLayout:
    """Facts about the robot that recorded a log, where the log itself lacks them."""

    base: str = "base_link"
    """Name of the frame between the wheels."""
    mounts: Mapping[str, Pose] = field(default_factory=dict)
    """``base_from_frame`` of frames; these take precedence over the transforms in the log."""
    wheel_radius: float = WHEEL_RADIUS
    """Radius [m] by which joint velocities become rim speeds."""
    topics: tuple[str, ...] = ()
    """Topics to read; if there are none, all topics of a known type."""


class FrameTree:
    """Graph of the frames that static transforms connect."""

    def __init__(self, layout: SensorLayout) -> None:
        self._layout = layout
        self._given = {_bare(frame): mount for frame, mount in layout.mounts.items()}
        self._links: dict[str, dict[str, Pose]] = {}

    def add(self, message: Message) -> None:
        """Add the transforms of a ``TFMessage``, apart from invalid ones and those to or from a world frame."""
        for link in message.transforms:
            parent, child = (_bare(f) for f in (link.header.frame_id, link.child_frame_id))
            if parent in _WORLD_FRAMES or child in _WORLD_FRAMES:
                continue
            try:
                pose = pose_from_transform(link.transform)
            except InvalidReadingError:
                continue
            self._links.setdefault(parent, {})[child] = pose
            self._links.setdefault(child, {})[parent] = pose.inverse()

    def base_from(self, frame: str) -> Pose | None:
        """Return ``base_from_frame``, or None if no transforms connect the two frames."""
        frame = _bare(frame)
        if frame in self._given:
            return self._given[frame]
        base = _bare(self._layout.base)
        found = {base: Pose.identity()}
        waiting = [base]
        while waiting and frame not in found:
            at = waiting.pop(0)
            for neighbour, step in self._links.get(at, {}).items():
                if neighbour not in found:
                    found[neighbour] = found[at] @ step
                    waiting.append(neighbour)
        return found.get(frame)

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of all known frames, sorted."""
        return tuple(sorted({*self._links, *self._given}))


def _bare(frame: str) -> str:
    """Return a frame's name without the slash that tf 1 allows at its beginning."""
    return str(frame).lstrip("/")
