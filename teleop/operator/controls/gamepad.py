"""A gamepad in the standard layout: stick and deadman as a twist, buttons as actions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, Protocol, TypeAlias

from localization.types import Twist
from teleop.operator.controls.keyboard import SPEED_STEPS

DEADZONE: Final = 0.12
"""Deflection below which a stick counts as released; sticks of pads return to 0.1 at worst (XInput uses 0.24)."""
DEADMAN: Final = "left shoulder"
"""Button that must be held to drive."""
TURBO: Final = "right shoulder"
"""Button that selects the highest speed step."""
ACTIONS: Final = {"b": "estop", "back": "reset", "start": "take_over", "y": "find"}
"""Actions by button, in the layout of an Xbox pad; the e-stop is far from its reset."""


@dataclass(frozen=True, slots=True)
class StickMoved:
    """An axis of a pad moved."""

    pad: int
    """Which pad."""
    axis: str
    """Name of the axis: ``left x`` or ``left y``; right and down are positive."""
    value: float
    """Deflection in [-1, 1]."""


@dataclass(frozen=True, slots=True)
class ButtonChanged:
    """A button of a pad was pressed or released."""

    pad: int
    """Which pad."""
    button: str
    """Name of the button."""
    pressed: bool
    """Whether it is pressed now."""


@dataclass(frozen=True, slots=True)
class PadChanged:
    """A pad was plugged in or unplugged."""

    pad: int
    """Which pad."""
    name: str
    """Its name; empty if it was unplugged."""
    present: bool
    """Whether it is there now."""


PadEvent: TypeAlias = StickMoved | ButtonChanged | PadChanged


class PadSource(Protocol):
    """Where the events of pads come from."""

    def poll(self) -> list[PadEvent]:
        """Return the events since the last call."""

    def close(self) -> None:
        """Let the devices go."""


@dataclass(slots=True)
class _Pad:
    name: str
    axes: dict[str, float] = field(default_factory=dict)
    buttons: set[str] = field(default_factory=set)
    blocked: bool = False


class Gamepad:
    """Owns the state of all pads; the one whose deadman is held drives."""

    def __init__(self) -> None:
        self._pads: dict[int, _Pad] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the pads that are there."""
        return tuple(pad.name for pad in self._pads.values())

    def take(self, event: PadEvent) -> str | None:
        """Take an event; return the action of a button that was pressed, or None."""
        if isinstance(event, PadChanged):
            # An unplugged pad takes its deadman with it.
            self._pads.pop(event.pad, None)
            if event.present:
                self._pads[event.pad] = _Pad(event.name)
            return None
        if (pad := self._pads.get(event.pad)) is None:
            return None
        if isinstance(event, StickMoved):
            pad.axes[event.axis] = event.value if math.isfinite(event.value) else 0.0
            return None
        if not event.pressed:
            pad.buttons.discard(event.button)
            pad.blocked = pad.blocked and event.button != DEADMAN
            return None
        pad.buttons.add(event.button)
        return ACTIONS.get(event.button)

    def block(self) -> None:
        """Drive no more until the deadman is released and pressed again."""
        for pad in self._pads.values():
            pad.blocked = DEADMAN in pad.buttons

    def twist(self, step: int) -> tuple[Twist, bool]:
        """Return the requested twist at a speed step, and whether a deadman is held."""
        for pad in self._pads.values():
            if DEADMAN in pad.buttons and not pad.blocked:
                speed, turn = SPEED_STEPS[-1 if TURBO in pad.buttons else step]
                # Up and left are negative on a pad and positive for a robot (REP 103).
                ahead = -_deflection(pad.axes.get("left y", 0.0))
                left = -_deflection(pad.axes.get("left x", 0.0))
                return Twist.planar(speed * ahead + 0.0, turn * left + 0.0), True
        return Twist.planar(0.0, 0.0), False


def _deflection(value: float) -> float:
    """Return a deflection without its deadzone, rescaled to [-1, 1]."""
    beyond = max(0.0, min(1.0, abs(value)) - DEADZONE) / (1.0 - DEADZONE)
    return math.copysign(beyond, value) if beyond else 0.0
