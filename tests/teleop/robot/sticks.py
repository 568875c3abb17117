"""Drive commands as clients send them."""

from __future__ import annotations

from typing import Any

from localization.types import Twist
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import DriveCommand


def wanted(forward: float, turn: float = 0.0, *, enabled: bool = True) -> VelocityRequest:
    """Return a request for a forward speed [m/s] and a turn rate [rad/s]."""
    return VelocityRequest(Twist.planar(forward, turn), enabled=enabled)


def stick(
    client: str, forward: float, turn: float = 0.0, *, enabled: bool = True, **more: Any
) -> DriveCommand:
    """Return the command of a client's stick."""
    return DriveCommand(client, wanted(forward, turn, enabled=enabled), **more)
