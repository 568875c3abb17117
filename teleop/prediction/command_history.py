"""The commands that the robot follows now, and those that are on their way to it."""

from __future__ import annotations

from collections import deque
from typing import Final

from teleop.prediction.predicted_motion import Command

_KEPT: Final = 2.0
"""Time for which what was in force is kept [s]: from rest to full speed the robot takes 1.4 s."""


_VARIES: Final = 0.1
"""By so much a command may come later than it was expected [s]: until then what the robot says does not overrule it; chosen."""


class CommandHistory:
    """Owns what the robot says that it follows, and what was sent to it since."""

    def __init__(self) -> None:
        """Begin without any."""
        self._followed: deque[Command] = deque()
        self._sent: deque[Command] = deque()
        self._share = 1.0

    def followed(self, command: Command, share: float) -> None:
        """Take what the robot says is in force, with the share of what was asked for that its guard lets through."""
        if self._followed and command.at < self._followed[-1].at:
            self._followed.clear()  # it has begun anew
            self._sent.clear()
        self._followed.append(command)
        self._share = share
        while self._followed[0].at < command.at - _KEPT:
            self._followed.popleft()
        while self._sent and self._sent[0].at <= command.at - _VARIES:
            self._sent.popleft()

    def sent(self, command: Command) -> None:
        """Take what was sent, with the time at which it will be in force."""
        self._sent.append(command)

    def commands(self) -> list[Command]:
        """Return all of them in their order; those on their way as the guard would let them through."""
        share = self._share
        on_their_way = [Command(c.at, share * c.forward, share * c.turn) for c in self._sent]
        return [*self._followed, *on_their_way]
