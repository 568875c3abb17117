"""The arm's deadman: whether the newest command to the arm is in force, and what a client owes before it is."""

from __future__ import annotations

from typing import Final

from localization.types import SECOND
from teleop.robot.arm.arm_commands import Hand, Stream
from teleop.robot.inbox import ArmWish
from teleop.robot.safety.control_state import SafetyConfig

OPEN_FIRST: Final = "open the hand's clutch first, and close it again"
ZERO_OR_PAUSE: Final = "send a zero velocity, or pause for a second, before moving the arm again"


class ArmDeadman:
    """Follows the commands to the arm, apart from those to the wheels: two deadmen under one lease.

    A hand shows an open clutch before it moves the arm. A stream of velocities or poses, which may never hold a
    zero, moves it at once, unless it may be one that was stopped and does not know.
    """

    def __init__(self, config: SafetyConfig) -> None:
        """Begin with nothing in force."""
        self._config = config
        self._arrival = 0
        self.seen = 0
        """Arrival of the driver's newest command to the arm, or sign of life for a goal of its [ns]."""
        self.engaged = False
        """Whether a command is in force."""
        self.stopped = False
        """Whether something else than its client ended the last one."""
        self.reason = "nobody moves the arm"
        """Why none is, for people."""
        self._kind: type[Stream] = Hand
        """Kind of the command in force; a client may send several, of which most are at rest."""
        self._open: set[str] = set()
        """Clients whose clutch has been open since the last stop."""
        self._streaming: set[str] = set()
        """Clients whose newest stream asked for motion, whether it got it or not."""
        self._stopped: set[str] = set()
        """Those of them that were stopped and have not shown that they know."""

    def observe(self, message: ArmWish, stream: Stream) -> None:
        """Note what a client shows, with the lease or without."""
        client = message.client
        if isinstance(stream, Hand):
            if not stream.engaged:
                self._open.add(client)
            return
        if not stream.engaged or message.rested:
            self._streaming.discard(client)
            self._stopped.discard(client)
        if stream.engaged:
            self._streaming.add(client)

    def take(self, message: ArmWish, stream: Stream, arrival: int) -> str | None:
        """Take an observed command of the driver; return why it is refused, or None.

        Args:
            message: The message.
            stream: What it carries.
            arrival: When it came [ns].
        """
        self._arrival = max(self._arrival, arrival)
        self.seen = max(self.seen, arrival)
        if not stream.engaged:
            if self.engaged and type(stream) is self._kind:
                self.engaged, self.stopped, self.reason = False, False, "let go"
            return None
        if refusal := self._config.stale.refusal(message.age):
            self.stop("commands arrive too late")
            return refusal
        if isinstance(stream, Hand):
            if message.client not in self._open:
                return OPEN_FIRST
        elif message.client in self._stopped:
            return ZERO_OR_PAUSE
        self.engaged, self.stopped, self.reason = True, False, ""
        self._kind = type(stream)
        return None

    def expire(self, now: int) -> None:
        """Apply the watchdog; what is in force now stays so until the next tick."""
        silence = now - self._arrival
        if self.engaged and silence + self._config.tick > self._config.watchdog:
            self.stop(f"no command to the arm for {silence / SECOND:.3f} s")

    def stop(self, reason: str) -> None:
        """End the command in force; all clients must show that they know before they move the arm."""
        self._open.clear()
        self._stopped |= self._streaming
        self.engaged, self.stopped, self.reason = False, True, reason

    def forget(self, client: str) -> None:
        """Note that a client has left."""
        for known in (self._open, self._streaming, self._stopped):
            known.discard(client)

    def forget_all(self) -> None:
        """Note that all clients have left."""
        for known in (self._open, self._streaming, self._stopped):
            known.clear()
