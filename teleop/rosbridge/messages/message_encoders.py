"""All ways of writing a message, made when they are needed first."""

from __future__ import annotations

from teleop.rosbridge.messages.json_cbor_codec import Codec, StampFields
from teleop.rosbridge.messages.ros_serialization import RosSerializer, RosVersion
from teleop.rosbridge.messages.type_registry import TypeRegistry


class MessageEncoders:
    """JSON and CBOR by one codec, ROS's own bytes by one for each ROS."""

    def __init__(self, registry: TypeRegistry, stamps: StampFields) -> None:
        self.codec = Codec(registry, stamps=stamps)
        self._registry = registry
        self._raw: dict[RosVersion, RosSerializer] = {}

    def raw(self, flavour: RosVersion) -> RosSerializer:
        """Return the codec of a ROS's own bytes."""
        if flavour not in self._raw:
            self._raw[flavour] = RosSerializer(self._registry, flavour)
        return self._raw[flavour]
