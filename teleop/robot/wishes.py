"""What clients want of the robot, from its arrival until the robot has taken it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator

from teleop.robot.inbox import DriveCommand, InboxMessage

_MAX_WAITING = 1000
"""Messages that may wait; so many come only if the robot takes none."""


class Wishes:
    """The messages that the robot has not taken yet, in their order.

    Of each client's drive commands only the newest is kept: the robot would follow no other.
    """

    def __init__(self) -> None:
        self.on_post: Callable[[], object] = lambda: None
        """Called when a message has been added."""
        self._waiting: list[InboxMessage] = []
        self._sent: deque[InboxMessage] = deque()

    def post(self, message: InboxMessage) -> bool:
        """Add a message; return whether there was room for it."""
        if isinstance(message, DriveCommand):
            self._waiting = [
                m
                for m in self._waiting
                if not (isinstance(m, DriveCommand) and m.client == message.client)
            ]
        elif self._waiting and self._waiting[-1] == message:
            return True  # the same e-stop again, for instance
        if len(self._waiting) + len(self._sent) >= _MAX_WAITING:
            return False
        self._waiting.append(message)
        self.on_post()
        return True

    def take(self) -> list[InboxMessage]:
        """Return the waiting messages, which are the robot's now."""
        taken, self._waiting = self._waiting, []
        return taken

    def send(self) -> list[InboxMessage]:
        """Return the waiting messages; they remain outstanding until ``taken`` says otherwise."""
        self._sent += (sent := self.take())
        return sent

    def taken(self, count: int) -> None:
        """Note that the robot has taken the oldest sent messages."""
        for _ in range(min(count, len(self._sent))):
            self._sent.popleft()

    def outstanding(self) -> Iterator[InboxMessage]:
        """Return the messages that have had no effect yet, oldest first."""
        yield from self._sent
        yield from self._waiting
