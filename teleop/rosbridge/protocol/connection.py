"""The protocol state of one connected client."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from teleop.rosbridge.auth.permissions import Access, Act
from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.framing.fragments import Reassembly
from teleop.rosbridge.limits import TokenBucket

STATUS_LEVELS: Final = {"none": 0, "error": 1, "warning": 2, "info": 3}
"""Levels of ``status`` and ``set_level``; a client receives those up to its own."""


@dataclass(slots=True)
class Connection:
    """One connected client."""

    id: int
    name: str
    """Number and address, or the name that it has given itself; no two clients have the same."""

    address: str
    since: int
    """Time of connection [ns]."""

    operation_rate: TokenBucket
    byte_rate: TokenBucket
    part_rate: TokenBucket
    tolerance: TokenBucket
    """What it may exceed its rates by, in seconds of them."""

    reassembly: Reassembly
    """Its incomplete fragmented messages."""

    access: Access | None
    """Its permissions; None until it has authenticated."""

    deferred: list[str] = field(default_factory=list)
    """Its large reassembled messages that are still to be processed."""

    level: int = STATUS_LEVELS["error"]
    """Highest status level it receives."""

    lossless: bool = False
    """Whether all its frames are sent, in their order."""

    excess_reported: int | None = None
    """Time of the last report that it exceeds a rate [ns]."""

    barred: str = ""
    """Why an operator keeps it out unless it authenticates; empty if none does."""

    closing: bool = False
    """Whether it is being disconnected; its frames are ignored."""

    closed_for: str = ""
    """Why the server has disconnected it; empty if the client has left by itself."""

    fragmented: int = 0
    """Number of messages sent in fragments, which numbers their ids."""

    @property
    def number_and_address(self) -> str:
        """What it is called unless it has given itself a name."""
        return f"client {self.id} ({self.address})" if self.address else f"client {self.id}"

    @property
    def host(self) -> str:
        """Its address without the port; empty if it has none."""
        return self.address.rpartition(":")[0]

    @property
    def origin(self) -> str:
        """For whom its rates are remembered: its address, with the name of its token if it has one."""
        named = self.host and self.access is not None and self.access.holder
        return f"{self.host} {self.access.holder}" if named and self.access else self.host

    @property
    def rates(self) -> dict[str, TokenBucket]:
        """The buckets that are remembered for its address, by name."""
        return {
            "operations": self.operation_rate,
            "bytes": self.byte_rate,
            "parts": self.part_rate,
            "tolerance": self.tolerance,
        }

    def refusal(self, act: Act, name: str) -> str | None:
        """Return why the client may not use a name; None if it may."""
        if self.access is None:
            return "authentication with a token is required"
        return self.access.refusal(act, name)

    def require(self, act: Act, name: str) -> None:
        """Raise OperationError if the client may not use a name."""
        if refusal := self.refusal(act, name):
            raise OperationError(refusal)
