"""A gamepad in the standard layout (W3C): stick and deadman as a twist, buttons as actions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, TypeAlias

from localization.types import Twist
from teleop.joystick import without_dead_zone
from teleop.operator.operating_data import gears, operating_data

LAYOUT: Final[Mapping[str, Any]] = operating_data("controls")["gamepad"]
"""What axes and buttons are for."""
BUTTONS: Final = {action: int(use["button"]) for action, use in LAYOUT["buttons"].items()}
"""Buttons by action."""
DEADMAN: Final = BUTTONS["deadman"]
"""Button that must be held to drive."""
TURBO: Final = BUTTONS["turbo"]
"""Button that selects the fastest gear while it is held."""
_ACTIONS: Final = {b: action for action, b in BUTTONS.items() if b not in (DEADMAN, TURBO)}


@dataclass(frozen=True, slots=True)
class StickMoved:
    """An axis of a pad moved."""

    pad: int
    """Which pad."""
    axis: int
    """Index of the axis, of a standard gamepad; right and down are positive."""
    value: float
    """Deflection in [-1, 1]."""


@dataclass(frozen=True, slots=True)
class ButtonChanged:
    """A button of a pad was pressed or released."""

    pad: int
    """Which pad."""
    button: int
    """Index of the button, of a standard gamepad."""
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
    axes: dict[int, float] = field(default_factory=dict)
    buttons: set[int] = field(default_factory=set)
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
        return _ACTIONS.get(event.button)

    def block(self) -> None:
        """Drive no more until the deadman is released and pressed again."""
        for pad in self._pads.values():
            pad.blocked = DEADMAN in pad.buttons

    def twist(self, gear: int) -> tuple[Twist, bool]:
        """Return the requested twist in a gear, by its index, and whether a deadman is held."""
        for pad in self._pads.values():
            if DEADMAN in pad.buttons and not pad.blocked:
                engaged = gears()[-1 if TURBO in pad.buttons else gear]
                ahead, left = _deflection(pad, "forward"), _deflection(pad, "turn")
                return Twist.planar(engaged.speed * ahead + 0.0, engaged.turn * left + 0.0), True
        return Twist.planar(0.0, 0.0), False


def _deflection(pad: _Pad, use: str) -> float:
    """Return how far a stick is pushed ahead, or to the left (REP 103)."""
    axis = LAYOUT[use]
    value = pad.axes.get(axis["axis"], 0.0)
    return float(axis["sign"] * without_dead_zone(value, LAYOUT["dead_zone"]))
