"""All ways of writing a message, made when they are needed first."""

from __future__ import annotations

from teleop.rosbridge.messages.json_cbor_codec import Codec, Stamps
from teleop.rosbridge.messages.ros_serialization import Flavour, RawCodec
from teleop.rosbridge.messages.type_registry import Registry


class Encoders:
    """JSON and CBOR by one codec, ROS's own bytes by one for each ROS."""

    def __init__(self, registry: Registry, stamps: Stamps) -> None:
        self.codec = Codec(registry, stamps=stamps)
        self._registry = registry
        self._raw: dict[Flavour, RawCodec] = {}

    def raw(self, flavour: Flavour) -> RawCodec:
        """Return the codec of a ROS's own bytes."""
        if flavour not in self._raw:
            self._raw[flavour] = RawCodec(self._registry, flavour)
        return self._raw[flavour]
