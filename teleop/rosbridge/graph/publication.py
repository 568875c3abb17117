"""A published message, with its frames in each encoding."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Final, Literal, TypeAlias

from teleop.rosbridge.framing.detail import share_of
from teleop.rosbridge.framing.png_compression import PngPacker
from teleop.rosbridge.messages.cbor import cbor_pieces, view_if_large, write_cbor
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.ros_time import SECOND

Encoding: TypeAlias = Literal["none", "png", "cbor", "cbor-raw"]
"""Encoding of a subscriber's messages: JSON, JSON in a PNG, CBOR, or ROS serialisation in CBOR."""

ENCODINGS: Final[tuple[Encoding, ...]] = ("none", "png", "cbor", "cbor-raw")
"""Encodings in ascending priority; of several that a client requests, the last is used."""

Thin: TypeAlias = Callable[[Message, float], Message]
"""Returns a message with a share of its parts, 0 to 1, evenly chosen."""

_Pieces: TypeAlias = Sequence[bytes | memoryview]

_MAX_FRAMES: Final = 8
"""Frames of a message that are kept; the bodies are kept for all spellings of its topic."""

_CBOR_HEAD: Final = b"\xa3" + write_cbor("op") + write_cbor("publish") + write_cbor("topic")
_CBOR_PART: Final = write_cbor("msg")


class Publication:
    """A published message, encoded when its first subscriber needs it and once for all of them."""

    def __init__(
        self,
        kind: MessageType,
        message: Message,
        encoders: MessageEncoders,
        png: PngPacker,
        now: int,
        *,
        newest: bool = False,
        thin: Thin | None = None,
        captured: int = 0,
    ) -> None:
        self.message = message
        self.thin = thin
        """Makes less of the message; None if it is whole or nothing."""

        self.newest = newest
        """Whether it is worth nothing once a newer one is there."""

        self.captured = captured
        """Time at which its content was captured [ns]; 0 if unknown."""

        self.size = 0
        """Memory of a latched message of a client [bytes]."""

        self._kind = kind
        self._encoders = encoders
        self._now = now
        self._png = png
        self._bodies: dict[tuple[Encoding, RosVersion | None, int], _Pieces] = {}
        """The message itself in each encoding and level of detail, without the topic's name."""

        self._frames: dict[tuple[str, Encoding, RosVersion, int], bytes] = {}

    def frame(
        self, topic: str, encoding: Encoding, ros_version: RosVersion, level: int = 0
    ) -> bytes:
        """Return the payload of the frame, with the topic's name as its subscriber spells it, in a level of detail."""
        key = topic, encoding, ros_version, level
        if key not in self._frames:
            while len(self._frames) >= _MAX_FRAMES:  # a topic has hundreds of spellings
                del self._frames[next(iter(self._frames))]
            self._frames[key] = self._encode(topic, encoding, ros_version, level)
        return self._frames[key]

    def _encode(self, topic: str, encoding: Encoding, ros_version: RosVersion, level: int) -> bytes:
        if encoding == "png":
            return self._png.pack(self.frame(topic, "none", ros_version, level), self._now)
        body = self._body(encoding, ros_version if encoding == "cbor-raw" else None, level)
        if encoding == "none":
            head = f'{{"op":"publish","topic":{json.dumps(topic)},"msg":'.encode("ascii")
            return b"".join((head, *body, b"}"))
        return b"".join((_CBOR_HEAD, write_cbor(topic), _CBOR_PART, *body))

    def _body(self, encoding: Encoding, ros_version: RosVersion | None, level: int) -> _Pieces:
        key = encoding, ros_version, level
        if key not in self._bodies:
            message = self.message
            if level and self.thin is not None:
                message = self.thin(message, share_of(level))
            self._bodies[key] = self._encode_body(message, encoding, ros_version)
        return self._bodies[key]

    def _encode_body(
        self, message: Message, encoding: Encoding, ros_version: RosVersion | None
    ) -> _Pieces:
        if ros_version is not None:
            data = self._encoders.serializers[ros_version].bytes(self._kind, message)
            secs, nsecs = divmod(self._now, SECOND)
            return cbor_pieces({"secs": secs, "nsecs": nsecs, "bytes": view_if_large(data)})
        if encoding == "cbor":
            return cbor_pieces(self._encoders.codec.cbor(self._kind, message))
        return self._encoders.codec.json_pieces(self._kind, message)
