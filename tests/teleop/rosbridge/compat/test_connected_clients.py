from __future__ import annotations

import json

import pytest

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.compat.connected_clients import publish_connected_clients
from teleop.rosbridge.compat.rosout import publish_rosout
from teleop.rosbridge.messages.ros_serialization import RosVersion
from tests.teleop.rosbridge.auth.test_permissions import TOKENS, credentials
from tests.teleop.rosbridge.support import Wire


def test_number_and_addresses_of_clients_are_published() -> None:
    wire = Wire(clients=0)
    publish_connected_clients(wire.protocol)
    wire.now += 7
    wire.clients = [wire.protocol.connect(wire.now, "10.0.0.5:1234")]
    for topic in ("/client_count", "/connected_clients"):
        wire.send({"op": "subscribe", "topic": topic})
    count, clients = wire.received()
    assert count["msg"] == {"data": 1}
    (only,) = clients["msg"]["clients"]
    assert only["ip_address"] == "10.0.0.5"
    assert (only["connection_time"]["sec"], only["connection_time"]["nanosec"]) == (1, 7)
    other = wire.protocol.connect(wire.now, "::1:9")
    assert wire.received()[0]["msg"] == {"data": 2}
    wire.protocol.disconnect(other, wire.now)
    assert wire.received()[0]["msg"] == {"data": 1}


@pytest.mark.parametrize(
    ("flavour", "kind", "levels"),
    [("ros2", "rcl_interfaces/msg/Log", (20, 30)), ("ros1", "rosgraph_msgs/Log", (2, 4))],
)
def test_connections_and_auth_are_logged_in_the_format_of_each_ros(
    flavour: RosVersion, kind: str, levels: tuple[int, int]
) -> None:
    wire = Wire(
        authenticator=Authenticator(credentials(Role.VIEW), lambda: 0.0), ros_version=flavour
    )
    publish_rosout(wire.protocol)
    (topic,) = (topic for topic in wire.protocol.topics.all if topic.name == "/rosout")
    assert wire.protocol.registry[kind] is topic.kind
    wire.send({"op": "subscribe", "topic": "/rosout"})
    for token in (TOKENS[Role.OPERATE], "no token of anybody"):
        client = wire.protocol.connect(wire.now, "10.0.0.7:5")
        wire.protocol.receive(client, json.dumps({"op": "auth", "token": token}), wire.now)
        wire.protocol.disconnect(client, wire.now)
    said = [message["msg"] for message in wire.received()]
    assert [(each["level"], each["msg"]) for each in said] == [
        (levels[0], "client 2 (10.0.0.7:5) has connected"),
        (levels[0], "client 2 (10.0.0.7:5) authenticated as operateer, role operate"),
        (levels[0], "client 2 (10.0.0.7:5) has disconnected"),
        (levels[0], "client 3 (10.0.0.7:5) has connected"),
        (levels[1], "client 3 (10.0.0.7:5): authentication rejected"),
        (levels[0], "client 3 (10.0.0.7:5) has disconnected"),
    ]
    stamps = [(each["header"] if flavour == "ros1" else each)["stamp"]["sec"] for each in said]
    assert stamps == [1] * 6
