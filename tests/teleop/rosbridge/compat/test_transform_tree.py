from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given, strategies as st

from teleop.rosbridge import DEFAULT_RULES, Access, Authenticator, Credentials, Role
from teleop.rosbridge.compat.actionlib import serve_actionlib
from teleop.rosbridge.compat.tf2_web_republisher import serve_republisher
from teleop.rosbridge.compat.transform_tree import Transform, TransformTree
from tests.teleop.rosbridge.support import Wire

HALF = math.sqrt(0.5)
QUARTER_TURN = (0.0, 0.0, HALF, HALF)

numbers = st.floats(-10, 10)


@st.composite
def transforms(draw: st.DrawFn) -> Transform:
    q = [draw(st.floats(-1, 1)) for _ in range(4)]
    norm = math.hypot(*q)
    x, y, z, w = (c / norm for c in q) if norm > 0.1 else (0.0, 0.0, 0.0, 1.0)
    return Transform((draw(numbers), draw(numbers), draw(numbers)), (x, y, z, w))


def close(a: Transform, b: Transform) -> bool:
    return a.distance(b) < 1e-9 and a.angle(b) < 1e-6


@given(transforms(), transforms(), transforms())
def test_transforms_are_a_group(a: Transform, b: Transform, c: Transform) -> None:
    assert close((a @ b) @ c, a @ (b @ c))
    assert close(a @ a.inverse, Transform())
    assert close(a @ Transform(), a)


def test_quarter_turn_maps_forward_to_left() -> None:
    turned = Transform((1.0, 0.0, 0.0), QUARTER_TURN) @ Transform((2.0, 0.0, 0.0))
    assert turned.translation == pytest.approx((1.0, 2.0, 0.0))
    assert turned.angle(Transform()) == pytest.approx(math.pi / 2)


def message(*entries: tuple[str, str, Transform]) -> Any:
    return {
        "transforms": [
            {"header": {"frame_id": parent}, "child_frame_id": child, "transform": t.write()}
            for parent, child, t in entries
        ]
    }


@given(transforms(), transforms(), transforms())
def test_frames_are_found_over_their_common_ancestor(
    a: Transform, b: Transform, c: Transform
) -> None:
    tree = TransformTree()
    tree.add(message(("map", "base", a), ("/base", "camera", b), ("map", "/dock", c)))
    found = tree.find("dock", "camera")
    assert found is not None
    assert close(found, c.inverse @ a @ b)
    back = tree.find("camera", "dock")
    assert back is not None
    assert close(back, found.inverse)
    assert tree.find("map", "elsewhere") is None
    assert tree.find("nowhere", "nowhere") == Transform()


def test_frame_loops_and_invalid_quaternions_are_ignored() -> None:
    tree = TransformTree()
    tree.add(message(("a", "b", Transform()), ("b", "a", Transform()), ("x", "x", Transform())))
    assert tree.find("a", "c") is None
    tree.add(message(("a", "d", Transform(rotation=(0.0, 0.0, 0.0, 0.0)))))
    assert tree.find("a", "d") is None


def test_number_of_frames_is_limited() -> None:
    tree = TransformTree()
    for i in range(5000):
        tree.add(message(("map", f"f{i}", Transform())))
    assert tree.find("map", "f4095") is not None
    assert tree.find("map", "f4096") is None


# The republisher

GOAL = {
    "source_frames": ["/base"],
    "target_frame": "map",
    "trans_thres": 0.1,
    "angular_thres": 2.0,
    "rate": 10.0,
}


@pytest.fixture
def wire() -> Wire:
    wire = Wire(clients=2)
    serve_republisher(wire.protocol)
    wire.protocol.topics.advertise("/tf_static", "tf2_msgs/TFMessage", latch=True)
    wire.protocol.topics.advertise("/tf", "tf2_msgs/TFMessage")
    at = Transform((0.0, 0.0, 1.0))
    wire.protocol.topics.publish("/tf_static", message(("odom", "base", at)), wire.now)
    return wire


def move(wire: Wire, x: float) -> None:
    wire.protocol.topics.publish(
        "/tf", message(("map", "odom", Transform((x, 0.0, 0.0)))), wire.now
    )


def transforms_in(received: list[Any]) -> list[tuple[str, str, float]]:
    """Return parent, child and x of each transform in messages or feedback."""
    found = []
    for operation in received:
        content = operation.get("msg") or operation.get("values") or {}
        for t in content.get("feedback", content).get("transforms", []):
            x = t["transform"]["translation"]["x"]
            found.append((t["header"]["frame_id"], t["child_frame_id"], x))
    return found


