"""The message and service types that robot and operator share: ROS's, and our few in ``assets``."""

from __future__ import annotations

from importlib.resources import files

from teleop.rosbridge.registry import Registry


def registry() -> Registry:
    """Return a registry of the standard types and those of ``assets/farsteer_msgs``."""
    return Registry([files("assets") / "farsteer_msgs"])
