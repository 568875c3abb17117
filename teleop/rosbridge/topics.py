"""Topics: who publishes, who subscribes, and which message goes to whom when."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

from teleop.rosbridge.codec import Codec, write_cbor
from teleop.rosbridge.outgoing import Kind, Outgoing
from teleop.rosbridge.types import Message, MessageType

Encoding: TypeAlias = Literal["none", "cbor"]
"""How a subscriber gets its messages: JSON, or CBOR."""

Listener: TypeAlias = Callable[[int, Message, int], None]
"""Takes a client's id, its message and the time it came [ns]."""

HOST: Final = -1
"""Who publishes when it is not a client: the program that runs the server."""

_MILLISECOND: Final = 1_000_000


class Publication:
    """A published message, encoded when the first subscriber needs it and once for all of them."""

    def __init__(self, kind: MessageType, message: Message, codec: Codec) -> None:
        self._kind = kind
        self._message = message
        self._codec = codec
        self._json: str | None = None
        self._cbor: Message | None = None
        self._frames: dict[tuple[str, Encoding], bytes] = {}

    def frame(self, topic: str, encoding: Encoding) -> bytes:
        """Return the frame's payload, under the topic's name as its subscriber writes it."""
        key = topic, encoding
        if key not in self._frames:
            self._frames[key] = self._encode(topic, encoding)
        return self._frames[key]

    def _encode(self, topic: str, encoding: Encoding) -> bytes:
        if encoding == "cbor":
            if self._cbor is None:
                self._cbor = self._codec.cbor(self._kind, self._message)
            return write_cbor({"op": "publish", "topic": topic, "msg": self._cbor})
        if self._json is None:
            self._json = self._codec.json(self._kind, self._message)
        return f'{{"op":"publish","topic":{json.dumps(topic)},"msg":{self._json}}}'.encode("ascii")


@dataclass(frozen=True, slots=True)
class Request:
    """One ``subscribe``, of which a client may have several on a topic."""

    throttle: int = 0
    """Shortest time between two messages [ms]."""

    depth: int = 0
    """``queue_length``: messages that may wait; 0 for as many as there is room for."""

    encoding: Encoding = "none"


@dataclass(slots=True)
class Subscription:
    """A client's subscription to a topic: all its requests as one, for one message serves all."""

    topic: str
    """The name as the client wrote it; it comes back byte for byte."""

    requests: dict[object, Request] = field(default_factory=dict)
    """By the ids of the ``subscribe`` operations."""

    _throttle: int = 0
    _depth: int = 0
    _encoding: Encoding = "none"
    _sent: int | None = None
    _waiting: Publication | None = None

    def merge(self) -> None:
        """Take the requests together: the fastest, the shortest queue, CBOR if anybody reads it."""
        self._throttle = min(r.throttle for r in self.requests.values()) * _MILLISECOND
        self._depth = min(r.depth for r in self.requests.values())
        cbor = any(request.encoding == "cbor" for request in self.requests.values())
        self._encoding = "cbor" if cbor else "none"

    @property
    def due(self) -> int | None:
        """When a message that was held back may leave [ns]."""
        if self._waiting is None or self._sent is None:
            return None
        return self._sent + self._throttle

    def offer(self, publication: Publication, now: int) -> Outgoing | None:
        """Return the frame to send now, or keep the message for when its time has come.

        The last message of a burst is thus always seen, if late: whoever throttles a stick's
        positions must not miss its return to zero.
        """
        if self._sent is not None and now < self._sent + self._throttle:
            self._waiting = publication
            return None
        return self._send(publication, now)

    def tick(self, now: int) -> Outgoing | None:
        """Return the frame that was held back, if its time has come."""
        if self._waiting is None or self.due is None or now < self.due:
            return None
        return self._send(self._waiting, now)

    def _send(self, publication: Publication, now: int) -> Outgoing:
        payload = publication.frame(self.topic, self._encoding)
        self._sent = now
        self._waiting = None
        binary = self._encoding == "cbor"
        return Outgoing(Kind.DATA, payload, binary, topic=self.topic, depth=self._depth)


@dataclass(slots=True)
class Topic:
    """One topic, for as long as anybody has to do with it."""

    name: str
    kind: MessageType
    owned: bool = False
    """Whether the host publishes here; then no client does."""

    latch: bool = False
    """Whether the host's last message is kept for who comes later."""

    listener: Listener | None = None
    """The host's, if it subscribes."""

    subscriptions: dict[int, Subscription] = field(default_factory=dict)
    """By client."""

    advertisers: dict[int, dict[object, bool]] = field(default_factory=dict)
    """By client: its ids, and whether each asked to latch."""

    latched: dict[int, Publication] = field(default_factory=dict)
    """Last messages, by who published them."""

    @property
    def idle(self) -> bool:
        """Whether nobody has to do with it any more."""
        return not (self.owned or self.listener or self.subscriptions or self.advertisers)


def canonical(name: str) -> str:
    """Return the name that ``chatter``, ``/chatter`` and ``/chatter/`` share."""
    return "/" + name.strip("/")
