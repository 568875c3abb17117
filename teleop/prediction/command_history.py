"""The commands that the robot follows now, and those that are on their way to it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from teleop.prediction.predicted_motion import Command

_KEPT: Final = 2.0
"""Time for which what was in force is kept [s]: from rest to full speed the robot takes 1.4 s."""
_VARIES: Final = 0.1
"""By so much a command may come later than it was expected [s]: until then what the robot says does not overrule it; chosen."""
_RADIUS: Final = 0.4
"""Distance of the robot's corners from its middle, by which turn rates are compared with speeds [m]."""
_ALIKE: Final = math.cos(math.radians(12.0))
"""Two motions are alike if they differ by less than this angle, as forward speed and that of a corner; chosen."""


@dataclass(frozen=True, slots=True)
class Followed:
    """What the robot says on ``/teleop/state``."""

    command: Command
    """What is in force."""
    guard: float = 1.0
    """Share of it that the guard lets through."""
    late: float = 1.0
    """Share of what is asked for that the robot drives at, since commands come late."""
    ahead: float = math.inf
    """Time for which what is asked for goes on until it is stopped [s]."""


class CommandHistory:
    """Owns what the robot says that it follows, and what was sent to it since."""

    def __init__(self) -> None:
        """Begin without any."""
        self._followed: deque[Command] = deque()
        self._sent: deque[Command] = deque()
        self._arrived: Command | None = None
        self.newest: Followed | None = None
        """What the robot said last."""

    def followed(self, followed: Followed) -> None:
        """Take what the robot says is in force."""
        command = followed.command
        if self._followed and command.at < self._followed[-1].at:
            self._followed.clear()  # it has begun anew
            self._sent.clear()
            self._arrived = None
        self._followed.append(command)
        self.newest = followed
        while self._followed[0].at < command.at - _KEPT:
            self._followed.popleft()
        while self._sent and self._sent[0].at <= command.at - _VARIES:
            self._arrived = self._sent.popleft()

    def sent(self, command: Command) -> None:
        """Take what was sent, with the time at which it will be in force."""
        self._sent.append(command)

    def commands(self) -> list[Command]:
        """Return all of them in their order; those on their way at the speed at which the robot will follow them."""
        return [*self._followed, *map(self._let_through, self._sent)]

    @property
    def stick(self) -> Command:
        """What is asked for now: what was sent last, or what the robot follows."""
        return self._sent[-1] if self._sent else self._followed[-1]

    @property
    def asked(self) -> Command | None:
        """What the guard was asked for when the robot spoke last; None if that is not known."""
        if self.newest is None:
            return None
        command, share = self.newest.command, self.newest.guard
        if share > 0.0:
            return Command(command.at, command.forward / share, command.turn / share)
        arrived = [sent for sent in self._sent if sent.at <= command.at]
        return arrived[-1] if arrived else self._arrived

    def _let_through(self, command: Command) -> Command:
        if self.newest is None:
            return command
        asked, share = self.asked, self.newest.late
        if asked is not None and alike(command, asked):
            share *= self.newest.guard
        return Command(command.at, share * command.forward, share * command.turn)


def alike(one: Command, other: Command) -> bool:
    """Return whether two commands are of the same arc, about."""
    a, b = ((c.forward, _RADIUS * c.turn) for c in (one, other))
    lengths = math.hypot(*a) * math.hypot(*b)
    return lengths > 0.0 and a[0] * b[0] + a[1] * b[1] >= _ALIKE * lengths
