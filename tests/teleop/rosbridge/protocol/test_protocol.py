from __future__ import annotations

import json
from typing import Any

import pytest

from teleop.rosbridge.errors import MessageError, OperationError, ServiceError
from teleop.rosbridge.framing.outgoing_frames import CloseFrame, FrameKind
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_types import Message
from tests.teleop.rosbridge.support import CHATTER, SECOND, Wire, error, publish, subscribe

# Topics between clients


def test_topics_are_spelled_as_each_client_does() -> None:
    wire = Wire(clients=2)
    wire.send(subscribe("chatter"), 0)
    wire.send(subscribe("/chatter"), 1)
    wire.send(publish("x", "/chatter/"), 1)
    assert wire.received(0) == [publish("x", "chatter")]
    assert wire.received(1) == [publish("x", "/chatter")]


def test_published_messages_have_three_ascii_keys() -> None:
    wire = Wire()
    wire.send(subscribe())
    wire.send(publish("é"))
    (output,) = wire.outputs()
    assert output.payload == b'{"op":"publish","topic":"/chatter","msg":{"data":"\\u00e9"}}'
    assert (output.kind, output.binary) == (FrameKind.DATA, False)


def test_partial_messages_arrive_with_all_fields() -> None:
    wire = Wire()
    wire.send(subscribe("/t", "geometry_msgs/Twist"))
    wire.send({"op": "publish", "topic": "/t", "msg": {"linear": {"x": 1}}})
    wire.send({"op": "publish", "topic": "/t"})
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    partial, absent = (message["msg"] for message in wire.received())
    assert partial == {"linear": {**zero, "x": 1.0}, "angular": zero}
    assert absent == {"linear": zero, "angular": zero}


def test_unsubscribing_one_id_keeps_the_others() -> None:
    wire = Wire()
    wire.send(subscribe(id="a"))
    wire.send(subscribe(id="b"))
    wire.send({"op": "unsubscribe", "topic": "/chatter", "id": "a"})
    wire.send(publish("1"))
    wire.send({"op": "unsubscribe", "topic": "/chatter", "id": "b"})
    wire.send(subscribe("/other"))
    wire.send({"op": "advertise", **CHATTER})
    wire.send(publish("2"))
    assert wire.received() == [publish("1")]


@pytest.mark.parametrize("op", ["unsubscribe", "unadvertise"])
def test_unsubscribing_unknown_topics_is_not_an_error(op: str) -> None:
    wire = Wire()
    assert wire.ask({"op": op, "topic": "/nothing"}) == []


def test_unused_topics_are_removed_after_a_second() -> None:
    wire = Wire()
    wire.send({"op": "advertise", **CHATTER, "id": "a"})
    wire.send({"op": "advertise", **CHATTER, "id": "b"})
    wire.send({"op": "unadvertise", "topic": "/chatter", "id": "a"})
    assert [topic.name for topic in wire.protocol.topics.all] == ["/chatter"]
    wire.send({"op": "unadvertise", "topic": "/chatter"})
    assert wire.protocol.timers.due == wire.now + SECOND
    wire.wait(999)
    assert wire.ask(publish("late")) == []
    assert [topic.name for topic in wire.protocol.topics.all] == ["/chatter"]
    wire.wait(1)
    assert wire.protocol.topics.all == []
    assert wire.protocol.timers.due is None
    assert wire.ask(publish("too late"))[0]["level"] == "error"


def test_unused_topics_may_change_their_type_at_once() -> None:
    wire = Wire()
    wire.send({"op": "advertise", **CHATTER})
    wire.send({"op": "unadvertise", "topic": "/chatter"})
    assert wire.ask(subscribe("/chatter", "std_msgs/Int32")) == []
    assert [topic.kind.name for topic in wire.protocol.topics.all] == ["std_msgs/msg/Int32"]


def test_number_of_unused_topics_is_limited() -> None:
    wire = Wire(limits=ClientLimits.unhurried())
    for i in range(1000):
        wire.send({"op": "advertise", "topic": f"/t{i}", "type": "std_msgs/String"})
        wire.send({"op": "unadvertise", "topic": f"/t{i}"})
    assert len(wire.protocol.topics.all) == 256
    assert wire.protocol.topics.all[-1].name == "/t999"


# Throttling


def test_first_and_last_message_of_a_burst_arrive() -> None:
    wire = Wire()
    wire.send(subscribe(throttle_rate=100))
    for data in "1234":
        wire.send(publish(data))
        wire.wait(10)
    assert wire.received() == [publish("1")]
    assert wire.protocol.timers.due == SECOND + 100_000_000
    wire.wait(60)
    assert wire.received() == [publish("4")]
    wire.wait(1000)
    assert wire.received() == []
    assert wire.protocol.timers.due is None


