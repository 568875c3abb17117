from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
import pytest

from teleop.rosbridge import Client, Keepalive, publish_client_traffic
from tests.teleop.rosbridge.server.test_server import (
    IMAGE,
    client,
    in_a_loop,
    say,
    serving,
    stall,
    until,
)


def by_name(message: Any) -> dict[str, tuple[int, str, dict[str, str]]]:
    return {
        status["name"]: (
            status["level"],
            status["message"],
            {pair["key"]: pair["value"] for pair in status["values"]},
        )
        for status in message["status"]
    }


@pytest.mark.slow
@in_a_loop
async def test_slow_clients_are_reported_with_their_dropped_messages() -> None:
    async with serving(keepalive=Keepalive(0.05, 5.0, 30.0)) as server:
        publish_client_traffic(server)
        told: list[Any] = []
        async with Client(server.url) as watcher, client(server) as slow:
            await watcher.subscribe(
                "/client_traffic", "diagnostic_msgs/DiagnosticArray", told.append
            )
            await say(slow, {**IMAGE, "compression": "cbor"})
            stall(slow)
            for _ in range(30):
                server.protocol.topics.publish(
                    "/cloud", {"data": np.zeros(400_000, np.uint8)}, server.now
                )
                await asyncio.sleep(0.01)
            await until(lambda: len(told) >= 1)
            good, bad = by_name(told[0]).values()
            assert good[:2] == (0, "ok")
            assert good[2]["waiting [bytes]"] == good[2]["dropped [messages]"] == "0"
            assert float(good[2]["round trip [ms]"]) > 0
            lost = int(bad[2]["dropped [messages]"])
            assert bad[:2] == (1, f"reads too slowly: {lost} messages dropped")
            assert lost > 10
            assert int(bad[2]["waiting [bytes]"]) > 400_000
            await until(lambda: len(told) >= 2)
            assert [status[:2] for status in by_name(told[1]).values()] == [(0, "ok")] * 2
        await until(lambda: len(server.protocol.connections) == 0)
        server.protocol.timers.tick(server.now + 10**10)
        assert server.protocol.timers.due is None  # without clients, no timer runs


@in_a_loop
async def test_client_traffic_is_not_published_in_lockstep() -> None:
    async with serving(lockstep=True, clock=lambda: 0) as server:
        before = {topic.name for topic in server.protocol.topics.all}
        publish_client_traffic(server)
        assert {topic.name for topic in server.protocol.topics.all} == before
