"""Carries frames between the robot and the clients of its own process: no socket, no thread, simulated time."""

from __future__ import annotations

from collections.abc import Callable

from teleop.errors import TeleopError
from teleop.rosbridge.auth.permissions import UNGUARDED, Access
from teleop.rosbridge.framing.outgoing_frames import Output
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.scenario.operators.wire import Recorder, Wire


class WireError(TeleopError):
    """The robot does not let a client in; the message is one line."""


class MemoryTransport:
    """Carries frames between a protocol and the clients of its own process."""

    def __init__(self, protocol: Protocol, clock: Callable[[], int]) -> None:
        """Attach to a protocol, whose timers the host ticks.

        Args:
            protocol: The protocol of the robot's server.
            clock: Returns its time [ns].

        Raises:
            ValueError: If the protocol has a transport.
        """
        self.protocol, self._clock = protocol, clock
        self._wires: dict[int, Wire] = {}
        protocol.connections.attach(self)

    @property
    def now(self) -> int:
        """Time of the protocol [ns]."""
        return self._clock()

    def connect(
        self,
        *,
        token: str | None = None,
        access: Access | None = None,
        recorder: Recorder | None = None,
    ) -> Wire:
        """Connect a client.

        Args:
            token: Token that it shows as it connects, as in the header of a socket's request; without one it
                may still send the operation ``auth``.
            access: Permissions that the host gives it, whatever its token.
            recorder: Keeps what it sends.

        Raises:
            WireError: If the token is not accepted, or no place is free.
        """
        if access is None:
            access = self._access(token)
        if refusal := self.protocol.places.refusal(access, ""):
            raise WireError(refusal)
        wire = Wire(self, self.protocol.connect(self.now, access=access), recorder)
        self._wires[wire.client] = wire
        return wire

    def _access(self, token: str | None) -> Access | None:
        authenticator = self.protocol.authenticator
        if authenticator is None:
            return UNGUARDED
        if token is None:
            return authenticator.anonymous
        access = authenticator.verify_token(token)
        if access is None:
            raise WireError("the token is not accepted")
        return access

    def send(self, client: int, output: Output) -> None:
        """Hand a frame to its client."""
        if (wire := self._wires.get(client)) is not None:
            wire.receive(output)

    def wake(self) -> None:
        """Do nothing when a timer is due earlier: the host ticks the timers."""

    def forget(self, client: int) -> None:
        """Drop what is still sent to a client that has left."""
        self._wires.pop(client, None)
