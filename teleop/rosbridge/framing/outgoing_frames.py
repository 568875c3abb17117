"""Frames that leave the protocol for a client."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Final, TypeAlias

from teleop.rosbridge.framing.detail import Detail
from teleop.rosbridge.framing.fragments import split_message

POLICY_VIOLATION: Final = 1008
"""Code of a close frame (RFC 6455, section 7.4.1): the client violates a limit or rule."""

MESSAGE_TOO_BIG: Final = 1009
"""Code of a close frame (RFC 6455, section 7.4.1): a received frame is too large."""

TRY_AGAIN_LATER: Final = 1013
"""Code of the close frame for a client that reads too slowly."""


LARGE_BYTES: Final = 4096
"""Size from which on a message goes behind all smaller ones [bytes]: at 1 Mbit/s it takes 33 ms of the link."""


class FrameKind(Enum):
    """How a queued frame is treated when its client reads slowly."""

    CONTROL = "control"
    """Responses and status, which are never dropped."""

    DATA = "data"
    """Messages of topics, which newer ones may replace."""

    PING = "ping"
    """Pings, which wait as the messages before them do, so that they measure how long those take."""


@dataclass(frozen=True, slots=True)
class ReplyFormat:
    """How a client wants a response to be encoded."""

    png: bool = False
    """Whether the JSON is sent as a ``png`` operation."""

    fragment: int = 0
    """Largest fragment [bytes]; 0 for an unfragmented response."""


PLAIN: Final = ReplyFormat()


@dataclass(slots=True, eq=False)
class MessageTally:
    """What has become of the messages of one subscription."""

    sent: int = 0
    """Number of messages that were sent, or are queued."""

    dropped: int = 0
    """Number of queued messages that newer ones replaced."""

    made: int | None = None
    """Age of the newest message that was sent when it was encoded [ns]; None if unknown."""

    queued: int | None = None
    """Time for which that message waited to be sent [ns]; None before the first."""

    detail: Detail = field(default_factory=Detail)
    """How much of each message is sent, where it can be thinned."""


@dataclass(frozen=True, slots=True)
class OutgoingFrame:
    """A frame for one client; its payload is shared with other clients that receive the same."""

    kind: FrameKind
    payload: bytes
    binary: bool = False
    """Whether it is sent in a binary frame (CBOR) instead of a text frame (JSON)."""

    topic: str | None = None
    depth: int = 0
    """Number of frames of the topic that may be queued; 0 leaves it to the size of the queue."""

    newest: bool = False
    """Whether it is worth nothing once a newer one of its topic is there, and little once it has waited for long."""

    thinned: bool = False
    """Whether the message may have been thinned, or may be the next time."""

    lossless: bool = False
    """Whether the frame keeps its place among all frames of the client and is never dropped."""

    fragment: int = 0
    """Largest fragment requested by the client [bytes]; 0 for an unfragmented frame."""

    fragment_id: str = ""
    """Id of the fragments; empty if the frame is not fragmented."""

    captured: int = 0
    """Time at which the content was captured, by the server's clock [ns]; 0 if unknown."""

    tally: MessageTally | None = field(default=None, compare=False, repr=False)
    """Counts the messages of the subscription that the frame is for."""

    @property
    def large(self) -> bool:
        """Whether it is a message that goes behind those that are not, and whose way is measured."""
        size = len(self.payload)
        return self.kind is FrameKind.DATA and (size >= LARGE_BYTES or self.thinned)

    @property
    def whole(self) -> bool:
        """Whether it is one frame of the WebSocket, and no ping."""
        return not self.fragment_id and self.kind is not FrameKind.PING

    @property
    def text(self) -> str:
        """The JSON text of a text frame."""
        return self.payload.decode("ascii")

    @property
    def frames(self) -> Iterable[bytes]:
        """The payload, or its fragments, which are created while iterating."""
        if self.fragment_id:
            return split_message(self.payload, self.fragment, self.fragment_id)
        return (self.payload,)


@dataclass(frozen=True, slots=True)
class CloseFrame:
    """Request to disconnect the client."""

    code: int
    """Code of the WebSocket close frame."""

    reason: str


Output: TypeAlias = OutgoingFrame | CloseFrame