def begin(wire: Wire, form: str) -> None:
    if form == "service":
        call = {"op": "call_service", "service": "/republish_tfs", "args": GOAL}
        (answer,) = wire.ask(call)
        wire.send({"op": "subscribe", "topic": answer["values"]["topic_name"]})
    elif form == "action":
        goal = {"op": "send_action_goal", "action": "/tf2_web_republisher", "feedback": True}
        wire.send({**goal, "action_type": "x/Y", "args": GOAL, "id": "goal"})
    else:
        name = "/tf2_web_republisher"
        wire.send({"op": "subscribe", "topic": f"{name}/feedback"})
        goal_id = {"id": "goal"}
        wire.send(
            {"op": "publish", "topic": f"{name}/goal", "msg": {"goal": GOAL, "goal_id": goal_id}}
        )


def end(wire: Wire, form: str) -> None:
    if form == "service":
        wire.send({"op": "unsubscribe", "topic": "/tf_repub_0"})
        wire.wait(20_000)
    elif form == "action":
        wire.send({"op": "cancel_action_goal", "action": "/tf2_web_republisher", "id": "goal"})
    else:
        topic = "/tf2_web_republisher/cancel"
        wire.send({"op": "publish", "topic": topic, "msg": {"id": "goal"}})


@pytest.mark.parametrize("form", ["service", "action", "actionlib"])
def test_changed_transforms_are_sent_until_the_goal_is_cancelled(wire: Wire, form: str) -> None:
    assert not wire.protocol.topics.wanted("/tf")
    begin(wire, form)
    assert wire.protocol.topics.wanted("/tf")
    wire.wait(100)
    assert transforms_in(wire.received()) == []
    for x, expected in ((1.0, [1.0]), (1.05, []), (1.11, [1.11])):
        move(wire, x)
        wire.wait(100)
        assert transforms_in(wire.received()) == [("map", "base", x) for x in expected]
    assert wire.received(1) == []
    end(wire, form)
    wire.wait(1000)
    assert not wire.protocol.topics.wanted("/tf")


@pytest.mark.parametrize("form", ["service", "action", "actionlib"])
def test_goals_end_when_the_client_disconnects(wire: Wire, form: str) -> None:
    begin(wire, form)
    wire.protocol.disconnect(wire.clients[0], wire.now)
    assert not wire.protocol.topics.wanted("/tf")


def test_unused_republisher_topic_is_removed(wire: Wire) -> None:
    args = {**GOAL, "timeout": {"secs": 2}}
    wire.ask({"op": "call_service", "service": "/republish_tfs", "args": args})
    for _ in range(21):
        wire.wait(100)
    wire.wait(2000)
    assert not wire.protocol.topics.wanted("/tf")
    assert "/tf_repub_0" not in {topic.name for topic in wire.protocol.topics.all}


def test_republisher_topic_remains_while_others_subscribe(wire: Wire) -> None:
    begin(wire, "service")
    wire.send({"op": "subscribe", "topic": "/tf_repub_0"}, 1)
    wire.protocol.disconnect(wire.clients[0], wire.now)
    move(wire, 1.0)
    wire.wait(100)
    assert transforms_in(wire.received(1)) == [("map", "base", 1.0)]
    wire.protocol.disconnect(wire.clients[1], wire.now)
    wire.wait(200)
    assert not wire.protocol.topics.wanted("/tf")


def test_disconnected_clients_leave_no_topics_behind(
    wire: Wire,
) -> None:
    args = {**GOAL, "timeout": {"secs": 2**31 - 1}}
    call = json.dumps({"op": "call_service", "service": "/republish_tfs", "args": args})
    for _ in range(300):
        client = wire.protocol.connect(wire.now)
        wire.protocol.receive(client, call, wire.now)
        wire.protocol.disconnect(client, wire.now)
    assert not wire.protocol.topics.wanted("/tf")
    wire.wait(1000)
    assert not [topic.name for topic in wire.protocol.topics.all if "repub_" in topic.name]


def test_requests_and_frames_of_a_client_are_limited(wire: Wire) -> None:
    call = {"op": "call_service", "service": "/republish_tfs"}
    (answer,) = wire.ask({**call, "args": {**GOAL, "source_frames": ["x"] * 300}})
    assert answer["values"] == "a request may have at most 256 frames"
    for _ in range(17):
        wire.send({**call, "args": GOAL})
    assert [received["result"] for received in wire.received()] == [True] * 16 + [False]


# actionlib


def goal(identity: str, number: int = 13) -> Any:
    message = {"goal_id": {"id": identity}, "goal": {"goal": number}}
    return {"op": "publish", "topic": "/test/goal", "msg": message}


def requested(wire: Wire, client: int, frames: int, rate: float) -> bool:
    args = {"source_frames": [f"f{i}" for i in range(frames)], "target_frame": "map", "rate": rate}
    call = {"op": "call_service", "service": "/republish_tfs", "args": args}
    return bool(wire.ask(call, client)[-1]["result"])


def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    looked_up: list[str] = []
    monkeypatch.setattr(
        TransformTree, "find", lambda self, target, source: looked_up.append(source)
    )
    return looked_up


