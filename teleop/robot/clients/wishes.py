"""What clients want of the robot, from its arrival until the robot has taken it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator

from teleop.robot.arm.arm_commands import REPLACED
from teleop.robot.inbox import ArmWish, DriveCommand, InboxMessage

_MAX_WAITING = 1000
"""Messages that may wait; so many come only if the robot takes none."""


class Wishes:
    """The messages that the robot has not taken yet, in their order.

    Of each client's drive commands, and of each kind of its commands to the arm, only the newest is kept: the
    robot would follow no other.
    """

    def __init__(self) -> None:
        self.on_post: Callable[[], object] = lambda: None
        """Called when a message has been added."""
        self._waiting: list[InboxMessage] = []
        self._sent: deque[InboxMessage] = deque()
        self._taken = 0

    def post(self, message: InboxMessage) -> bool:
        """Add a message; return whether there was room for it."""
        if (stream := _stream(message)) is not None:
            self._waiting = [m for m in self._waiting if _stream(m) != stream]
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

    def taken(self, total: int) -> None:
        """Note how many of the sent messages the robot has taken since the first one."""
        while self._taken < total and self._sent:
            self._sent.popleft()
            self._taken += 1

    def outstanding(self) -> Iterator[InboxMessage]:
        """Return the messages that have had no effect yet, oldest first."""
        yield from self._sent
        yield from self._waiting


def _stream(message: InboxMessage) -> tuple[str, type] | None:
    """Return client and kind of a message that the next one of them replaces; None for any other."""
    if isinstance(message, DriveCommand):
        return message.client, DriveCommand
    if isinstance(message, ArmWish) and isinstance(message.wish, REPLACED):
        return message.client, type(message.wish)
    return None
