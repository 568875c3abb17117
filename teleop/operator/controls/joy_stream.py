"""Which Joy message is due: a neutral one first, motion while something is held, and a release at the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from localization.types import Twist

STANDSTILL: Final = Twist.planar(0.0, 0.0)


@dataclass(slots=True)
class JoyStream:
    """Remembers whether something was held, and whether the robot asked for a neutral stick."""

    _held: bool = False
    _asked: bool = False

    def refused(self, text: str) -> None:
        """Note a refusal of the robot; one that asks for a neutral stick is followed by the next message."""
        self._asked = self._asked or "neutral" in text

    def next(self, twist: Twist, held: bool, *, disarmed: bool) -> tuple[Twist, bool] | None:
        """Return the twist and the deadman of the message that is due; None if none is.

        The robot follows nobody who has not shown a neutral stick. Each stroke begins with one, and while the
        robot still waits for one (after a take-over, or after a gap of the link) it gets it without the keys
        being released: the person who holds them sees the robot wait.

        Args:
            twist: Velocity that keys or stick request.
            held: Whether a key or the deadman is held.
            disarmed: Whether the robot says that it waits for a neutral stick.
        """
        begins = held and not self._held
        if not held and not self._held:
            self._asked = False
            return None
        self._held = held
        neutral = held and (begins or disarmed or self._asked)
        self._asked = False
        return (STANDSTILL, True) if neutral else (twist, held)
