"""The topic ``/rosout``, on which every ROS tells what happens: here, who comes, goes and says who it is.

Foxglove knows by its type which ROS it talks to, and reads all other topics accordingly.
"""

from __future__ import annotations

from typing import Final

from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.messages.message_completion import stamp
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.protocol import Protocol

TOPIC: Final = "/rosout"

_NAME: Final = "rosbridge_websocket"
"""Of the node, as in rosbridge_suite."""

_TYPES: Final = {"ros1": "rosgraph_msgs/Log", "ros2": "rcl_interfaces/Log"}

_LEVELS: Final = {"ros1": {"info": 2, "warning": 4}, "ros2": {"info": 20, "warning": 30}}
"""``INFO`` and ``WARN`` of the two types."""


def publish_rosout(protocol: Protocol) -> None:
    """Publish on ``/rosout`` which clients come and go, and whose token is good or not."""
    flavour = protocol.flavour
    protocol.advertise(TOPIC, _TYPES[flavour])
    names = protocol.clients

    def log(level: str, text: str, now: int) -> None:
        when: Message = {"stamp": stamp(now)}
        head = {"header": when} if flavour == "ros1" else when
        rest = {"level": _LEVELS[flavour][level], "name": _NAME, "msg": text}
        protocol.publish(TOPIC, {**head, **rest}, now)

    def came(client: int, now: int) -> None:
        names[client] = protocol.clients[client]
        log("info", f"{names[client]} has connected", now)

    def left(client: int, now: int) -> None:
        log("info", f"{names.pop(client, 'a client')} has left", now)

    def judged(client: int, access: Access | None, now: int) -> None:
        if access is None:
            log("warning", f"{names[client]}: its auth is not accepted", now)
        else:
            log("info", f"{names[client]} is {access.holder}, role {access.role}", now)

    protocol.on_connect(came)
    protocol.on_disconnect(left)
    protocol.on_auth(judged)