def test_throttling_passes_one_message_per_period() -> None:
    wire = Wire()
    wire.send(subscribe(throttle_rate=100))
    for i in range(100):
        wire.send(publish(str(i)))
        wire.wait(10)
    assert len(wire.received()) in (10, 11)


def test_shortest_throttle_time_of_several_subscriptions_is_used() -> None:
    wire = Wire()
    wire.send(subscribe(throttle_rate=1000, id="slow"))
    wire.send(subscribe(throttle_rate=0, id="fast"))
    for data in "12":
        wire.send(publish(data))
    assert wire.received() == [publish("1"), publish("2")]
    wire.send({"op": "unsubscribe", "topic": "/chatter", "id": "fast"})
    wire.send(publish("3"))
    assert wire.received() == []
    wire.wait(1000)
    assert wire.received() == [publish("3")]


def test_message_that_is_held_back_comes_sooner_for_a_subscription_that_waits_less() -> None:
    wire = Wire()
    wire.send(subscribe(throttle_rate=1000, id="slow"))
    for data in "12":
        wire.send(publish(data))
    assert wire.received() == [publish("1")]
    wire.send(subscribe(throttle_rate=100, id="fast"))
    wire.wait(100)
    assert wire.received() == [publish("2")]


@pytest.mark.parametrize("rate", [100, 100.0, None, 0, -5, 1e300])
def test_throttle_rate_may_be_any_number_or_null(rate: object) -> None:
    assert Wire().ask(subscribe(throttle_rate=rate, queue_length=rate)) == []


def test_encoding_options_belong_to_the_subscription() -> None:
    wire = Wire()
    wire.send(subscribe())
    settings = {"fragment_size": 10, "png": True, "message_intervall": 1e6, "compression": "cbor"}
    wire.send({**publish("x" * 100), **settings})
    wire.send(publish("y" * 100))
    outputs = wire.outputs()
    assert [(output.binary, len(list(output.frames))) for output in outputs] == [(False, 1)] * 2


def test_queue_length_is_passed_to_the_send_queue() -> None:
    wire = Wire()
    wire.send(subscribe(queue_length=5, id="a"))
    wire.send(subscribe(queue_length=2, id="b"))
    wire.send(publish("x"))
    assert [output.depth for output in wire.outputs()] == [2]


# Encodings


@pytest.mark.parametrize("compression", ["none", "zip", "PNG", None, 3])
def test_unknown_compressions_are_json(compression: object) -> None:
    wire = Wire()
    assert wire.ask(subscribe(compression=compression)) == []
    wire.send(publish("x"))
    assert [output.binary for output in wire.outputs()] == [False]


# Topics of the host


def test_host_messages_are_built_only_with_subscribers() -> None:
    wire = Wire()
    wire.protocol.topics.advertise("/odom", "std_msgs/String")
    built: list[int] = []

    def build() -> Message:
        built.append(1)
        return {"data": "x"}

    wire.protocol.topics.publish("/odom", build, wire.now)
    assert (built, wire.protocol.topics.wanted("/odom")) == ([], False)
    wire.send(subscribe("/odom"))
    wire.protocol.topics.publish("/odom", build, wire.now)
    assert (built, wire.protocol.topics.wanted("/odom")) == ([1], True)
    assert wire.received() == [publish("x", "/odom")]


def test_clients_cannot_publish_on_host_topics() -> None:
    wire = Wire()
    wire.protocol.topics.advertise("/odom", "nav_msgs/Odometry")
    text = "topic /odom is published by the server only"
    received = wire.ask(
        {"op": "advertise", "topic": "/odom", "type": "nav_msgs/Odometry", "id": "i"}
    )
    assert received == [error(f"advertise: {text}", "i")]
    assert wire.ask({"op": "publish", "topic": "/odom", "msg": {}}) == [error(f"publish: {text}")]


def test_host_must_advertise_before_publishing() -> None:
    wire = Wire()
    with pytest.raises(OperationError, match="/odom"):
        wire.protocol.topics.publish("/odom", {}, wire.now)


def test_host_messages_with_nan_raise_an_error() -> None:
    wire = Wire()
    wire.protocol.topics.advertise("/x", "std_msgs/Float64")
    wire.send(subscribe("/x", "std_msgs/Float64"))
    with pytest.raises(MessageError, match="nan"):
        wire.protocol.topics.publish("/x", {"data": float("nan")}, wire.now)


