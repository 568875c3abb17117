"""Large frames: a thread works on them, and only their sender waits."""

from __future__ import annotations

import json
import threading
from typing import Any

import pytest

from teleop.rosbridge import ClientLimits, Protocol
from teleop.rosbridge.graph.publication import Publication
from teleop.rosbridge.protocol.large_frame_work import LargeFrameWork, PreparedFrame
from tests.teleop.rosbridge.server.test_server import (
    client,
    in_a_loop,
    receive,
    say,
    serving,
    until,
)
from tests.teleop.rosbridge.support import REGISTRY, SECOND

POSES = {"topic": "/poses", "type": "geometry_msgs/PoseArray"}
TEXT = {"topic": "/t", "type": "std_msgs/String"}


def poses(count: int, **fields: object) -> str:
    pose = {"position": {"x": 1.5}, "orientation": {"w": 1.0}}
    message = {"poses": [pose] * count, **fields}
    return json.dumps({"op": "publish", "topic": "/poses", "msg": message})


@pytest.mark.parametrize("fragmented", [False, True])
def test_only_the_sender_waits_for_its_large_frame(
    fragmented: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, released = threading.Event(), threading.Event()
    prepare, encode = LargeFrameWork.prepare, Publication._encode
    threads: list[str] = []

    def held(self: LargeFrameWork, frame: Any, now: int) -> PreparedFrame:
        begun.set()
        assert released.wait(20)
        return prepare(self, frame, now)

    def encoded(self: Publication, topic: str, *variant: Any) -> bytes:
        if topic == "/poses":
            threads.append(threading.current_thread().name)
        return encode(self, topic, *variant)

    monkeypatch.setattr(LargeFrameWork, "prepare", held)
    monkeypatch.setattr(Publication, "_encode", encoded)

    @in_a_loop
    async def run() -> None:
        async with serving() as server, client(server) as a, client(server) as b:
            await say(b, {"op": "subscribe", **POSES}, {"op": "subscribe", **TEXT})
            large = poses(500)
            frames = [large]
            if fragmented:
                rest = {"op": "fragment", "id": "f", "total": 4}
                frames = [
                    json.dumps({**rest, "num": i, "data": large[i * 10_000 : (i + 1) * 10_000]})
                    for i in range(4)
                ]
            for frame in frames:
                await a.send(frame)
            await a.send(json.dumps({"op": "publish", "topic": "/t", "msg": {"data": "after"}}))
            await until(begun.is_set)
            for _ in range(20):
                await say(b)  # is served meanwhile
            released.set()
            first, second = await receive(b), await receive(b)
            assert (first["topic"], second["topic"]) == ("/poses", "/t")
            assert len(first["msg"]["poses"]) == 500
            await say(a)
        assert len(threads) == 1
        assert "rosbridge" in threads[0]

    run()


@in_a_loop
async def test_errors_in_large_frames_are_answered_as_in_small_ones() -> None:
    async with serving() as server, client(server) as a:
        await say(a, {"op": "advertise", **POSES})
        for frame, text in (
            (poses(1000, no="such"), "unknown field"),
            (poses(1000, header={"stamp": {"sec": 2**40}}), "out of range"),
            (
                '{"op":"publish","topic":"/poses","msg":{"poses":[' + "{}," * 9000 + "{}]}}",
                "too many",
            ),
            ("x" * 20_000, "must have in its first or last"),
        ):
            await a.send(frame)
            status = await receive(a)
            assert (status["op"], text in status["msg"]) == ("status", True), status


@in_a_loop
async def test_large_requests_and_responses_of_services_are_completed_ahead() -> None:
    async with serving() as server, client(server) as a, client(server) as b:
        server.protocol.registry.add_service("large/List", "string text\n---\nstring[] topics")
        service = {"service": "/plan", "type": "large/List"}
        await say(a, {"op": "advertise_service", **service})
        await b.send('{"op":"call_service","service":"/plan","id":1}')
        call = await receive(a)
        values = {"topics": ["/t"] * 5000}
        answer = {"op": "service_response", "service": "/plan", "id": call["id"], "result": True}
        await a.send(json.dumps({**answer, "values": values}))
        response = await receive(b)
        assert response["result"] is True
        assert len(response["values"]["topics"]) == 5000
        server.protocol.services.serve("/echo", "large/List", lambda *_: {})
        arguments = {"text": "y" * 20_000}
        call = {"op": "call_service", "service": "/echo", "args": arguments}
        await b.send(json.dumps(call))
        assert (await receive(b))["result"] is True


def test_type_that_changes_meanwhile_is_that_of_the_message() -> None:
    protocol = Protocol(REGISTRY, limits=ClientLimits.unhurried())
    client = protocol.connect(SECOND)
    received: list[Any] = []
    protocol.topics.advertise("/poses", "geometry_msgs/PoseArray")
    work = protocol.prepare(client, poses(500), SECOND)
    assert work is not None
    prepared = work()
    protocol.topics.unadvertise("/poses")
    protocol.topics.subscribe(
        "/poses", "nav_msgs/Path", lambda client, message, now: received.append(message)
    )
    protocol.receive(client, prepared, SECOND)
    assert received == []
    ((_, status),) = protocol.connections.drain()
    assert "Path" in status.text  # type: ignore[union-attr]


def test_frames_that_would_be_rejected_are_not_worked_on() -> None:
    protocol = Protocol(REGISTRY)
    client = protocol.connect(SECOND)
    protocol.topics.subscribe("/poses", "geometry_msgs/PoseArray", lambda *_: None)
    assert protocol.prepare(client, "{}", SECOND) is None
    worked = 0
    for _ in range(20):
        work = protocol.prepare(client, poses(10_000), SECOND)
        worked += work is not None
        protocol.receive(client, poses(10_000) if work is None else work(), SECOND)
    assert worked == 2
    assert protocol.prepare(99, poses(10_000), SECOND) is None
