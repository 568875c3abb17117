"""Fragmented messages, received and sent."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from teleop.rosbridge.framing.fragments import split_message
from teleop.rosbridge.limits import ClientLimits
from tests.teleop.rosbridge.server.test_server import IMAGE, client, say, serving
from tests.teleop.rosbridge.support import SECOND, Wire, error, publish, subscribe


def pieces(wire: Wire, client: int = 0) -> list[Any]:
    return [json.loads(f) for output in wire.outputs(client) for f in output.frames]


@pytest.mark.parametrize("size", [1, 100, 512, 700, 4000])
def test_large_messages_are_sent_in_fragments_on_request(size: int) -> None:
    wire = Wire()
    wire.send(subscribe(fragment_size=size))
    wire.send(publish('"é\n' * 400))  # 4 kB
    received = pieces(wire)
    assert {f["op"] for f in received} == {"fragment"}
    assert {f["id"] for f in received} == {"fragment:1"}
    assert [f["num"] for f in received] == list(range(len(received)))
    assert {f["total"] for f in received} == {len(received)}
    assert all(type(f["total"]) is int for f in received)
    assert all(len(f["data"]) == max(size, 512) for f in received[:-1])
    assert json.loads("".join(f["data"] for f in received)) == publish('"é\n' * 400)


@pytest.mark.parametrize("size", [None, 0, 2**31 - 1, 2**31, 1e12, 100_000])
def test_messages_are_not_fragmented_without_request(size: object) -> None:
    wire = Wire()
    wire.send(subscribe(fragment_size=size))
    wire.send(publish("x" * 1000))
    assert pieces(wire) == [publish("x" * 1000)]


def test_binary_messages_are_never_fragmented() -> None:
    wire = Wire()
    wire.send(subscribe(fragment_size=10, compression="cbor"))
    wire.send(publish("x" * 1000))
    (output,) = wire.outputs()
    assert list(output.frames) == [output.payload]


def test_fragmented_messages_have_unique_ids_and_the_smallest_size() -> None:
    wire = Wire(clients=2)
    wire.send(subscribe(fragment_size=5000, id="a"))
    wire.send(subscribe(fragment_size=600, id="b"))
    wire.send(subscribe(), 1)
    for _ in range(2):
        wire.send(publish("x" * 1500))
    received = pieces(wire)
    assert [f["id"] for f in received] == ["fragment:1"] * 3 + ["fragment:2"] * 3
    assert pieces(wire, 1) == [publish("x" * 1500)] * 2


def test_responses_are_fragmented_on_request() -> None:
    wire = Wire()
    wire.send({"op": "call_service", "service": "/no" * 300, "fragment_size": 20, "id": 1})
    received = pieces(wire)
    assert len(received) == 4
    whole = json.loads("".join(f["data"] for f in received))
    assert (whole["op"], whole["id"]) == ("service_response", 1)


@given(st.binary(min_size=1, max_size=5000).map(bytes.hex), st.integers(1, 3000))
def test_fragments_join_to_the_message_and_are_limited_in_number(text: str, size: int) -> None:
    parts = [json.loads(part) for part in split_message(text.encode(), size, "i")]
    assert "".join(part["data"] for part in parts) == text
    assert len(parts) == parts[0]["total"] <= 1024


def test_writer_lets_others_run_between_fragments() -> None:
    async def run() -> None:
        async with serving() as server, client(server) as a:
            await say(a, {**IMAGE, "fragment_size": 512})
            sent = turns = 0

            async def take(piece: object, text: bool) -> None:
                nonlocal sent
                sent += 1

            server._writers[1].socket.send = take  # type: ignore[method-assign, assignment]
            server.protocol.topics.publish("/cloud", {"data": bytes(60_000)}, server.now)
            flushing = asyncio.create_task(server.flush(1))
            while not flushing.done():
                await asyncio.sleep(0)
                turns += 1
            assert sent > 100
            assert turns >= sent

    asyncio.run(run())


def fragments(operation: object, count: int, identity: object = "f") -> list[dict[str, Any]]:
    text = json.dumps(operation)
    size = -(-len(text) // count)
    return [
        {
            "op": "fragment",
            "id": identity,
            "num": i,
            "total": count,
            "data": text[i * size : (i + 1) * size],
        }
        for i in range(count)
    ]


CALL = {"op": "call_service", "service": "/nope", "id": "c", "args": {"text": "é" * 50}}


@settings(max_examples=30)
@given(st.permutations(range(7)), st.permutations(range(7)))
def test_received_fragments_are_joined_in_any_order(first: list[int], second: list[int]) -> None:
    wire = Wire(clients=2)
    one, two = fragments(CALL, 7, "one"), fragments({**CALL, "id": "d"}, 7, 2)
    for i, j in zip(first, second, strict=True):
        wire.send(one[i])
        wire.send(one[i])  # repeated, as after a stall
        wire.send(two[j])
        if i:  # another client's are apart
            wire.send(one[i], 1)
    assert wire.received(1) == []
    assert sorted(answer["id"] for answer in wire.received() if answer["op"] != "status") == [
        "c",
        "d",
    ]


def test_incomplete_messages_expire_after_ten_seconds() -> None:
    wire = Wire()
    wire.send(fragments(CALL, 2)[0])
    assert wire.protocol.timers.due == wire.now + 10 * SECOND
    wire.wait(10_000)
    text = "fragment: message incomplete after 10 s"
    assert wire.received() == [error(text, "f")]
    assert wire.ask(fragments(CALL, 2)[1]) == []
    assert wire.protocol.timers.due == wire.now + 10 * SECOND


def test_fragments_are_discarded_on_disconnect() -> None:
    wire = Wire()
    (connection,) = wire.protocol.connections
    wire.send(fragments(publish("x" * 1000), 2)[0])
    assert "f" in connection.reassembly
    wire.protocol.disconnect(wire.clients[0], wire.now)
    assert "f" not in connection.reassembly  # though a timer still refers to the connection
    wire.wait(10_000)
    assert wire.protocol.connections.drain() == []


def test_incomplete_messages_are_limited_in_bytes_and_number() -> None:
    wire = Wire(limits=ClientLimits(assembly=100))
    piece = {"op": "fragment", "id": "f", "num": 0, "total": 3, "data": "x" * 60}
    wire.send(piece)
    (status,) = wire.ask({**piece, "num": 1})
    assert "exceed 100 bytes" in status["msg"]
    for i in range(8):
        assert wire.ask({**piece, "id": i, "data": "x"}) == []
    (status,) = wire.ask({**piece, "id": 8, "data": "x"})
    assert "at most 8 messages may be incomplete" in status["msg"]
    (status,) = wire.ask({**piece, "id": 7, "num": 1, "total": 4})
    assert "total was 3 before, got 4" in status["msg"]


def test_fragmented_operations_count_for_the_rate() -> None:
    wire = Wire(limits=ClientLimits(messages=10, burst=1))
    calls = '{"op":"call_service","service":"/nope"}' * 15
    wire.send({"op": "fragment", "num": 0, "total": 1, "data": calls, "id": 1})
    received = wire.received()
    assert [h["op"] for h in received] == ["service_response"] * 10 + ["status"]
    assert received[-1] == error("rate limit of 10 operations/s exceeded: operation dropped")


@pytest.mark.parametrize("inner", [fragments(CALL, 1)[0], [1], "x"])
def test_reassembled_message_must_be_an_operation(inner: object) -> None:
    wire = Wire()
    for part in fragments(inner, 3 if isinstance(inner, dict) else 1):
        wire.send(part)
    (status,) = wire.received()
    assert status["level"] == "error"
