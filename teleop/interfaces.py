"""The message and service types that robot and operator share: ROS's, and our few in ``assets``."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.resources import files
from importlib.resources.abc import Traversable

from teleop.rosbridge.messages.type_registry import TypeRegistry


def registry(folders: Iterable[Traversable] = ()) -> TypeRegistry:
    """Return a registry of the standard types, those of ``assets/farsteer_msgs``, and a user's."""
    return TypeRegistry([files("assets") / "farsteer_msgs", *folders])
