"""The encoders of one server: JSON and CBOR, and the serialisations of ROS 1 and ROS 2."""

from __future__ import annotations

from teleop.rosbridge.messages.json_cbor_codec import Codec
from teleop.rosbridge.messages.ros_serialization import RosSerializer, RosVersion
from teleop.rosbridge.messages.type_registry import TypeRegistry


class MessageEncoders:
    """The JSON and CBOR codec, and a serialiser for each ROS that is created on first use."""

    def __init__(self, registry: TypeRegistry) -> None:
        self.codec = Codec(registry)
        self._registry = registry
        self._serializers: dict[RosVersion, RosSerializer] = {}

    def serializer(self, ros_version: RosVersion) -> RosSerializer:
        """Return the serialiser of a ROS version."""
        if ros_version not in self._serializers:
            self._serializers[ros_version] = RosSerializer(self._registry, ros_version)
        return self._serializers[ros_version]
