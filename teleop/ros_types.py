"""ROS types that robot and operator share: the standard ones, ``farsteer_msgs``, ``simulation_interfaces``."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.resources.abc import Traversable
from typing import Final

from teleop.package_data import assets
from teleop.rosbridge.messages.type_registry import TypeRegistry

_PACKAGES: Final = ("farsteer_msgs", "simulation_interfaces")


def registry(folders: Iterable[Traversable] = ()) -> TypeRegistry:
    """Return a registry of the standard types, of the packages in ``assets``, and of a user's folders.

    Args:
        folders: Folders named like a package, with ``.msg``, ``.srv`` and ``.action`` files.
    """
    return TypeRegistry([*(assets() / package for package in _PACKAGES), *folders])