def test_host_handlers_receive_completed_messages_and_time() -> None:
    wire = Wire(clients=2)
    received: list[Any] = []
    wire.protocol.topics.subscribe("/joy", "sensor_msgs/joy", lambda *call: received.append(call))
    wire.send({"op": "publish", "topic": "/joy", "msg": {"buttons": [1], "header": {}}}, 1)
    ((client, message, now),) = received
    assert (client, now) == (wire.clients[1], wire.now)
    assert message["buttons"].tolist() == [1]
    assert message["axes"].tolist() == []
    assert message["header"]["stamp"] == {"sec": 1, "nanosec": 0}


def test_messages_rejected_by_the_host_are_not_delivered() -> None:
    wire = Wire()

    def refuse(client: int, message: Message, now: int) -> None:
        raise MessageError("a hint must be in frame map")

    wire.protocol.topics.subscribe("/chatter", "std_msgs/String", refuse)
    wire.send(subscribe())
    assert wire.ask(publish("x")) == [error("publish: a hint must be in frame map")]


def test_host_exceptions_are_logged_and_disconnect_no_client(
    caplog: pytest.LogCaptureFixture,
) -> None:
    wire = Wire()

    def fail(client: int, message: Message, now: int) -> None:
        raise ZeroDivisionError

    wire.protocol.topics.subscribe("/chatter", "std_msgs/String", fail)
    assert wire.ask(publish("x")) == [error("publish: internal error")]
    assert "ZeroDivisionError" in caplog.text


# Services


def double(client: int, request: Message, now: int) -> Message:
    if not request["data"]:
        raise ServiceError("no")
    return {"success": True, "message": "twice"}


def call(**more: Any) -> Message:
    return {"op": "call_service", "service": "/double", **more}


@pytest.mark.parametrize("args", [{"data": True}, [True]])
def test_service_arguments_may_be_named_or_positional(args: object) -> None:
    wire = Wire()
    wire.protocol.services.serve("/double", "std_srvs/SetBool", double)
    assert wire.ask(call(args=args, id="call:1")) == [
        {
            "op": "service_response",
            "service": "/double",
            "values": {"success": True, "message": "twice"},
            "result": True,
            "id": "call:1",
        }
    ]


@pytest.mark.parametrize("given", [{"id": identity} for identity in ("x", 0, 7, "", "é")] + [{}])
def test_responses_have_the_id_of_the_call_and_none_without(given: Message) -> None:
    wire = Wire()
    wire.protocol.services.serve("/double", "std_srvs/SetBool", double)
    (answer,) = wire.ask(call(args={"data": True}, **given))
    assert {key: answer[key] for key in answer.keys() & {"id"}} == given


@pytest.mark.parametrize(
    ("args", "text"),
    [
        ({"data": False}, "no"),
        (None, "no"),
        ({"data": 1}, "requires a bool for field data"),
        ({"datum": True}, "does not have a field datum"),
        ([True, True], "takes 1 arguments, got 2"),
        ("data", "got a <class 'str'>"),
    ],
)
def test_service_errors_are_sent_to_the_caller(args: object, text: str) -> None:
    wire = Wire()
    wire.protocol.services.serve("/double", "std_srvs/SetBool", double)
    (answer,) = wire.ask(call(args=args, id="i"))
    assert (answer["op"], answer["result"], answer["id"]) == ("service_response", False, "i")
    assert text in answer["values"]


def test_failing_services_are_answered_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    wire = Wire()

    def fail(client: int, request: Message, now: int) -> Message:
        raise KeyError("x")

    wire.protocol.services.serve("/double", "std_srvs/SetBool", fail)
    (answer,) = wire.ask(call(args={"data": True}))
    assert (answer["result"], answer["values"]) == (False, "Service /double failed: internal error")
    assert "KeyError" in caplog.text


@pytest.mark.parametrize("response", [{"wrong": 1}, {"message": 1}, None])
def test_invalid_host_responses_are_answered(response: Any) -> None:
    wire = Wire()
    wire.protocol.services.serve("/double", "std_srvs/SetBool", lambda *_: response)
    (answer,) = wire.ask(call(args={"data": True}))
    assert answer["result"] is False


def test_deferred_responses_follow_earlier_messages() -> None:
    wire = Wire(clients=2)
    later = DeferredResponse()
    wire.protocol.topics.advertise("/clock", "rosgraph_msgs/Clock")
    wire.protocol.services.serve("/sim/step", "farsteer_msgs/Step", lambda *_: later)
    wire.protocol.connections.set_lossless(wire.clients[0])
    wire.send(subscribe("/clock", "rosgraph_msgs/Clock"))
    wire.send({"op": "call_service", "service": "/sim/step", "args": {"ticks": 3}, "id": "s"})
    assert wire.received() == []
    for second in range(3):
        wire.protocol.topics.publish("/clock", {"clock": {"sec": second}}, wire.now)
    later.complete({"success": True})
    later.complete({"success": False})
    outputs = wire.outputs()
    assert [output.lossless for output in outputs] == [True] * 4
    ops = [json.loads(output.text)["op"] for output in outputs]
    assert ops == ["publish"] * 3 + ["service_response"]
    assert later.done


