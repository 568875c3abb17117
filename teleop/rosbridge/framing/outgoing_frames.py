"""What leaves the protocol for a client."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from teleop.rosbridge.framing.fragments import split_message


class FrameKind(Enum):
    """How a frame may be treated while it waits."""

    CONTROL = "control"
    """Answers and status: never dropped."""

    DATA = "data"
    """Messages of topics: a newer one may take an older one's place."""


@dataclass(frozen=True, slots=True)
class OutgoingFrame:
    """A frame for one client; its payload is shared with the others that get the same."""

    kind: FrameKind
    payload: bytes
    binary: bool = False
    """Whether it goes into a binary frame (CBOR) rather than a text frame (JSON)."""

    topic: str | None = None
    depth: int = 0
    """How many of the topic may wait; 0 leaves that to the size of the queue."""

    lossless: bool = False
    """Whether it keeps its place among all other frames of the client, and is never dropped."""

    fragment: int = 0
    """Largest piece its client wants [bytes]; 0 for the whole in one."""

    fragment_id: str = ""
    """Set if it is larger than that: the id of its fragments."""

    @property
    def text(self) -> str:
        """The JSON in a text frame."""
        return self.payload.decode("ascii")

    @property
    def frames(self) -> Iterable[bytes]:
        """What is sent: the payload, or its fragments, split_message as they are asked for."""
        if self.fragment_id:
            return split_message(self.payload, self.fragment, self.fragment_id)
        return (self.payload,)


@dataclass(frozen=True, slots=True)
class CloseFrame:
    """The client is to be disconnected."""

    code: int
    """Of the WebSocket's close frame."""

    reason: str


Output: TypeAlias = OutgoingFrame | CloseFrame

Sink: TypeAlias = Callable[[int, Output], None]
"""Takes what goes to a client, by its id."""
