"""The topic ``/rosout``: log of connections, disconnections and authentication.

Foxglove derives the ROS version from the type of this topic and reads all others accordingly.
"""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import stamp

TOPIC: Final = "/rosout"

_NAME: Final = "rosbridge_websocket"
"""Name of the node, as in rosbridge_suite."""

_TYPES: Final = {"ros1": "rosgraph_msgs/Log", "ros2": "rcl_interfaces/Log"}

_LEVELS: Final = {"ros1": {"info": 2, "warning": 4}, "ros2": {"info": 20, "warning": 30}}
"""``INFO`` and ``WARN`` of the two types."""


def publish_rosout(protocol: Protocol) -> None:
    """Publish on ``/rosout`` which clients connect, disconnect and authenticate."""
    protocol.topics.advertise(TOPIC, _TYPES[protocol.ros_version])
    protocol.observers.add(_Publisher(protocol))


class _Publisher(Observer):
    def __init__(self, protocol: Protocol) -> None:
        self._protocol = protocol

    def connected(self, connection: Connection, now: int) -> None:
        self._log("info", f"{connection.name} has connected", now)

    def disconnected(self, connection: Connection, now: int) -> None:
        self._log("info", f"{connection.name} has disconnected", now)

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        if access is None:
            self._log("warning", f"{connection.name}: authentication rejected", now)
        else:
            text = f"{connection.name} authenticated as {access.holder}, role {access.role}"
            self._log("info", text, now)

    def _log(self, level: str, text: str, now: int) -> None:
        ros_version = self._protocol.ros_version
        when: Message = {"stamp": stamp(now)}
        head = {"header": when} if ros_version == "ros1" else when
        rest = {"level": _LEVELS[ros_version][level], "name": _NAME, "msg": text}
        self._protocol.topics.publish(TOPIC, {**head, **rest}, now)
