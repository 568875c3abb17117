"""Topics: who publishes, who subscribes, and which message goes to whom when."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

from teleop.rosbridge.framing.outgoing_frames import FrameKind, OutgoingFrame
from teleop.rosbridge.framing.png_compression import png_operation
from teleop.rosbridge.messages.json_cbor_codec import view_if_large, write_cbor
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.messages.ros_serialization import RosVersion

Encoding: TypeAlias = Literal["none", "png", "cbor", "cbor-raw"]
"""How a subscriber gets its messages: JSON, JSON in a encode_png, CBOR, or ROS's own bytes in CBOR."""

ENCODINGS: Final[tuple[Encoding, ...]] = ("none", "png", "cbor", "cbor-raw")
"""By rank: of several that a client asks for, the last counts."""

TopicHandler: TypeAlias = Callable[[int, Message, int], None]
"""Takes a client's id, its message and the time it came [ns]."""

Monitor: TypeAlias = Callable[[Message, int], None]
"""Takes a message, whoever published it, and the time [ns]."""

_MILLISECOND: Final = 1_000_000
_SECOND: Final = 1_000_000_000


class Publication:
    """A published message, encoded when the first subscriber needs it and once for all of them."""

    def __init__(
        self, kind: MessageType, message: Message, encoders: MessageEncoders, now: int
    ) -> None:
        self.message = message
        self._kind = kind
        self._encoders = encoders
        self._now = now
        self._json: list[bytes] | None = None
        self._cbor: Message | None = None
        self._raw: dict[RosVersion, bytes] = {}
        self._frames: dict[tuple[str, Encoding, RosVersion], bytes] = {}

    def frame(self, topic: str, encoding: Encoding, flavour: RosVersion) -> bytes:
        """Return the frame's payload, under the topic's name as its subscriber writes it."""
        key = topic, encoding, flavour
        if key not in self._frames:
            self._frames[key] = self._encode(topic, encoding, flavour)
        return self._frames[key]

    def _encode(self, topic: str, encoding: Encoding, flavour: RosVersion) -> bytes:
        codec = self._encoders.codec
        if encoding == "png":
            return png_operation(self.frame(topic, "none", flavour))
        if encoding == "cbor-raw":
            if flavour not in self._raw:
                self._raw[flavour] = self._encoders.raw(flavour).bytes(self._kind, self.message)
            secs, nsecs = divmod(self._now, _SECOND)
            content = {"secs": secs, "nsecs": nsecs, "bytes": view_if_large(self._raw[flavour])}
            return write_cbor({"op": "publish", "topic": topic, "msg": content})
        if encoding == "cbor":
            if self._cbor is None:
                self._cbor = codec.cbor(self._kind, self.message)
            return write_cbor({"op": "publish", "topic": topic, "msg": self._cbor})
        if self._json is None:
            self._json = codec.json_pieces(self._kind, self.message)
        head = f'{{"op":"publish","topic":{json.dumps(topic)},"msg":'.encode("ascii")
        return b"".join((head, *self._json, b"}"))


@dataclass(frozen=True, slots=True)
class SubscribeOptions:
    """One ``subscribe``, of which a client may have several on a topic."""

    throttle: int = 0
    """Shortest time between two messages [ms]."""

    depth: int = 0
    """``queue_length``: messages that may wait; 0 for as many as there is room for."""

    encoding: Encoding = "none"

    fragment: int = 0
    """Largest piece of a message [bytes]; 0 for whole ones."""

    flavour: RosVersion = "ros2"
    """Whose bytes ``cbor-raw`` brings."""


@dataclass(slots=True)
class Subscription:
    """A client's subscription to a topic: all its requests as one, for one message serves all."""

    topic: str
    """The name as the client wrote it; it comes back byte for byte."""

    requests: dict[object, SubscribeOptions] = field(default_factory=dict)
    """By the ids of the ``subscribe`` operations."""

    _merged: SubscribeOptions = field(default_factory=SubscribeOptions)
    _sent: int | None = None
    _waiting: Publication | None = None

    def merge(self) -> None:
        """Take the requests together: the fastest, the shortest queue and pieces, the densest coding."""
        requests = self.requests.values()
        self._merged = SubscribeOptions(
            min(r.throttle for r in requests) * _MILLISECOND,
            min(r.depth for r in requests),
            max((r.encoding for r in requests), key=ENCODINGS.index),
            min((r.fragment for r in requests if r.fragment), default=0),
            next(reversed(requests)).flavour,
        )

    @property
    def due(self) -> int | None:
        """When a message that was held back may leave [ns]."""
        if self._waiting is None or self._sent is None:
            return None
        return self._sent + self._merged.throttle

    def offer(self, publication: Publication, now: int) -> OutgoingFrame | None:
        """Return the frame to send now, or keep the message for when its time has come.

        The last message of a burst is thus always seen, if late: whoever throttles a stick's
        positions must not miss its return to zero.
        """
        if self._sent is not None and now < self._sent + self._merged.throttle:
            self._waiting = publication
            return None
        return self._send(publication, now)

    def tick(self, now: int) -> OutgoingFrame | None:
        """Return the frame that was held back, if its time has come."""
        if self._waiting is None or self.due is None or now < self.due:
            return None
        return self._send(self._waiting, now)

    def _send(self, publication: Publication, now: int) -> OutgoingFrame:
        merged = self._merged
        payload = publication.frame(self.topic, merged.encoding, merged.flavour)
        self._sent = now
        self._waiting = None
        binary = merged.encoding in ("cbor", "cbor-raw")
        return OutgoingFrame(
            FrameKind.DATA,
            payload,
            binary,
            topic=self.topic,
            depth=merged.depth,
            fragment=0 if binary else merged.fragment,
        )


@dataclass(slots=True)
class Topic:
    """One topic, for as long as anybody has to do with it, and a little longer."""

    name: str
    kind: MessageType
    owned: bool = False
    """Whether the host publishes here; then no client does."""

    latch: bool = False
    """Whether the host's last message is kept for who comes later."""

    listener: TopicHandler | None = None
    """The host's, if it subscribes."""

    taps: list[Monitor] = field(default_factory=list)
    """The host's, too: they hear all, also what the host itself publishes."""

    subscriptions: dict[int, Subscription] = field(default_factory=dict)
    """By client."""

    advertisers: dict[int, dict[object, bool]] = field(default_factory=dict)
    """By client: its ids, and whether each asked to latch."""

    latched: dict[int, Publication] = field(default_factory=dict)
    """Last messages, by who published them."""

    idle_since: int | None = None
    """When the last who had to do with it left [ns]."""

    @property
    def idle(self) -> bool:
        """Whether nobody has to do with it any more."""
        return not (
            self.owned or self.listener or self.taps or self.subscriptions or self.advertisers
        )

    @property
    def wanted(self) -> bool:
        """Whether anybody would get a message."""
        return bool(self.subscriptions or self.taps)
