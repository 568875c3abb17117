"""Tree of coordinate frames from ``/tf``, and the transforms between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Self

from teleop.rosbridge.messages.message_types import Message

_MAX_FRAMES: Final = 4096
"""Frames of a tree, which bounds the memory that publishers of ``/tf`` can occupy."""

_MAX_DEPTH: Final = 100
"""Frames on the way to the root that are followed."""

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]
"""Unit quaternion x, y, z, w."""


@dataclass(frozen=True, slots=True)
class Transform:
    """Transform from a frame to its parent: rotation, then translation [m]."""

    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Rotation = (0.0, 0.0, 0.0, 1.0)

    def __matmul__(self, other: Transform) -> Transform:
        """Return the composition that applies ``other`` first."""
        x, y, z = _rotated(self.rotation, other.translation)
        a, b, c = self.translation
        return Transform((a + x, b + y, c + z), _product(self.rotation, other.rotation))

    @property
    def inverse(self) -> Transform:
        """The inverse transform."""
        x, y, z, w = self.rotation
        conjugate = (-x, -y, -z, w)
        a, b, c = _rotated(conjugate, self.translation)
        return Transform((-a, -b, -c), conjugate)

    def distance(self, other: Transform) -> float:
        """Return the distance between the two translations [m]."""
        return math.dist(self.translation, other.translation)

    def angle(self, other: Transform) -> float:
        """Return the angle between the two rotations [rad]."""
        dot = abs(sum(a * b for a, b in zip(self.rotation, other.rotation, strict=True)))
        return 2 * math.acos(min(dot, 1.0))

    @classmethod
    def read(cls, message: Message) -> Self | None:
        """Return a ``geometry_msgs/Transform``; None if its quaternion is invalid."""
        t, q = message["translation"], message["rotation"]
        norm = math.hypot(q["x"], q["y"], q["z"], q["w"])
        if not 0.5 < norm < 2.0:  # far beyond rounding errors; zeros are an error
            return None
        rotation = q["x"] / norm, q["y"] / norm, q["z"] / norm, q["w"] / norm
        return cls((t["x"], t["y"], t["z"]), rotation)

    def write(self) -> Message:
        """Return the ``geometry_msgs/Transform``."""
        return {
            "translation": dict(zip("xyz", self.translation, strict=True)),
            "rotation": dict(zip("xyzw", self.rotation, strict=True)),
        }


class TransformTree:
    """The latest transform of each frame to its parent."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Transform]] = {}
        self._found: dict[tuple[str, str], Transform | None] = {}
        self._ways: dict[str, dict[str, Transform]] = {}
        """Results since the last change, as several requests ask for the same frames."""

    def add(self, message: Message) -> None:
        """Add the transforms of a ``tf2_msgs/TFMessage``; invalid ones are ignored."""
        self._found.clear()
        self._ways.clear()
        for entry in message["transforms"]:
            child, parent = frame(entry["child_frame_id"]), frame(entry["header"]["frame_id"])
            transform = Transform.read(entry["transform"])
            known = child in self._parents or len(self._parents) < _MAX_FRAMES
            if transform is not None and known and child and parent and child != parent:
                self._parents[child] = parent, transform

    def clear(self) -> None:
        """Remove all transforms."""
        self._parents.clear()
        self._found.clear()
        self._ways.clear()

    def find(self, target: str, source: str) -> Transform | None:
        """Return the transform from ``source`` to ``target``; None if they are not connected."""
        key = target, source
        if key not in self._found:
            self._found[key] = self._search(target, source)
        return self._found[key]

    def _search(self, target: str, source: str) -> Transform | None:
        if target == source:
            return Transform()
        up, down = self._ancestors(source), self._ancestors(target)
        for name, transform in up.items():
            if name in down:
                return down[name].inverse @ transform
        return None

    def _ancestors(self, name: str) -> dict[str, Transform]:
        """Return a frame and its ancestors, each with the transform from the frame to it."""
        if (known := self._ways.get(name)) is not None:
            return known
        transform = Transform()
        found = self._ways[name] = {name: transform}
        while (step := self._parents.get(name)) is not None and step[0] not in found:
            name, transform = step[0], step[1] @ transform
            found[name] = transform
            if len(found) > _MAX_DEPTH:
                break
        return found


def frame(name: str) -> str:
    """Return a frame's name without leading slash, as in ROS 2."""
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
