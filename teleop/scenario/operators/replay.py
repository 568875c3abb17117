"""An operator that sends recorded commands again, each at its time, whatever happens."""

from __future__ import annotations

from collections.abc import Sequence

from teleop.scenario.operators.command_file import SentOperation
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Wire


class Replay(Operator):
    """Sends recorded operations as they were sent: subscriptions and stamps included."""

    def __init__(self, commands: Sequence[SentOperation]) -> None:
        """Take the commands, in their order."""
        super().__init__()
        self._commands = tuple(commands)
        self._next = 0

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Send what was sent before the first tick."""
        self.act(wire, 0)

    def act(self, wire: Wire, now: int) -> None:
        """Send what was sent until now."""
        while self._next < len(self._commands) and self._commands[self._next].stamp <= now:
            wire.send(self._commands[self._next].operation)
            self._next += 1
        self.done = self._next == len(self._commands)
