"""Soak test: many clients connect, use everything and disconnect, and no state remains."""

from __future__ import annotations

import asyncio
import gc
import json
import tracemalloc
from typing import Any

import pytest

from benchmarks.wire.crowd import come_and_go, crowded_server, open_files, publish
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from tests.teleop.rosbridge.server.test_server import in_a_loop
from tests.teleop.rosbridge.support import REGISTRY, SECOND

GOAL = {"source_frames": ["a"], "target_frame": "b"}


def life(i: int) -> list[dict[str, Any]]:
    """Run the operations of one client, with names of its own."""
    own, common = f"/own_{i}", f"/common_{i % 3}"
    return [
        {"op": "subscribe", "topic": common, "type": "std_msgs/String", "throttle_rate": 100},
        {"op": "advertise", "topic": own, "type": "std_msgs/String", "latch": True},
        {"op": "publish", "topic": own, "msg": {"data": "x" * 1000}},
        {"op": "publish", "topic": common, "msg": {"data": "y" * 1000}},
        {"op": "publish", "topic": common, "msg": {"data": "z" * 1000}},
        {"op": "advertise_service", "service": own, "type": "std_srvs/Trigger"},
        {"op": "call_service", "service": own, "id": i, "timeout": 1e9},
        {"op": "call_service", "service": own, "id": -i, "timeout": 0},
        {"op": "unadvertise_service", "service": own},
        {"op": "advertise_service", "service": own, "type": "std_srvs/Trigger"},
        {"op": "call_service", "service": own, "id": f"{i}"},
        {"op": "advertise_action", "action": own, "type": "actionlib/Test"},
        {"op": "send_action_goal", "action": own, "action_type": "actionlib/Test", "id": i},
        {"op": "fragment", "id": i, "num": 0, "total": 2, "data": "w" * 1000},
        {"op": "call_service", "service": "/republish_tfs", "args": GOAL},
        {"op": "send_action_goal", "action": "/tf2_web_republisher", "args": GOAL, "id": "tf"},
        {"op": "publish", "topic": "/tf2_web_republisher/goal", "msg": {"goal": GOAL}},
        {"op": "call_service", "service": "/rosapi/topics_and_raw_types"},
        {"op": "call_service", "service": "/rosapi/set_param", "args": {"name": "p", "value": "1"}},
        {"op": "nonsense", "id": i},
    ]


@pytest.mark.slow
def test_memory_stays_constant_over_many_connections() -> None:
    protocol = Protocol(REGISTRY, limits=ClientLimits())
    serve_standard(protocol)
    now = 0

    def churn(first: int, last: int) -> int:
        nonlocal now
        here: list[int] = []
        for i in range(first, last):
            here.append(protocol.connect(now, f"10.0.0.1:{i}"))
            for operation in life(i):
                protocol.receive(here[-1], json.dumps(operation), now)
            if len(here) > 5:
                protocol.disconnect(here.pop(0), now)
            now += SECOND // 2
            protocol.timers.tick(now)
            protocol.connections.drain()
        for client in here:
            protocol.disconnect(client, now)
        for _ in range(60):
            now += SECOND
            protocol.timers.tick(now)
        protocol.connections.drain()
        gc.collect()
        # Memory of the interpreter itself, such as its string table, is not counted.
        ours = [
            tracemalloc.Filter(True, f"*/{part}/*") for part in ("rosbridge", "json", "rosbags")
        ]
        found = tracemalloc.take_snapshot().filter_traces(ours).statistics("filename")
        return sum(each.size for each in found)

    names = {topic.name for topic in protocol.topics.all}
    tracemalloc.start()
    try:
        churn(0, 10)
        before = churn(100, 120)
        after = churn(200, 260)
    finally:
        tracemalloc.stop()
    assert after - before < 20_000
    assert {topic.name for topic in protocol.topics.all} == names
    assert all(service.provider == -1 for service in protocol.services.all)
    assert protocol.timers.due is None


@pytest.mark.long
@pytest.mark.slow
@in_a_loop
async def test_sockets_and_tasks_are_released_after_many_clients() -> None:
    tracemalloc.start()
    try:
        async with crowded_server(REGISTRY) as server:
            protocol = server.protocol
            known = {topic.name for topic in protocol.topics.all}
            services = {service.name for service in protocol.services.all}
            tasks, files = len(asyncio.all_tasks()), open_files()
            publisher = asyncio.create_task(publish(server))
            sizes = []
            for number in range(6):
                await come_and_go(server, number)
                gc.collect()
                sizes.append(tracemalloc.get_traced_memory()[0])
            publisher.cancel()
            await asyncio.sleep(1.1)  # unused topics are removed after a second
            # A third of a cloud, as caches of the interpreter grow at first.
            assert sizes[-1] - sizes[2] < 100_000, sizes
            assert (len(asyncio.all_tasks()), open_files()) == (tasks, files)
            protocol.timers.tick(server.now)
            assert {topic.name for topic in protocol.topics.all} == known
            assert {service.name for service in protocol.services.all} == services
            assert (protocol.actions.all[0].provider, len(protocol.actions.all)) == (-1, 1)
    finally:
        tracemalloc.stop()
