"""Keyboard driving: keys that are held down in a terminal, as a twist."""

from __future__ import annotations

import os
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from localization.types import Twist

HOLD = 450_000_000
"""Time after its last repeat for which a key counts as held [ns]; terminals report no release, and start
repeating after up to 0.4 s."""

HELP = "w/s or arrows drive, a/d turn, shift is faster, space stops, e is the e-stop, r resets it, t takes over, f finds the robot in the map, q quits"

_FORWARD = {"w": 1.0, "s": -1.0, "\x1b[A": 1.0, "\x1b[B": -1.0}
_TURN = {"a": 1.0, "d": -1.0, "\x1b[D": 1.0, "\x1b[C": -1.0}
_ACTIONS = {"e": "estop", "r": "reset", "t": "take_over", "f": "find", "q": "quit", "\x03": "quit"}


@dataclass(slots=True)
class Keyboard:
    """Remembers when each key was last pressed; time is an argument."""

    speed: float = 0.35
    """Forward speed of a plain key [m/s]."""
    fast: float = 0.7
    """Forward speed with shift [m/s]."""
    turn: float = 0.8
    """Turn rate [rad/s]."""
    _pressed: dict[str, int] = field(default_factory=dict)
    _fast: bool = False

    def press(self, key: str, now: int) -> str | None:
        """Take a key pressed at ``now`` [ns]; return its action: estop, reset, take_over, find, quit, or None."""
        small = key.lower()
        if small in _FORWARD or small in _TURN or key in _FORWARD or key in _TURN:
            self._fast = key.isupper() and len(key) == 1
            self._pressed[small if len(key) == 1 else key] = now
            return None
        if key == " ":
            self._pressed.clear()
            return None
        return _ACTIONS.get(small)

    def twist(self, now: int) -> tuple[Twist, bool]:
        """Return the twist that the held keys request, and whether any is held (the deadman)."""
        held = [key for key, pressed in self._pressed.items() if now - pressed <= HOLD]
        forward = sum(_FORWARD.get(key, 0.0) for key in held)
        turn = sum(_TURN.get(key, 0.0) for key in held)
        speed = self.fast if self._fast else self.speed
        return Twist.planar(speed * _sign(forward), self.turn * _sign(turn)), bool(held)


def _sign(value: float) -> float:
    return (value > 0) - (value < 0)


@contextmanager
def raw_terminal() -> Iterator[int | None]:
    """Switch the terminal to single keys and yield its descriptor; None if there is no terminal."""
    if not sys.stdin.isatty():
        yield None
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield descriptor
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def read_keys(descriptor: int) -> list[str]:
    """Return the keys that a terminal has received, arrows as their whole escape sequence."""
    text = os.read(descriptor, 64).decode(errors="ignore")
    keys: list[str] = []
    while text:
        size = 3 if text.startswith("\x1b[") and len(text) >= 3 else 1
        keys.append(text[:size])
        text = text[size:]
    return keys
