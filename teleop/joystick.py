"""Joysticks, as operator and robot both know them: layouts, and ``Joy`` messages to and from wishes."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

from localization.types import Twist


class JoystickError(ValueError):
    """A Joy message or a layout that makes no sense; the message names the field."""


@dataclass(frozen=True, slots=True)
class JoystickLayout:
    """Where things are on a joystick, in ROS's convention that up and left are +1."""

    name: str = "default"
    forward_axis: int = 1
    turn_axis: int = 0
    deadman_button: int = 4
    turbo_button: int = 5
    deadzone: float = 0.05
    """Deflection that counts as none; the rest is rescaled, so that nothing jumps."""
    speed: float = 0.5
    """At full deflection [m/s]."""
    turbo_speed: float = 0.7
    """With the turbo button [m/s]."""
    turn: float = 1.2
    """At full deflection [rad/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class VelocityRequest:
    """What an operator wants at one moment."""

    twist: Twist
    enabled: bool
    """Whether the deadman is held; a source without one counts as holding it."""

    @property
    def neutral(self) -> bool:
        """Whether it asks for no motion: deadman released, or stick at rest."""
        return not self.enabled or not (self.twist.linear.any() or self.twist.angular.any())


def layouts() -> dict[str, JoystickLayout]:
    """Return the shipped layouts by name (``assets/joysticks/*.json``)."""
    found = {}
    for file in (files("assets") / "joysticks").iterdir():
        if file.name.endswith(".json"):
            layout = JoystickLayout(**json.loads(file.read_text(encoding="utf-8")))
            found[layout.name] = layout
    return dict(sorted(found.items()))


def read_joy(
    axes: Sequence[float], buttons: Sequence[int], layout: JoystickLayout
) -> VelocityRequest:
    """Turn the axes and buttons of a ``sensor_msgs/Joy`` into a wish.

    A missing deadman button is a released one.

    Raises:
        JoystickError: if an axis is missing or is not a finite number.
    """
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
        speed * _deflection(forward, layout.deadzone),
        layout.turn * _deflection(turn, layout.deadzone),
    )
    return VelocityRequest(twist, _pressed(buttons, layout.deadman_button))


def write_joy(
    twist: Twist, layout: JoystickLayout, *, enabled: bool = True
) -> tuple[list[float], list[int]]:
    """Return the axes and buttons that ask for a twist, as far as the layout's speeds allow."""
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


def _deflection(axis: float, deadzone: float) -> float:
    clamped = max(-1.0, min(1.0, axis))
    beyond = max(0.0, abs(clamped) - deadzone) / (1.0 - deadzone)
    return math.copysign(beyond, clamped) if beyond else 0.0


def _inverse(deflection: float, deadzone: float) -> float:
    share = max(-1.0, min(1.0, deflection))
    return math.copysign(deadzone + abs(share) * (1.0 - deadzone), share) if share else 0.0
