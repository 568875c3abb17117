"""Vibration for the operator's hand: contact, a grip, a limit, a refusal."""

from __future__ import annotations

from typing import Final

_CONTACT: Final = 1.0, 8
_GRIP: Final = 0.5, 5
_REFUSAL: Final = 0.6, 5
"""Strength, and ticks for which it is felt: under 0.1 s a motor of a gamepad hardly starts."""
_LIMIT: Final = 0.25
"""Strength for as long as the arm cannot follow."""


class Rumble:
    """Owns the vibration that goes on."""

    def __init__(self) -> None:
        self._strength, self._left = 0.0, 0
        self._touching: frozenset[str] = frozenset()
        self._held = ""
        self.strength = 0.0
        """After the last tick, 0 to 1."""
        self.ended = False
        """Whether it ended with it."""

    def refused(self) -> None:
        """Note that a command was refused."""
        self._begin(*_REFUSAL)

    def tick(self, touching: frozenset[str], held: str, *, hindered: bool) -> None:
        """Work out the vibration of a tick.

        Args:
            touching: Names of what the arm touches.
            held: Name of what the gripper holds; empty without anything.
            hindered: Whether an operator moves the arm, and it cannot follow.
        """
        if touching - self._touching - {held}:
            self._begin(*_CONTACT)
        if held and held != self._held:
            self._begin(*_GRIP)
        self._touching, self._held = touching, held
        before = self.strength
        self.strength = max(self._strength if self._left else 0.0, _LIMIT if hindered else 0.0)
        self._left = max(0, self._left - 1)
        self.ended = bool(before) and not self.strength

    def _begin(self, strength: float, ticks: int) -> None:
        if not self._left or strength >= self._strength:
            self._strength, self._left = strength, ticks
