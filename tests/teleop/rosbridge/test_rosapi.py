from __future__ import annotations

from typing import Any

import pytest

from teleop.rosbridge.rosapi import serve_rosapi
from tests.teleop.rosbridge.support import SECOND, Wire


@pytest.fixture
def wire() -> Wire:
    wire = Wire()
    serve_rosapi(wire.protocol)
    wire.protocol.advertise("/scan", "sensor_msgs/LaserScan")
    wire.protocol.listen("/joy", "sensor_msgs/Joy", lambda *_: None)
    return wire


def ask(wire: Wire, name: str, /, **args: Any) -> Any:
    (answer,) = wire.ask(
        {"op": "call_service", "service": f"/rosapi/{name}", "args": args, "id": "i"}
    )
    assert answer["result"] is True, answer
    return answer["values"]


def test_topics_are_listed_with_their_types(wire: Wire) -> None:
    assert ask(wire, "topics") == {
        "topics": ["/joy", "/scan"],
        "types": ["sensor_msgs/Joy", "sensor_msgs/LaserScan"],
    }


def test_a_topic_has_a_type_or_none(wire: Wire) -> None:
    assert ask(wire, "topic_type", topic="scan") == {"type": "sensor_msgs/LaserScan"}
    assert ask(wire, "topic_type", topic="/nope") == {"type": ""}


def test_topics_are_found_by_type(wire: Wire) -> None:
    assert ask(wire, "topics_for_type", type="sensor_msgs/msg/Joy") == {"topics": ["/joy"]}
    assert ask(wire, "topics_for_type", type="nope/Nope") == {"topics": []}


def test_services_are_listed_and_found_by_type(wire: Wire) -> None:
    assert "/rosapi/topics" in ask(wire, "services")["services"]
    kind = ask(wire, "service_type", service="/rosapi/topics")["type"]
    assert ask(wire, "services_for_type", type=kind) == {"services": ["/rosapi/topics"]}
    assert ask(wire, "services_for_type", type="nope/Nope") == {"services": []}
    assert ask(wire, "service_type", service="/nope") == {"type": ""}


def test_the_time_has_both_spellings(wire: Wire) -> None:
    wire.now = 5 * SECOND + 7
    time = ask(wire, "get_time")["time"]
    assert time == {"sec": 5, "nanosec": 7, "secs": 5, "nsecs": 7}


def test_the_version_of_ros_is_told(wire: Wire) -> None:
    assert ask(wire, "get_ros_version") == {"version": 2, "distro": "jazzy"}
    assert ask(wire, "nodes") == {"nodes": ["/rosbridge_websocket"]}


def test_a_type_is_described_with_all_it_is_made_of(wire: Wire) -> None:
    defs = ask(wire, "message_details", type="sensor_msgs/LaserScan")["typedefs"]
    assert [d["type"] for d in defs] == [
        "sensor_msgs/LaserScan",
        "std_msgs/Header",
        "builtin_interfaces/Time",
    ]
    scan = defs[0]
    assert scan["fieldnames"][:2] == ["header", "angle_min"]
    assert scan["fieldtypes"][:2] == ["std_msgs/Header", "float32"]
    assert scan["fieldarraylen"][0] == -1
    assert scan["fieldarraylen"][scan["fieldnames"].index("ranges")] == 0


def test_a_type_that_is_not_there_cannot_be_described(wire: Wire) -> None:
    (answer,) = wire.ask(
        {"op": "call_service", "service": "/rosapi/message_details", "args": {"type": "nope/Nope"}}
    )
    assert answer["result"] is False
    assert "nope/Nope" in answer["values"]
