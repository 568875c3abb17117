"""Clients within their limits of bytes that cause much work: it is counted, and bounded."""

from __future__ import annotations

import json

import pytest

from teleop.rosbridge import (
    DEFAULT_RULES,
    Access,
    Authenticator,
    ClientLimits,
    Credentials,
    Role,
    TokenBucket,
    serve_standard,
)
from teleop.rosbridge.auth.permissions import UNGUARDED
from teleop.rosbridge.framing.outgoing_frames import CloseFrame
from teleop.rosbridge.protocol.address_memory import AddressMemory
from teleop.rosbridge.protocol.protocol import Protocol
from tests.teleop.rosbridge.support import MILLISECOND, REGISTRY, SECOND, Wire

POSES = {"topic": "/poses", "type": "geometry_msgs/PoseArray"}
TEXT = {"topic": "/t", "type": "std_msgs/String"}


def poses(one: object, count: int) -> str:
    return json.dumps({"op": "publish", "topic": "/poses", "msg": {"poses": [one] * count}})


def flood(wire: Wire, frame: str, rate: float, seconds: float) -> float | None:
    """Send a frame at a rate [1/s]; return after how long the client is disconnected [s]."""
    for number in range(int(rate * seconds)):
        wire.wait(1000 / rate)
        wire.raw(frame)
        if any(isinstance(output, CloseFrame) for output in wire.outputs()):
            return (number + 1) / rate
    return None


# Rates, on a clock that moves


@pytest.mark.parametrize("rate", [200, 210])
def test_client_at_its_rate_is_never_disconnected(rate: float) -> None:
    wire = Wire()
    assert flood(wire, '{"op":"status"}', rate, 60) is None


@pytest.mark.parametrize(("rate", "most"), [(400, 6.0), (2000, 0.5), (10_000, 0.1), (20_000, 0.05)])
def test_client_at_twice_its_rate_and_more_is_disconnected(rate: float, most: float) -> None:
    wire = Wire()
    lasted = flood(wire, '{"op":"status"}', rate, 10)
    assert lasted is not None
    assert lasted <= most


def test_client_that_sends_twice_its_bytes_is_disconnected() -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **TEXT})
    frame = json.dumps({"op": "publish", "topic": "/t", "msg": {"data": "x" * 400_000}})
    assert flood(wire, frame, 4, 20) is None
    lasted = flood(wire, frame, 10, 10)
    assert lasted is not None
    assert lasted < 10


def test_excess_is_reported_once_a_second() -> None:
    wire = Wire()
    reports = 0
    for number in range(660):  # 220 a second
        wire.wait(1000 / 220)
        wire.send({"op": "status"})
        reports += sum("rate limit" in str(said) for said in wire.received())
        assert number > 400 or not reports or number > 200
    assert reports <= 3


# Work


def test_omitted_messages_count_for_the_rate_of_who_omits_them() -> None:
    wire = Wire()
    wire.send({"op": "subscribe", **POSES}, 0)
    wire.outputs()
    taken = 0
    for _ in range(1900):  # 10 s of the attack: 3 kB each
        wire.wait(1000 / 190)
        wire.raw(poses({}, 990))
        taken += sum(getattr(output, "topic", None) == "/poses" for output in wire.outputs())
    parts = 990 * 3  # each pose with its position and orientation
    assert taken * parts <= 12 * ClientLimits().parts + parts


def test_large_legal_messages_are_taken_as_often_as_their_parts_allow() -> None:
    wire = Wire(limits=ClientLimits(parts=3000))
    wire.send({"op": "advertise", **POSES})
    frame = poses({"position": {"x": 1.5}, "orientation": {"w": 1.0}}, 1000)
    for _ in range(3):
        wire.raw(frame)
        wire.wait(1100)
    assert wire.received() == []


def test_latched_messages_of_a_client_occupy_bounded_memory() -> None:
    wire = Wire(2, limits=ClientLimits(parts=1e9, latched=1_000_000))
    refused = 0
    for number in range(64):
        topic = {"topic": f"/p{number}", "type": "geometry_msgs/PoseArray"}
        wire.send({"op": "advertise", **topic, "latch": True})
        wire.send({"op": "publish", "topic": topic["topic"], "msg": {"poses": [{}] * 200}})
        refused += sum("is not latched" in said["msg"] for said in wire.received())
    kept = [topic for topic in wire.protocol.topics.all if topic.latched]
    assert 1 <= len(kept) <= 10
    assert refused == 64 - len(kept)
    # Each new message of a topic takes the place of its last.
    for _ in range(3):
        name = kept[0].name
        assert wire.ask({"op": "publish", "topic": name, "msg": {"poses": [{}] * 200}}) == []
    # Others have room of their own.
    wire.send({"op": "advertise", **POSES, "latch": True}, 1)
    wire.raw(poses({}, 200), 1)
    assert wire.received(1) == []


