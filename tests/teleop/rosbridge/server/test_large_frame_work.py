"""Large frames: a thread works on those that come, for which only their sender waits, and sent ones arrive whole."""

from __future__ import annotations

import base64
import json
import ssl
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teleop.rosbridge import ClientLimits, Keepalive, Protocol, tls_context
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, UNGUARDED, Access, Role
from teleop.rosbridge.framing.large_frames import LargeFrameReader
from teleop.rosbridge.messages.cbor import read_cbor
from teleop.rosbridge.protocol.large_frame_work import LargeFrameWork, PreparedFrame
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.rosbridge.server.test_server import (
    IMAGE,
    client,
    in_a_loop,
    receive,
    say,
    serving,
    until,
)
from tests.teleop.rosbridge.support import REGISTRY, SECOND, publish, received_on

POSES = {"topic": "/poses", "type": "geometry_msgs/PoseArray"}
TEXT = {"topic": "/t", "type": "std_msgs/String"}


def poses(count: int, **fields: object) -> str:
    pose = {"position": {"x": 1.5}, "orientation": {"w": 1.0}}
    message = {"poses": [pose] * count, **fields}
    return json.dumps({"op": "publish", "topic": "/poses", "msg": message})


class HeldWork:
    """Holds the work on large frames until it is released."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.begun, self.released = threading.Event(), threading.Event()
        self.threads: set[str] = set()
        self.frames: list[Any] = []
        prepare = LargeFrameWork.prepare

        def held(work: LargeFrameWork, frame: Any, now: int) -> PreparedFrame:
            self.frames.append(frame)
            self.threads.add(threading.current_thread().name)
            self.begun.set()
            assert self.released.wait(20)
            return prepare(work, frame, now)

        monkeypatch.setattr(LargeFrameWork, "prepare", held)


def in_fragments(frame: str, size: int) -> list[str]:
    pieces = [frame[i : i + size] for i in range(0, len(frame), size)]
    rest = {"op": "fragment", "id": "f", "total": len(pieces)}
    return [json.dumps({**rest, "num": i, "data": piece}) for i, piece in enumerate(pieces)]


@pytest.mark.parametrize("fragment", [0, 10_000, 20_000])
@in_a_loop
async def test_large_frame_holds_up_what_its_sender_sends_to_the_same_topic_and_nothing_else(
    fragment: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = HeldWork(monkeypatch)
    async with serving() as server, client(server) as a, client(server) as b:
        await say(b, {"op": "subscribe", **POSES}, {"op": "subscribe", **TEXT})
        for frame in in_fragments(poses(500), fragment) if fragment else [poses(500)]:
            await a.send(frame)
        await a.send(json.dumps({"op": "publish", "topic": "poses", "msg": {}}))
        for part in in_fragments(json.dumps({"op": "unadvertise", "topic": "/poses"}), 20):
            await a.send(part)
        await until(work.begun.is_set)
        await a.send(json.dumps(publish("passes", "/t")))
        assert (await receive(b))["msg"] == {"data": "passes"}
        for _ in range(20):
            await say(b)  # is served meanwhile
        work.released.set()
        first, second = await receive(b), await receive(b)
        assert [len(first["msg"]["poses"]), len(second["msg"]["poses"])] == [500, 0]
    assert work.threads == {"rosbridge"}


@in_a_loop
async def test_frames_behind_auth_wait_for_the_large_frame_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    work = HeldWork(monkeypatch)
    async with serving() as server, client(server) as a, client(server) as b:
        await say(b, {"op": "subscribe", **POSES}, {"op": "subscribe", **TEXT})
        for frame in (poses(500), '{"op":"auth","token":"x"}', json.dumps(publish("x", "/t"))):
            await a.send(frame)
        await until(work.begun.is_set)
        await say(b)
        work.released.set()
        assert [(await receive(b))["topic"] for _ in range(2)] == ["/poses", "/t"]


@in_a_loop
async def test_work_of_a_client_that_has_left_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    work = HeldWork(monkeypatch)
    async with serving() as server, client(server) as a, client(server) as b:
        await say(b, {"op": "subscribe", **POSES})
        async with client(server) as leaving:
            await a.send(poses(500))
            await until(work.begun.is_set)
            for _ in range(3):
                await leaving.send(poses(700))
            await say(leaving)
        await until(lambda: len(server.protocol.connections) == 2)
        await a.send(poses(600))
        work.released.set()
        received = [len((await receive(b))["msg"]["poses"]) for _ in range(2)]
        assert received == [500, 600]
        assert len(work.frames) == 2


@in_a_loop
async def test_frames_that_wait_for_a_large_one_are_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    work = HeldWork(monkeypatch)
    limits = replace(ClientLimits(), messages=1e6, frames=1e6, bytes=50_000.0)
    async with serving(limits) as server, client(server) as a:
        await say(a, {"op": "advertise", **POSES}, {"op": "set_level", "level": "error"})
        for _ in range(200):
            await a.send(poses(400))
        status = await receive(a)
        assert "too many bytes wait behind your large frames" in status["msg"]
        work.released.set()


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
    protocol.topics.establish("/poses", "geometry_msgs/PoseArray")
    work = protocol.prepare(client, poses(500), SECOND)
    assert work is not None
    prepared = work()
    received = received_on(protocol, "/poses", "nav_msgs/Path")
    protocol.receive(client, prepared, SECOND)
    assert received == []
    ((_, status),) = protocol.connections.drain()
    assert "Path" in status.text  # type: ignore[union-attr]


def test_frames_that_would_be_rejected_are_not_worked_on() -> None:
    protocol = Protocol(REGISTRY, limits=ClientLimits(parts=3000))
    client = protocol.connect(SECOND)
    protocol.topics.subscribe("/poses", "geometry_msgs/PoseArray", lambda *_: None)
    assert protocol.prepare(client, "{}", SECOND) is None
    worked = 0
    for _ in range(20):
        work = protocol.prepare(client, poses(1000), SECOND)
        worked += work is not None
        protocol.receive(client, poses(1000) if work is None else work(), SECOND)
    assert worked == 2
    assert protocol.prepare(99, poses(1000), SECOND) is None


VIEWER = Access("", Role.VIEW, DEFAULT_RULES[Role.VIEW])


@pytest.mark.parametrize(
    ("access", "topic", "why"),
    [
        (VIEWER, "/poses", "publish: role view may not publish /poses"),
        (UNGUARDED, "/owned", "publish: topic /owned is published by the server only"),
        (UNGUARDED, "owned/", "publish: topic owned/ is published by the server only"),
    ],
)
def test_frames_that_their_sender_may_not_publish_are_not_even_read(
    access: Access, topic: str, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    protocol = Protocol(REGISTRY)
    client = protocol.connect(SECOND, access=access)
    protocol.topics.subscribe("/poses", "geometry_msgs/PoseArray", lambda *_: None)
    protocol.topics.advertise("/owned", "geometry_msgs/PoseArray")
    monkeypatch.setattr(LargeFrameReader, "read", lambda *_: pytest.fail("was read"))
    frame = json.dumps({**json.loads(poses(1000)), "topic": topic, "id": 7})
    frame = json.dumps({"id": 7, "op": "publish", "topic": topic}).rstrip("}") + ", " + frame[1:]
    assert protocol.prepare(client, frame, SECOND) is None
    protocol.receive(client, frame, SECOND)
    ((_, status),) = protocol.connections.drain()
    assert json.loads(status.text) == {  # type: ignore[union-attr]
        "op": "status",
        "level": "error",
        "msg": why,
        "id": 7,
    }


def test_refusal_of_a_large_call_is_a_response() -> None:
    protocol = Protocol(REGISTRY)
    client = protocol.connect(SECOND, access=VIEWER)
    protocol.services.serve("/sum", "example_interfaces/AddTwoInts", lambda *_: {"sum": 0})
    call = {"op": "call_service", "service": "/sum", "id": "c", "args": {"a": 1, "b": 2}}
    frame = json.dumps(call).replace("1,", "1," + " " * 20_000)
    assert protocol.prepare(client, frame, SECOND) is None
    protocol.receive(client, frame, SECOND)
    ((_, response),) = protocol.connections.drain()
    answer = json.loads(response.text)  # type: ignore[union-attr]
    assert answer == {
        "op": "service_response",
        "service": "/sum",
        "values": "role view may not call /sum",
        "result": False,
        "id": "c",
    }


@pytest.mark.parametrize("encrypted", [False, True])
@in_a_loop
async def test_long_frames_arrive_whole_between_pings(encrypted: bool, tmp_path: Path) -> None:
    data = np.random.default_rng(0).integers(0, 256, 1_500_000, np.uint8)
    crt, key = certificate(tmp_path)
    options: dict[str, Any] = {"tls": tls_context(crt, key)} if encrypted else {}
    trust = {"ssl": ssl.create_default_context(cafile=str(crt))} if encrypted else {}
    async with (
        serving(keepalive=Keepalive(ping_interval=0.01), **options) as server,
        client(server, ping_interval=0.01, **trust) as a,
    ):
        for compression in ("none", "cbor", "cbor-raw", "none"):
            await say(a, {**IMAGE, "op": "unsubscribe"}, {**IMAGE, "compression": compression})
            server.protocol.topics.publish("/cloud", {"data": data}, server.now)
            frame = await a.recv()
            if isinstance(frame, str):
                assert base64.b64decode(json.loads(frame)["msg"]["data"]) == data.tobytes()
            else:  # the serialised message ends with the data
                content = read_cbor(frame)["msg"]
                assert (content.get("data") or content["bytes"][-len(data) :]) == data.tobytes()
