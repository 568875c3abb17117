"""The joystick layout, and ``sensor_msgs/Joy`` to and from velocity requests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from localization.types import Twist
from teleop.errors import TeleopError


class JoystickError(TeleopError, ValueError):
    """A Joy message, a velocity or a layout is invalid; the message names the field."""


@dataclass(frozen=True, slots=True)
class JoystickLayout:
    """Assignment and scales of a joystick's axes and buttons, in ROS's convention: up and left are +1.

    The speeds are scales, like ``scale_linear`` of ``teleop_twist_joy``. What the robot can do limits
    them further: see ``teleop.robot.safety.speed_limits``.
    """

    name: str = "default"
    """Name of the layout, which is also the name of its file."""
    forward_axis: int = 1
    """Index of the axis for forward speed."""
    turn_axis: int = 0
    """Index of the axis for turn rate."""
    deadman_button: int = 4
    """Index of the button that must be held to drive."""
    turbo_button: int = 5
    """Index of the button that selects ``turbo_speed``."""
    deadzone: float = 0.05
    """Deflection below which an axis counts as released; the rest is rescaled to begin at zero."""
    speed: float = 0.5
    """Forward speed at full deflection [m/s]."""
    turbo_speed: float = 0.7
    """Forward speed at full deflection while the turbo button is held [m/s]."""
    turn: float = 1.2
    """Turn rate at full deflection [rad/s]."""


LAYOUT: Final = JoystickLayout()
"""The layout of every client, which ``assets/joysticks/default.json`` gives to those in other languages."""


@dataclass(frozen=True, slots=True, eq=False)
class VelocityRequest:
    """The velocity that a client requests at one moment."""

    twist: Twist
    """Requested velocity in ``base_link``."""
    enabled: bool
    """Whether the deadman button is held; true for sources without one, such as ``/cmd_vel``."""

    @property
    def neutral(self) -> bool:
        """Whether it requests no motion: deadman released, or stick at rest."""
        return not self.enabled or not (self.twist.linear.any() or self.twist.angular.any())


def read_joy(axes: Sequence[float], buttons: Sequence[int]) -> VelocityRequest:
    """Return the velocity that the axes and buttons of a ``sensor_msgs/Joy`` request.

    A missing deadman button counts as released.

    Raises:
        JoystickError: If an axis is missing or is not a finite number.
    """
    layout = LAYOUT
    needed = max(layout.forward_axis, layout.turn_axis) + 1
    if len(axes) < needed:
        raise JoystickError(
            f"joy.axes must have {needed} entries for layout {layout.name!r}, got {len(axes)}"
        )
    forward, turn = float(axes[layout.forward_axis]), float(axes[layout.turn_axis])
    if not (math.isfinite(forward) and math.isfinite(turn)):
        raise JoystickError(f"joy.axes must be finite, got {forward}, {turn}")
    turbo = _pressed(buttons, layout.turbo_button)
    speed = layout.turbo_speed if turbo else layout.speed
    twist = Twist.planar(
        speed * without_dead_zone(forward, layout.deadzone),
        layout.turn * without_dead_zone(turn, layout.deadzone),
    )
    return VelocityRequest(twist, _pressed(buttons, layout.deadman_button))


def write_joy(twist: Twist, *, enabled: bool = True) -> tuple[list[float], list[int]]:
    """Return axes and buttons that request a twist, saturated at full deflection.

    Args:
        twist: Wanted velocity.
        enabled: Whether deadman and turbo buttons are held.
    """
    layout = LAYOUT
    axes = [0.0] * (max(layout.forward_axis, layout.turn_axis) + 1)
    buttons = [0] * (max(layout.deadman_button, layout.turbo_button) + 1)
    axes[layout.forward_axis] = _inverse(
        float(twist.linear[0]) / layout.turbo_speed, layout.deadzone
    )
    axes[layout.turn_axis] = _inverse(float(twist.angular[2]) / layout.turn, layout.deadzone)
    buttons[layout.deadman_button] = buttons[layout.turbo_button] = int(enabled)
    return axes, buttons


def _pressed(buttons: Sequence[int], index: int) -> bool:
    return index < len(buttons) and bool(buttons[index])


def without_dead_zone(axis: float, deadzone: float) -> float:
    """Return an axis with its dead zone removed and the rest rescaled to [-1, 1]."""
    clamped = max(-1.0, min(1.0, axis))
    beyond = max(0.0, abs(clamped) - deadzone) / (1.0 - deadzone)
    return math.copysign(beyond, clamped) if beyond else 0.0


def _inverse(deflection: float, deadzone: float) -> float:
    """Return the axis that ``without_dead_zone`` maps to a deflection."""
    share = max(-1.0, min(1.0, deflection))
    return math.copysign(deadzone + abs(share) * (1.0 - deadzone), share) if share else 0.0
