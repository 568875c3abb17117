"""The cases of rosbridge_suite's own websocket tests, on sockets.

Its files are ``rosbridge_server/test/websocket/*.test.py``; each test has the name of its file.
"""

from __future__ import annotations

import asyncio
import json
from typing import Any

import cbor2
import pytest

from teleop.rosbridge.graph.goals import Goal
from tests.teleop.rosbridge.server.test_server import (
    CLOUD,
    client,
    in_a_loop,
    receive,
    say,
    serving,
    until,
)

TOPIC = {"topic": "/a_topic", "type": "std_msgs/String"}
SERVICE = {"op": "advertise_service", "service": "/test_service", "type": "std_srvs/SetBool"}
CALL = {"op": "call_service", "service": "/test_service", "type": "std_srvs/SetBool"}


async def send(connection: Any, *operations: Any) -> None:
    for operation in operations:
        await connection.send(json.dumps(operation))


@in_a_loop
async def test_smoke_ten_messages_in_each_direction() -> None:
    async with serving() as server, client(server) as one, client(server) as two:
        for connection, topic in ((one, "/a"), (two, "/b")):
            await say(
                connection,
                {"op": "subscribe", "topic": topic, "type": "std_msgs/String", "queue_length": 0},
            )
        for i in range(10):
            await send(one, {"op": "publish", "topic": "/b", "msg": {"data": f"hello {i}"}})
            await send(two, {"op": "publish", "topic": "/a", "msg": {"data": f"hello {i}"}})
        for connection, topic in ((one, "/a"), (two, "/b")):
            received = [await receive(connection) for _ in range(10)]
            assert received == [
                {"op": "publish", "topic": topic, "msg": {"data": f"hello {i}"}} for i in range(10)
            ]


@in_a_loop
async def test_call_service_response_matches_exactly() -> None:
    async with serving() as server, client(server) as connection:
        server.protocol.services.serve(
            "/test_service", "std_srvs/SetBool", lambda c, request, now: {"success": True}
        )
        await send(connection, {**CALL, "args": {"data": True}})
        assert await receive(connection) == {
            "op": "service_response",
            "service": "/test_service",
            "values": {"success": True, "message": ""},
            "result": True,
        }


@in_a_loop
async def test_advertise_service_two_calls_at_once_are_answered_in_order() -> None:
    async with serving() as server, client(server) as provider, client(server) as caller:
        await say(provider, SERVICE)
        for i, data in enumerate((True, False)):
            await send(caller, {**CALL, "args": {"data": data}, "id": i})
        asked = [await receive(provider), await receive(provider)]
        assert asked == [
            {
                "op": "call_service",
                "service": "/test_service",
                "id": f"service_request:/test_service:{i + 1}",
                "args": {"data": data},
            }
            for i, data in enumerate((True, False))
        ]
        for i, request in enumerate(asked):
            await send(
                provider,
                {
                    "op": "service_response",
                    "service": "/test_service",
                    "values": {"success": bool(i), "message": f"Hello world {i}"},
                    "id": request["id"],
                    "result": True,
                },
            )
        answers = [await receive(caller), await receive(caller)]
        assert [(a["id"], a["values"]["message"]) for a in answers] == [
            (0, "Hello world 0"),
            (1, "Hello world 1"),
        ]


@in_a_loop
async def test_advertise_service_duplicate_another_takes_over_when_the_first_closes() -> None:
    async with serving() as server, client(server) as caller:
        async with client(server) as first:
            await say(first, SERVICE)
            await send(caller, {**CALL, "args": {"data": True}, "id": "x"})
            assert (await receive(first))["id"] == "service_request:/test_service:1"
        assert (await receive(caller))["values"] == "Service /test_service: its provider has left"
        async with client(server) as second:
            await say(second, SERVICE)
            await send(caller, {**CALL, "args": {"data": False}, "id": "y"})
            assert await receive(second) == {
                "op": "call_service",
                "id": "service_request:/test_service:1",
                "service": "/test_service",
                "args": {"data": False},
            }


@pytest.mark.parametrize("compression", ["none", "cbor-raw"])
@in_a_loop
async def test_multiple_subscribers_receive_identical_messages(compression: str) -> None:
    async with serving() as server, client(server) as one, client(server) as two:
        for connection in (one, two):
            await say(connection, {"op": "subscribe", **TOPIC, "compression": compression})
        await send(one, {"op": "publish", "topic": "/a_topic", "msg": {"data": "hello"}})
        frames = [await one.recv(), await two.recv()]
        assert frames[0] == frames[1]
        if compression == "none":
            expected: Any = {"op": "publish", "topic": "/a_topic", "msg": {"data": "hello"}}
            assert json.loads(frames[0]) == expected
        else:
            content = cbor2.loads(frames[0])["msg"]  # type: ignore[arg-type]
            assert content["bytes"] == b"\x00\x01\x00\x00\x06\x00\x00\x00hello\x00"
            assert content.keys() == {"secs", "nsecs", "bytes"}


@in_a_loop
async def test_transient_local_publisher_reaches_late_subscribers() -> None:
    async with serving() as server, client(server) as publisher:
        qos = {"durability": "transient_local", "reliability": "reliable", "depth": 1}
        await say(publisher, {"op": "advertise", **TOPIC, "qos": qos})
        for data in ("early", "last"):
            await say(publisher, {"op": "publish", "topic": "/a_topic", "msg": {"data": data}})
        async with client(server) as late:
            await send(late, {"op": "subscribe", **TOPIC})
            assert (await receive(late))["msg"] == {"data": "last"}


