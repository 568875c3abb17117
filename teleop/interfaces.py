"""ROS message and service types that robot and operator share: the standard ones and ``farsteer_msgs``."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.resources.abc import Traversable

from teleop.package_data import assets
from teleop.rosbridge.messages.type_registry import TypeRegistry


def registry(folders: Iterable[Traversable] = ()) -> TypeRegistry:
    """Return a registry of the standard types, of ``assets/farsteer_msgs``, and of a user's folders.

    Args:
        folders: Folders named like a package, with ``.msg``, ``.srv`` and ``.action`` files.
    """
    return TypeRegistry([assets() / "farsteer_msgs", *folders])
