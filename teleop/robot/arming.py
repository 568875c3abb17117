"""What a client must do before its commands move the robot."""

from __future__ import annotations

from typing import Final

from teleop.robot.inbox import DriveCommand

NEUTRAL_FIRST: Final = "send a neutral stick first"
ZERO_FIRST: Final = "send a zero velocity first"
ZERO_OR_PAUSE: Final = (
    "no command for too long: send a zero velocity, or pause for a second, before driving on"
)


class ArmingRules:
    """Remembers which clients owe a zero velocity.

    A stick shows that it is at rest before it drives. A stream of velocities, which may never hold a zero,
    drives at once, unless it may be one that was stopped and does not know.
    """

    def __init__(self) -> None:
        self._estopped = False
        self._zero_since_estop: set[str] = set()
        self._taken_over: set[str] = set()
        self._silenced: set[str] = set()

    def refusal(self, command: DriveCommand) -> str | None:
        """Return why a command that asks for motion does not arm the robot; None if it does."""
        if not command.stream:
            return NEUTRAL_FIRST
        client = command.client
        owes_zero = self._estopped and client not in self._zero_since_estop
        if owes_zero or client in self._taken_over:
            return ZERO_FIRST
        if client in self._silenced and not command.rested:
            return ZERO_OR_PAUSE
        return None

    def armed(self, client: str) -> None:
        """Note that a client has armed the robot."""
        self._zero_since_estop.add(client)
        self._taken_over.discard(client)
        self._silenced.discard(client)

    def silenced(self, client: str) -> None:
        """Note that the watchdog has stopped a client."""
        self._silenced.add(client)

    def taken_over(self, *clients: str) -> None:
        """Note that these clients have won or lost the lease by a take-over."""
        self._taken_over.update(clients)

    def estopped(self) -> None:
        """Note an e-stop."""
        self._estopped = True
        self._zero_since_estop.clear()

    def forget(self, client: str) -> None:
        """Note that a client has left."""
        for known in (self._zero_since_estop, self._taken_over, self._silenced):
            known.discard(client)

    def forget_all(self) -> None:
        """Note that all clients have left."""
        for known in (self._zero_since_estop, self._taken_over, self._silenced):
            known.clear()