def test_deferred_responses_may_fail_or_be_immediate() -> None:
    wire = Wire()
    later = DeferredResponse()
    later.fail("somebody else steps")
    wire.protocol.services.serve("/sim/step", "farsteer_msgs/Step", lambda *_: later)
    (answer,) = wire.ask({"op": "call_service", "service": "/sim/step"})
    assert (answer["result"], answer["values"]) == (False, "somebody else steps")


def test_deferred_responses_to_disconnected_clients_are_dropped() -> None:
    wire = Wire()
    later = DeferredResponse()
    wire.protocol.services.serve("/sim/step", "farsteer_msgs/Step", lambda *_: later)
    wire.send({"op": "call_service", "service": "/sim/step"})
    wire.protocol.disconnect(wire.clients[0], wire.now)
    wire.send({"op": "nonsense"})  # what comes behind the end is not processed
    later.complete({})
    assert wire.protocol.connections.drain() == []


# Status


def test_errors_are_sent_unless_level_none_is_set() -> None:
    wire = Wire()
    (status,) = wire.ask({"op": "nonsense", "id": "x"})
    assert (status["op"], status["level"], status["id"]) == ("status", "error", "x")
    assert wire.ask({"op": "set_level", "level": "none"}) == []
    assert wire.ask({"op": "nonsense"}) == []


def test_auth_without_authenticator_is_a_warning() -> None:
    wire = Wire()
    auth = {"op": "auth", "mac": "0f", "client": "c", "dest": "d", "rand": "r", "t": 0, "end": 0}
    assert wire.ask({**auth, "level": "admin"}) == []
    wire.send({"op": "set_level", "level": "warning"})
    (status,) = wire.ask({**auth, "level": "admin", "id": "a"})
    assert status["msg"] == "auth: authentication is not enabled on this server"
    wire.send(subscribe())
    assert wire.ask(publish("x")) == [publish("x")]


def test_warnings_are_sent_only_on_request() -> None:
    wire = Wire()
    wire.protocol.connections.send_status(wire.clients[0], "warning", "somebody else drives")
    assert wire.received() == []
    wire.send({"op": "set_level", "level": "warning"})
    wire.protocol.connections.send_status(wire.clients[0], "warning", "somebody else drives")
    wire.protocol.connections.send_status(wire.clients[0], "info", "all is well")
    assert wire.received() == [{"op": "status", "level": "warning", "msg": "somebody else drives"}]


# Limits


@pytest.mark.parametrize(
    ("limits", "operation", "rate"),
    [
        ({"messages": 10}, publish("x"), "10 operations/s"),
        ({"bytes": 1000}, publish("x" * 100), "1000 bytes/s"),
        ({"parts": 30}, {"op": "publish", "topic": "/twist", "msg": {}}, "30 nested messages/s"),
    ],
)
def test_clients_over_a_rate_are_warned_once_and_then_disconnected(
    limits: Any, operation: Message, rate: str
) -> None:
    wire = Wire(limits=ClientLimits(**limits, burst=1))
    wire.protocol.topics.subscribe("/chatter", "std_msgs/String", lambda *_: None)
    wire.protocol.topics.subscribe("/twist", "geometry_msgs/TwistStamped", lambda *_: None)
    for _ in range(40):
        wire.send(operation)
    text = f"rate limit of {rate} exceeded"
    assert wire.received() == [error(f"{text}: operation dropped"), CloseFrame(1008, text)]
    wire.wait(5000)
    assert wire.ask(operation) == []


def test_topics_and_ids_are_limited() -> None:
    wire = Wire(clients=2, limits=ClientLimits(subscriptions=2, advertisements=2))
    for op in ("subscribe", "advertise"):
        for name in "abc":
            wire.send({"op": op, "topic": name, "type": "std_msgs/String", "id": "1"})
        assert [status["level"] for status in wire.received()] == ["error"]
        for identity in "23":
            wire.send({"op": op, "topic": "a", "type": "std_msgs/String", "id": identity})
        (status,) = wire.received()
        assert "too many ids" in status["msg"]
        assert wire.ask({"op": op, "topic": "c", "type": "std_msgs/String"}, 1) == []