def test_transforms_computed_for_a_client_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire(2)
    serve_republisher(wire.protocol)
    results = [requested(wire, 0, 256, 50) for _ in range(16)]
    assert results[0]
    assert not results[-1]
    looked_up = counted(monkeypatch)
    for _ in range(500):
        wire.wait(10)
    assert 5 * 1000 < len(looked_up) <= 5 * 2100
    assert requested(wire, 1, 10, 10)
    looked_up.clear()
    for _ in range(100):
        wire.wait(10)
    assert looked_up.count("f5") >= 10 + 7  # the other client's rate is as requested


def test_clients_without_a_token_share_the_work_for_them(monkeypatch: pytest.MonkeyPatch) -> None:
    anonymous = Access("", Role.VIEW, DEFAULT_RULES[Role.VIEW])
    known = Access("wall", Role.VIEW, DEFAULT_RULES[Role.VIEW], b"key")
    gate = Authenticator(Credentials(anonymous=anonymous), lambda: 0.0)
    wire = Wire(8, authenticator=gate)
    serve_republisher(wire.protocol)
    results = [requested(wire, client, 200, 10) for client in range(8)]
    assert results == [True] * 2 + [False] * 6
    wire.clients.append(wire.protocol.connect(wire.now, "", known))
    assert requested(wire, 8, 200, 10)
    looked_up = counted(monkeypatch)
    for _ in range(100):
        wire.wait(10)
    assert len(looked_up) <= 6100


def cancel(**identity: Any) -> Any:
    return {"op": "publish", "topic": "/test/cancel", "msg": identity}


@pytest.fixture
def server() -> tuple[Wire, list[Any]]:
    wire = Wire(clients=2)
    goals: list[Any] = []

    def begin(goal: Any) -> None:
        goals.append(goal)
        goal.on_cancel(goal.canceled)

    serve_actionlib(wire.protocol, "/test", "actionlib/Test", begin)
    for end in ("status", "feedback", "result"):
        wire.send({"op": "subscribe", "topic": f"/test/{end}"})
    wire.received()
    return wire, goals


def statuses(received: list[Any]) -> dict[str, int]:
    """The last status of each goal."""
    found = {}
    for operation in received:
        if operation["topic"] == "/test/status":
            for status in operation["msg"]["status_list"]:
                found[status["goal_id"]["id"]] = status["status"]
    return found


def results(received: list[Any]) -> list[tuple[str, int, int]]:
    return [
        (
            h["msg"]["status"]["goal_id"]["id"],
            h["msg"]["status"]["status"],
            h["msg"]["result"]["result"],
        )
        for h in received
        if h["topic"] == "/test/result"
    ]


def test_goal_status_is_published_for_a_while_after_its_end(server: tuple[Wire, list[Any]]) -> None:
    wire, goals = server
    wire.send(goal("g"))
    wire.send(goal("g"))  # the same again is ignored
    assert len(goals) == 1
    assert statuses(wire.received()) == {"g": 1}
    goals[0].feedback({"feedback": 5})
    goals[0].succeed({"result": 13})
    goals[0].abort("too late")
    received = wire.received()
    assert results(received) == [("g", 3, 13)]
    assert [h["msg"]["feedback"]["feedback"] for h in received if "feedback" in h["topic"]] == [5]
    wire.wait(200)
    assert statuses(wire.received()) == {"g": 3}
    for _ in range(30):
        wire.wait(200)
    assert wire.received()[-1]["msg"]["status_list"] == []
    assert wire.protocol.timers.due is None


def test_goals_are_cancelled_by_id_or_all_of_one_client(server: tuple[Wire, list[Any]]) -> None:
    wire, goals = server
    for i, client in ((0, 0), (1, 0), (2, 1), (3, 0)):
        wire.send(goal(f"g{i}"), client)
        wire.wait(1000)
    wire.received()
    wire.send(cancel(id="g2"), 0)
    assert results(wire.received()) == [("g2", 2, 0)]
    wire.send(goal("g4"), 1)
    wire.send(cancel(stamp={"sec": 2}), 0)
    assert [r[0] for r in results(wire.received())] == ["g0", "g1"]
    wire.send(cancel(), 0)
    assert [r[0] for r in results(wire.received())] == ["g3"]
    wire.protocol.disconnect(wire.clients[1], wire.now)
    assert results(wire.received()) == [("g4", 2, 0)]
    assert not any(goal.active for goal in goals)


def test_number_of_goals_is_limited(server: tuple[Wire, list[Any]]) -> None:
    wire, goals = server
    for i in range(65):
        wire.send(goal(f"g{i}" if i % 2 else ""))  # without an id each is another
    assert len(goals) == 64
    assert wire.received()[-1]["msg"] == "publish: /test accepts at most 64 goals at a time"
