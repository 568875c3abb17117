from __future__ import annotations

import json
import re
from typing import Any

import pytest

from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.parameters import Parameters
from tests.teleop.rosbridge.support import ROOT, SECOND, Wire


@pytest.fixture
def wire() -> Wire:
    wire = Wire()
    serve_rosapi(wire.protocol)
    wire.protocol.topics.advertise("/scan", "sensor_msgs/LaserScan")
    wire.protocol.topics.subscribe("/joy", "sensor_msgs/Joy", lambda *_: None)
    return wire


def ask(wire: Wire, name: str, /, **args: Any) -> Any:
    (answer,) = wire.ask(
        {"op": "call_service", "service": f"/rosapi/{name}", "args": args, "id": "i"}
    )
    assert answer["result"] is True, answer
    return answer["values"]


def test_types_of_topics_are_found_both_ways_and_unknown_ones_are_empty(wire: Wire) -> None:
    assert ask(wire, "topic_type", topic="scan") == {"type": "sensor_msgs/msg/LaserScan"}
    assert ask(wire, "topic_type", topic="/nope") == {"type": ""}
    assert ask(wire, "topics_for_type", type="sensor_msgs/msg/Joy") == {"topics": ["/joy"]}
    assert ask(wire, "topics_for_type", type="nope/Nope") == {"topics": []}


def test_time_has_both_spellings_and_the_version_is_that_of_ros_2(wire: Wire) -> None:
    wire.now = 5 * SECOND + 7
    time = ask(wire, "get_time")["time"]
    assert time == {"sec": 5, "nanosec": 7, "secs": 5, "nsecs": 7}
    assert ask(wire, "get_ros_version") == {"version": 2, "distro": "jazzy"}


def test_services_are_listed_and_found_by_type(wire: Wire) -> None:
    assert "/rosapi/topics" in ask(wire, "services")["services"]
    kind = ask(wire, "service_type", service="/rosapi/topics")["type"]
    assert ask(wire, "services_for_type", type=kind) == {"services": ["/rosapi/topics"]}
    assert ask(wire, "services_for_type", type="nope/Nope") == {"services": []}
    assert ask(wire, "service_type", service="/nope") == {"type": ""}


def test_every_rosapi_service_responds(wire: Wire) -> None:
    names = [name for name in ask(wire, "services")["services"] if name.startswith("/rosapi/")]
    assert len(names) == 30
    for name in names:
        (answer,) = wire.ask({"op": "call_service", "service": name, "args": {}})
        # An empty name has no details and cannot be set.
        nothing = (name.endswith("_details") and "node" not in name) or name.endswith("/set_param")
        assert answer["result"] is not nothing


def test_the_documentation_lists_every_service(wire: Wire) -> None:
    page = (ROOT / "docs" / "rosbridge.md").read_text(encoding="utf-8")
    table = page.partition("`/rosapi` has 30 services")[2].partition("\n\n**")[0]
    listed = re.findall(r"`(\w+)`", table.partition("## ")[0])
    names = [name for name in ask(wire, "services")["services"] if name.startswith("/rosapi/")]
    assert sorted(f"/rosapi/{name}" for name in listed) == names


def test_nodes_are_the_server_and_each_client(wire: Wire) -> None:
    wire.send({"op": "subscribe", "topic": "/scan"})
    wire.send({"op": "advertise", "topic": "/chatter", "type": "std_msgs/String"})
    wire.send({"op": "advertise_service", "service": "/add", "type": "std_srvs/Empty"})
    assert ask(wire, "nodes") == {"nodes": ["/rosbridge_websocket", "/client_1"]}
    assert ask(wire, "node_details", node="/client_1") == {
        "subscribing": ["/scan"],
        "publishing": ["/chatter"],
        "services": ["/add"],
    }
    host = ask(wire, "node_details", node="rosbridge_websocket")
    assert (host["subscribing"], host["publishing"]) == (["/joy"], ["/scan"])
    assert "/rosapi/nodes" in host["services"]
    assert ask(wire, "publishers", topic="/scan") == {"publishers": ["/rosbridge_websocket"]}
    assert ask(wire, "subscribers", topic="/scan") == {"subscribers": ["/client_1"]}
    assert ask(wire, "publishers", topic="/chatter") == {"publishers": ["/client_1"]}
    assert ask(wire, "subscribers", topic="/nope") == {"subscribers": []}
    assert ask(wire, "service_node", service="/add") == {"node": "/client_1"}
    assert ask(wire, "service_node", service="/nope") == {"node": ""}
    for asked in ("/add", "std_srvs/Empty"):
        assert ask(wire, "service_providers", service=asked) == {"providers": ["/client_1"]}


def test_service_details_describe_request_and_response(wire: Wire) -> None:
    (asked,) = ask(wire, "service_request_details", type="std_srvs/SetBool")["typedefs"]
    (given,) = ask(wire, "service_response_details", type="std_srvs/srv/SetBool")["typedefs"]
    assert (asked["fieldnames"], asked["fieldtypes"]) == (["data"], ["bool"])
    assert given["fieldnames"] == ["success", "message"]


