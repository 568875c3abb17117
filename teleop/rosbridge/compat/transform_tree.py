"""Where frames are in each other, as ``/tf`` tells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Self

from teleop.rosbridge.messages.message_types import Message

_MOST: Final = 4096
"""Frames: whoever may publish ``/tf`` must not fill the memory."""

_DEEPEST: Final = 100
"""Frames between one and its root that are looked at."""

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]
"""Unit quaternion, x, y, z, w as ROS has it."""


@dataclass(frozen=True, slots=True)
class Transform:
    """Takes points of a frame into its parent: rotation, then translation [m]."""

    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Rotation = (0.0, 0.0, 0.0, 1.0)

    def __matmul__(self, other: Transform) -> Transform:
        """Return the transform that does ``other`` first."""
        x, y, z = _rotated(self.rotation, other.translation)
        a, b, c = self.translation
        return Transform((a + x, b + y, c + z), _product(self.rotation, other.rotation))

    @property
    def inverse(self) -> Transform:
        """What undoes it."""
        x, y, z, w = self.rotation
        back = (-x, -y, -z, w)
        a, b, c = _rotated(back, self.translation)
        return Transform((-a, -b, -c), back)

    def distance(self, other: Transform) -> float:
        """Return how far the two translations are apart [m]."""
        return math.dist(self.translation, other.translation)

    def angle(self, other: Transform) -> float:
        """Return by how much the two rotations differ [rad]."""
        dot = abs(sum(a * b for a, b in zip(self.rotation, other.rotation, strict=True)))
        return 2 * math.acos(min(dot, 1.0))

    @classmethod
    def read(cls, message: Message) -> Self | None:
        """Return what a ``geometry_msgs/Transform`` says; None if it turns by no quaternion."""
        t, q = message["translation"], message["rotation"]
        norm = math.hypot(q["x"], q["y"], q["z"], q["w"])
        if not 0.5 < norm < 2.0:  # rounding moves a norm by far less; zeros are a mistake
            return None
        rotation = q["x"] / norm, q["y"] / norm, q["z"] / norm, q["w"] / norm
        return cls((t["x"], t["y"], t["z"]), rotation)

    def write(self) -> Message:
        """Return a ``geometry_msgs/Transform``."""
        return {
            "translation": dict(zip("xyz", self.translation, strict=True)),
            "rotation": dict(zip("xyzw", self.rotation, strict=True)),
        }


class TransformTree:
    """The last known transforms, each of a frame in its parent."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Transform]] = {}

    def add(self, message: Message) -> None:
        """Take in a ``tf2_msgs/TFMessage``; what is no transform is left out."""
        for entry in message["transforms"]:
            child, parent = frame(entry["child_frame_id"]), frame(entry["header"]["frame_id"])
            transform = Transform.read(entry["transform"])
            known = child in self._parents or len(self._parents) < _MOST
            if transform is not None and known and child and parent and child != parent:
                self._parents[child] = parent, transform

    def clear(self) -> None:
        """Forget all."""
        self._parents.clear()

    def find(self, target: str, source: str) -> Transform | None:
        """Return what takes points of ``source`` into ``target``; None if nothing connects them."""
        if target == source:
            return Transform()
        up, down = self._ancestors(source), self._ancestors(target)
        for name, transform in up.items():
            if name in down:
                return down[name].inverse @ transform
        return None

    def _ancestors(self, name: str) -> dict[str, Transform]:
        """Return a frame, its parent and so on, each with what takes points of the frame there."""
        transform = Transform()
        found = {name: transform}
        while (step := self._parents.get(name)) is not None and step[0] not in found:
            name, transform = step[0], step[1] @ transform
            found[name] = transform
            if len(found) > _DEEPEST:
                break
        return found


def frame(name: str) -> str:
    """Return a frame's name as ROS 2 has it, without a slash before it."""
    return name.lstrip("/")


def _product(p: Rotation, q: Rotation) -> Rotation:
    a, b, c, d = p
    x, y, z, w = q
    return (
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    )


def _rotated(q: Rotation, v: Vector) -> Vector:
    x, y, z, _ = _product(_product(q, (*v, 0.0)), (-q[0], -q[1], -q[2], q[3]))
    return x, y, z