def test_message_too_large_to_be_latched_is_delivered_and_replaces_the_latched_one() -> None:
    wire = Wire(limits=ClientLimits(latched=1000))
    wire.send({"op": "subscribe", **TEXT})
    wire.send({"op": "advertise", **TEXT, "latch": True})
    for text in ("small", "x" * 2000):
        wire.send({"op": "publish", "topic": "/t", "msg": {"data": text}})
    *messages, status = wire.received()
    assert [len(message["msg"]["data"]) for message in messages] == [5, 2000]
    assert "the message is not latched" in status["msg"]
    topic = wire.protocol.topics.find("/t")
    assert topic is not None
    assert topic.latched == {}


def test_parameters_are_bounded_together() -> None:
    wire = Wire()
    serve_standard(wire.protocol)
    answers = []
    for number in range(10):
        wire.wait(1000)
        value = json.dumps("x" * 60_000)
        args = {"name": f"/p{number}", "value": value}
        answers += wire.ask({"op": "call_service", "service": "/rosapi/set_param", "args": args})
    assert [answer["result"] for answer in answers] == [True] * 4 + [False] * 6
    assert "together" in answers[-1]["values"]
    args = {"name": "/p0", "value": "1"}
    wire.send({"op": "call_service", "service": "/rosapi/set_param", "args": args})
    args = {"name": "/p9", "value": value}
    (answer,) = wire.ask({"op": "call_service", "service": "/rosapi/set_param", "args": args})[-1:]
    assert answer["result"] is True


def test_answers_count_for_the_bytes_of_who_calls() -> None:
    wire = Wire()
    serve_standard(wire.protocol)
    for number in range(4):
        args = {"name": f"/p{number}", "value": json.dumps("x" * 60_000)}
        wire.send({"op": "call_service", "service": "/rosapi/set_param", "args": args})
    wire.received()
    size = 0
    for _ in range(1000):  # 10 s
        wire.wait(10)
        wire.send({"op": "call_service", "service": "/rosapi/get_param", "args": {"name": "/"}})
        size += sum(len(getattr(output, "payload", b"")) for output in wire.outputs())
    assert size <= 13 * ClientLimits().bytes


# Memory of addresses


def test_reconnecting_does_not_refill_the_rates() -> None:
    protocol = Protocol(REGISTRY)
    now, admitted = SECOND, 0
    for _ in range(20):  # of 350 operations each, in a second altogether
        client = protocol.connect(now, "10.0.0.6:1")
        for _ in range(350):
            protocol.receive(client, '{"op":"dance"}', now)
        said = [output for _, output in protocol.connections.drain()]
        admitted += sum(b"Unknown operation" in getattr(o, "payload", b"") for o in said)
        protocol.disconnect(client, now)
        now += 50 * MILLISECOND
    assert admitted <= 400 + 200 + 19 * 40


def test_floods_of_an_address_cost_others_there_the_burst_only() -> None:
    known = Access("driver", Role.OPERATE, DEFAULT_RULES[Role.OPERATE], b"key")
    gate = Authenticator(Credentials(anonymous=UNGUARDED), lambda: 0.0)
    protocol = Protocol(REGISTRY, authenticator=gate)
    for number in range(20):
        flooder = protocol.connect(SECOND, f"10.0.0.6:{number}")
        for _ in range(2000):
            protocol.receive(flooder, '{"op":"status"}', SECOND)
        protocol.disconnect(flooder, SECOND)
    protocol.connections.drain()
    honest = protocol.connect(SECOND, "10.0.0.6:99")
    driver = protocol.connect(SECOND, "10.0.0.6:100", known)
    for client, count in ((honest, 35), (driver, 400)):
        for _ in range(count):
            protocol.receive(client, '{"op":"status"}', SECOND)
    assert protocol.connections.drain() == []


def test_other_addresses_and_time_are_not_charged() -> None:
    protocol = Protocol(REGISTRY)
    first = protocol.connect(SECOND, "10.0.0.6:1")
    for _ in range(400):
        protocol.receive(first, '{"op":"status"}', SECOND)
    protocol.disconnect(first, SECOND)
    for address, now in (("10.0.0.7:1", SECOND), ("10.0.0.6:2", 3 * SECOND), ("", SECOND)):
        client = protocol.connect(now, address)
        for _ in range(400):
            protocol.receive(client, '{"op":"status"}', now)
        assert protocol.connections.drain() == []
        protocol.disconnect(client, now)


def test_debts_of_addresses_are_paid_once_and_bounded() -> None:
    memory = AddressMemory()
    spent = TokenBucket(10, 2, 0)
    spent.spend(50, 0)
    memory.store("a", {"x": spent}, 0)
    levels = []
    for _ in range(4):
        fresh = TokenBucket(10, 2, 0)
        memory.restore("a", {"x": fresh}, 0)
        levels.append(fresh.missing(0))
    assert levels == [20, 20, 10, 0]
    for number in range(5000):
        memory.store(f"a{number}", {"x": spent}, 0)
    assert len(memory._addresses) == 1024
