"""The encoders of one server: JSON and CBOR, and the serialisations of ROS 1 and ROS 2."""

from __future__ import annotations

from typing import get_args

from teleop.rosbridge.messages.json_cbor_codec import Codec
from teleop.rosbridge.messages.ros_serialization import RosSerializer, RosVersion
from teleop.rosbridge.messages.type_registry import TypeRegistry


class MessageEncoders:
    """The JSON and CBOR codec, and a serialiser for each ROS."""

    def __init__(self, registry: TypeRegistry) -> None:
        self.codec = Codec(registry)
        self.serializers: dict[RosVersion, RosSerializer] = {
            version: RosSerializer(registry, version) for version in get_args(RosVersion)
        }