def test_actions_are_described_and_listed_in_both_forms(wire: Wire) -> None:
    kinds = {
        "goal": "actionlib/TestActionGoal",
        "cancel": "actionlib_msgs/GoalID",
        "status": "actionlib_msgs/GoalStatusArray",
        "feedback": "actionlib/TestActionFeedback",
        "result": "actionlib/TestActionResult",
    }
    for name, kind in kinds.items():
        wire.send({"op": "advertise", "topic": f"/old/{name}", "type": kind})
    wire.send({"op": "advertise", "topic": "/half/goal", "type": kinds["goal"]})
    wire.send({"op": "advertise_action", "action": "/new", "type": "example_interfaces/Fibonacci"})
    kind = "example_interfaces/action/Fibonacci"
    assert ask(wire, "action_servers") == {"action_servers": ["/new", "/old"]}
    assert ask(wire, "action_type", action="new") == {"type": kind}
    for part, field in (("goal", "order"), ("result", "sequence"), ("feedback", "sequence")):
        (typedef,) = ask(wire, f"action_{part}_details", type=kind)["typedefs"]
        assert typedef["fieldnames"] == [field]


def test_topics_are_listed_with_their_definitions() -> None:
    for flavour, kind, parts in (
        ("ros2", "sensor_msgs/msg/Joy", ["builtin_interfaces/Time stamp"]),
        ("ros1", "sensor_msgs/Joy", ["uint32 seq"]),
    ):
        wire = Wire(ros_version=flavour)
        serve_rosapi(wire.protocol)
        wire.send({"op": "advertise", "topic": "/joy", "type": "sensor_msgs/Joy"})
        answer = ask(wire, "topics_and_raw_types")
        assert (answer["topics"], answer["types"]) == (["/joy"], [kind])
        (text,) = answer["typedefs_full_text"]
        lines = text.splitlines()
        assert lines[:3] == ["std_msgs/Header header", "float32[] axes", "int32[] buttons"]
        assert lines[3:5] == ["=" * 80, "MSG: std_msgs/Header"]
        assert set(parts) < set(lines)


# Parameters


def test_parameters_are_set_read_and_deleted_as_json_text(wire: Wire) -> None:
    assert ask(wire, "get_param", name="test_param")["value"] == "null"
    assert ask(wire, "set_param", name="test_param", value='"test_value"')["successful"] is True
    assert ask(wire, "get_param", name="/test_param")["value"] == '"test_value"'
    assert ask(wire, "has_param", name="test_param") == {"exists": True}
    assert ask(wire, "search_param", name="test_param") == {"global_name": "/test_param"}
    assert ask(wire, "get_param_names") == {"names": ["/rosdistro", "/test_param"]}
    assert ask(wire, "delete_param", name="test_param")["successful"] is True
    assert ask(wire, "delete_param", name="test_param")["successful"] is False
    assert ask(wire, "has_param", name="test_param") == {"exists": False}
    assert ask(wire, "search_param", name="test_param") == {"global_name": ""}


@pytest.mark.parametrize("value", ["1", "1.5", "true", "[1, 2]", '{"a": {"b": "\\u00e9"}}', '"x"'])
def test_parameters_may_be_any_json(wire: Wire, value: str) -> None:
    ask(wire, "set_param", name="/a/b", value=value)
    assert ask(wire, "get_param", name="/a/b")["value"] == value


@pytest.mark.parametrize("value", ["plain words", "NaN", "1e999", "{", "[" * 100_0])
def test_text_that_is_not_json_is_a_string_parameter(wire: Wire, value: str) -> None:
    ask(wire, "set_param", name="x", value=value)
    assert json.loads(ask(wire, "get_param", name="x")["value"]) == value


@pytest.mark.parametrize("key", ["default", "default_value"])
def test_unset_parameter_has_the_default_of_the_caller(wire: Wire, key: str) -> None:
    assert ask(wire, "get_param", name="/nope", **{key: "default"})["value"] == '"default"'
    assert ask(wire, "get_param", name="/nope", **{key: "[1]"})["value"] == "[1]"
    assert ask(wire, "get_param", name="/rosdistro", **{key: "default"})["value"] == '"jazzy"'


def test_namespaces_are_read_and_deleted_as_a_whole(wire: Wire) -> None:
    ask(wire, "set_param", name="/robot/wheel/radius", value="0.11")
    ask(wire, "set_param", name="/robot/name", value='"p3at"')
    value = json.loads(ask(wire, "get_param", name="/robot")["value"])
    assert value == {"wheel": {"radius": 0.11}, "name": "p3at"}
    ask(wire, "set_param", name="/robot/name/first", value="1")
    assert json.loads(ask(wire, "get_param", name="/")["value"])["robot"]["name"] == {"first": 1}
    ask(wire, "delete_param", name="/robot")
    assert ask(wire, "get_param_names") == {"names": ["/rosdistro"]}


def test_parameters_are_bounded_in_number_and_size(wire: Wire) -> None:
    parameters = Parameters()
    for i in range(1000):
        parameters.set(f"p{i}", i)
    parameters.set("p0", "again")
    with pytest.raises(ServiceError, match="at most 1000"):
        parameters.set("one_more", 1)
    for args in ({"name": "x", "value": "1" * 70_000}, {"name": "", "value": "1"}):
        (answer,) = wire.ask({"op": "call_service", "service": "/rosapi/set_param", "args": args})
        assert answer["result"] is False
    (answer,) = wire.ask(
        {"op": "call_service", "service": "/rosapi/get_param", "args": {"name": "x" * 300}}
    )
    assert answer["result"] is False


def test_type_details_include_nested_types(wire: Wire) -> None:
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