@in_a_loop
async def test_best_effort_subscriber_receives_messages() -> None:
    async with serving() as server, client(server) as connection:
        qos = {"reliability": "best_effort", "history": "keep_last", "depth": 10}
        await say(connection, {"op": "subscribe", **TOPIC, "qos": qos})
        await send(connection, {"op": "publish", "topic": "/a_topic", "msg": {"data": "x"}})
        assert (await receive(connection))["msg"] == {"data": "x"}


@in_a_loop
async def test_send_action_goal_has_feedback_and_result() -> None:
    def count(goal: Goal) -> None:
        sequence = [0, 1]
        for i in range(1, goal.request["order"]):
            sequence.append(sequence[i] + sequence[i - 1])
            goal.feedback({"sequence": sequence})
        goal.succeed({"sequence": sequence})

    async with serving() as server, client(server) as connection:
        server.protocol.actions.serve(
            "/test_fibonacci_action", "example_interfaces/Fibonacci", count
        )
        await send(
            connection,
            {
                "op": "send_action_goal",
                "action": "/test_fibonacci_action",
                "action_type": "example_interfaces/Fibonacci",
                "args": {"order": 5},
                "feedback": True,
            },
        )
        received = [await receive(connection) for _ in range(5)]
        expected = [0, 1, 1, 2, 3, 5]
        assert [h["values"]["sequence"] for h in received[:4]] == [
            expected[: i + 3] for i in range(4)
        ]
        assert received[-1] == {
            "op": "action_result",
            "action": "/test_fibonacci_action",
            "values": {"sequence": expected},
            "status": 4,
            "result": True,
        }


@in_a_loop
async def test_event_loop_starvation_second_client_receives_the_heartbeat() -> None:
    topics = [f"/load_{i}" for i in range(20)]
    async with serving() as server, client(server) as first:
        server.protocol.topics.advertise("/heartbeat", "std_msgs/Int32")
        for topic in topics:
            server.protocol.topics.advertise(topic, "sensor_msgs/CompressedImage")
            await send(first, {"op": "subscribe", "topic": topic})

        async def drain() -> None:
            while True:
                await first.recv()

        async def load() -> None:
            while True:
                for topic in topics:
                    server.protocol.topics.publish(topic, {"data": CLOUD[:50_000]}, server.now)
                await asyncio.sleep(0.01)

        await until(lambda: all(map(server.protocol.topics.wanted, topics)))
        work = [asyncio.create_task(drain()), asyncio.create_task(load())]
        async with client(server) as second:
            await send(second, {"op": "subscribe", "topic": "/heartbeat"})
            await until(lambda: server.protocol.topics.wanted("/heartbeat"))
            for beat in range(20):
                server.protocol.topics.publish("/heartbeat", {"data": beat}, server.now)
                await asyncio.sleep(0.01)
            assert [(await receive(second))["msg"]["data"] for _ in range(20)] == list(range(20))
        for task in work:
            task.cancel()
        await asyncio.gather(*work, return_exceptions=True)


@in_a_loop
async def test_rapid_disconnect_smoke_leaves_nothing_behind() -> None:
    async with serving() as server:
        for _ in range(50):
            async with client(server) as connection:
                await send(connection, {"op": "subscribe", **TOPIC}, SERVICE)
                await send(connection, {**CALL, "id": 1}, {"op": "advertise", **TOPIC})
                connection.transport.abort()
        await until(lambda: len(server.protocol.connections) == 0)
        assert "/test_service" not in {service.name for service in server.protocol.services.all}
        server.protocol.timers.tick(server.now + 10**10)
        assert "/a_topic" not in {topic.name for topic in server.protocol.topics.all}
        assert server.protocol.timers.due is None


@in_a_loop
async def test_startup_race_operations_right_after_the_handshake_are_processed() -> None:
    async with serving() as server:

        async def one(i: int) -> Any:
            async with client(server) as connection:
                await send(connection, {"op": "subscribe", **TOPIC, "topic": f"/t{i}"})
                await send(connection, {"op": "publish", "topic": f"/t{i}", "msg": {"data": "x"}})
                return (await receive(connection))["topic"]

        received = await asyncio.gather(*map(one, range(20)))
        assert received == [f"/t{i}" for i in range(20)]


@pytest.mark.parametrize(
    ("kind", "values", "encoded"),
    [
        ("UInt16", [1, 2], "d8454401000200"),
        ("UInt32", [1], "d8464401000000"),
        ("UInt64", [1], "d847480100000000000000"),
        ("Int8", [-1, 1], "d84842ff01"),
        ("Int16", [-2], "d84d42feff"),
        ("Int32", [-2], "d84e44feffffff"),
        ("Int64", [-2], "d84f48feffffffffffffff"),
        ("Float32", [1.5], "d855440000c03f"),
        ("Float64", [1.5], "d85648000000000000f83f"),
        ("UInt8", [1, 255], "4201ff"),
    ],
)
@in_a_loop
async def test_cbor_arrays_match_client_readers_exactly(
    kind: str, values: list[float], encoded: str
) -> None:
    async with serving() as server, client(server) as connection:
        topic = {"topic": "/array", "type": f"std_msgs/{kind}MultiArray"}
        await say(connection, {"op": "subscribe", **topic, "compression": "cbor"})
        await send(connection, {"op": "publish", "topic": "/array", "msg": {"data": values}})
        frame = await connection.recv()
        assert isinstance(frame, bytes)
        assert bytes.fromhex("64" + b"data".hex() + encoded) in frame
