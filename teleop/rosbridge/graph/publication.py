"""A published message, with its frames in each encoding."""

from __future__ import annotations

import json
from typing import Final, Literal, TypeAlias

from teleop.rosbridge.framing.png_compression import png_operation
from teleop.rosbridge.messages.cbor import view_if_large, write_cbor
from teleop.rosbridge.messages.message_encoders import MessageEncoders
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.ros_time import SECOND

Encoding: TypeAlias = Literal["none", "png", "cbor", "cbor-raw"]
"""Encoding of a subscriber's messages: JSON, JSON in a PNG, CBOR, or ROS serialisation in CBOR."""

ENCODINGS: Final[tuple[Encoding, ...]] = ("none", "png", "cbor", "cbor-raw")
"""Encodings in ascending priority; of several that a client requests, the last is used."""


_MAX_FRAMES: Final = 8
"""Encoded frames of a message that are kept."""


class Publication:
    """A published message, encoded when its first subscriber needs it and once for all of them."""

    def __init__(
        self, kind: MessageType, message: Message, encoders: MessageEncoders, now: int
    ) -> None:
        self.message = message
        self.size = 0
        """Memory of a latched message of a client [bytes]."""

        self._kind = kind
        self._encoders = encoders
        self._now = now
        self._json: list[bytes] | None = None
        self._cbor: Message | None = None
        self._serialized: dict[RosVersion, bytes] = {}
        self._frames: dict[tuple[str, Encoding, RosVersion], bytes] = {}

    def frame(self, topic: str, encoding: Encoding, ros_version: RosVersion) -> bytes:
        """Return the payload of the frame, with the topic's name as its subscriber spells it."""
        key = topic, encoding, ros_version
        if key not in self._frames:
            while len(self._frames) >= _MAX_FRAMES:  # a topic has hundreds of spellings
                del self._frames[next(iter(self._frames))]
            self._frames[key] = self._encode(topic, encoding, ros_version)
        return self._frames[key]

    def _encode(self, topic: str, encoding: Encoding, ros_version: RosVersion) -> bytes:
        codec = self._encoders.codec
        if encoding == "png":
            return png_operation(self.frame(topic, "none", ros_version))
        if encoding == "cbor-raw":
            if ros_version not in self._serialized:
                serializer = self._encoders.serializer(ros_version)
                self._serialized[ros_version] = serializer.bytes(self._kind, self.message)
            secs, nsecs = divmod(self._now, SECOND)
            data = view_if_large(self._serialized[ros_version])
            content = {"secs": secs, "nsecs": nsecs, "bytes": data}
            return write_cbor({"op": "publish", "topic": topic, "msg": content})
        if encoding == "cbor":
            if self._cbor is None:
                self._cbor = codec.cbor(self._kind, self.message)
            return write_cbor({"op": "publish", "topic": topic, "msg": self._cbor})
        if self._json is None:
            self._json = codec.json_pieces(self._kind, self.message)
        head = f'{{"op":"publish","topic":{json.dumps(topic)},"msg":'.encode("ascii")
        return b"".join((head, *self._json, b"}"))
