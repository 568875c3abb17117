"""Many simultaneous clients, and the cost of one that does not read."""

from __future__ import annotations

import asyncio
import base64
import json
import ssl
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.client import connect

from teleop.rosbridge.auth.tls import tls_context
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.cbor import read_cbor
from teleop.rosbridge.messages.message_types import Message, MessageType
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.keepalive import Keepalive
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.rosbridge.support import REGISTRY, SECOND, Wire


def test_messages_are_encoded_once_for_all_equal_subscribers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wire = Wire(9, limits=ClientLimits.unhurried())
    codec = wire.protocol.encoders.codec
    done: list[str] = []
    for method in ("json_pieces", "cbor"):

        def counted(kind: MessageType, message: Message, method: str = method) -> Any:
            done.append(method)
            return getattr(type(codec), method)(codec, kind, message)

        monkeypatch.setattr(codec, method, counted)
    wire.protocol.topics.advertise("/cloud", "sensor_msgs/PointCloud2")
    for client in range(8):
        compression = "cbor" if client % 2 else "none"
        wire.send({"op": "subscribe", "topic": "/cloud", "compression": compression}, client)
    for _ in range(3):
        wire.protocol.topics.publish("/cloud", {"data": np.arange(99, dtype=np.uint8)}, SECOND)
        payloads = [wire.outputs(client)[0].payload for client in range(8)]
        assert len({id(payload) for payload in payloads}) == 2
    assert sorted(done) == ["cbor"] * 3 + ["json_pieces"] * 3


@pytest.mark.parametrize("encrypted", [False, True])
def test_long_frames_arrive_whole_between_pings(encrypted: bool, tmp_path: Path) -> None:
    data = np.random.default_rng(0).integers(0, 256, 1_500_000, np.uint8)

    async def run() -> None:
        crt, key = certificate(tmp_path)
        trust = ssl.create_default_context(cafile=str(crt))
        tls = tls_context(crt, key) if encrypted else None
        pulse = Keepalive(ping_interval=0.01)
        server = Server(
            Protocol(REGISTRY, limits=ClientLimits.unhurried()), port=0, keepalive=pulse, tls=tls
        )
        server.protocol.topics.advertise("/cloud", "sensor_msgs/PointCloud2")
        options: dict[str, Any] = {"ssl": trust} if encrypted else {}
        async with (
            asyncio.timeout(30),
            server,
            connect(server.url, max_size=None, proxy=None, ping_interval=0.01, **options) as client,
        ):
            for compression in ("none", "cbor", "cbor-raw", "none"):
                subscribe = {"op": "subscribe", "topic": "/cloud", "compression": compression}
                await client.send('{"op":"unsubscribe","topic":"/cloud"}')
                await client.send(json.dumps(subscribe))
                await client.send('{"op":"call_service","service":"/there"}')
                assert "service_response" in str(
                    await client.recv()
                )  # it has received all messages before
                server.protocol.topics.publish("/cloud", {"data": data}, server.now)
                frame = await client.recv()
                if isinstance(frame, str):
                    assert base64.b64decode(json.loads(frame)["msg"]["data"]) == data.tobytes()
                else:
                    content = read_cbor(frame)["msg"]
                    # The serialised message ends with the data and one more bool.
                    assert (
                        content.get("data") or content["bytes"][-len(data) - 1 : -1]
                    ) == data.tobytes()

    asyncio.run(run())
