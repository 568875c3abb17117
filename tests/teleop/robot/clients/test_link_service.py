"""``/teleop/link``: what was sent, dropped, and how long it takes, over real sockets."""

from __future__ import annotations

import asyncio

from teleop.robot.clients.link_service import LinkService
from teleop.ros_types import registry
from teleop.rosbridge import Protocol, Server
from tests.teleop.rosbridge.server.test_server import stall
from tests.teleop.support import Robots, in_a_loop, peer

LINK = "/teleop/link"


@in_a_loop
async def test_messages_and_bytes_of_a_link_are_those_that_came(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.step(5)
        await client.subscribe("/odom", "/clock", "tf_static")
        await client.step(50)
        before = len(client.frames)
        good, values = await client.ask(LINK)
        assert good
        assert values["topics"] == ["/clock", "/odom", "tf_static"]
        assert values["sent"] == [50, 25, 1]
        assert values["dropped"] == [0, 0, 0]
        assert values["round_trip"] == -1.0
        assert values["bytes"] == sum(len(frame) for frame in client.frames[:before])
        await client.send(op="unsubscribe", topic="/odom")
        await client.step(10)
        await client.subscribe("/odom")
        await client.step(10)
        values = (await client.ask(LINK))[1]
        assert values["sent"] == [70, 5, 1], "of this subscription only"


@in_a_loop
async def test_link_of_another_client_is_its_own(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client, peer(rig.server.url) as other:
        await other.subscribe("/scan")
        await other.settle()
        await client.step(20)
        assert (await client.ask(LINK))[1]["topics"] == []
        assert (await other.ask(LINK))[1]["topics"] == ["/scan"]


@in_a_loop
async def test_dropped_messages_of_a_client_that_reads_slowly_are_counted() -> None:
    server = Server(Protocol(registry()), port=0)
    LinkService(server)
    topics = server.protocol.topics
    topics.advertise("/cloud", "std_msgs/UInt8MultiArray")
    async with server, peer(server.url) as client:
        await client.subscribe("/cloud", compression="cbor")
        await client.settle()
        stall(client.connection)
        for _ in range(40):
            topics.publish("/cloud", {"data": bytes(400_000)}, server.now)
            await asyncio.sleep(0.01)
        client.connection.transport.resume_reading()
        values = (await client.ask(LINK))[1]
        await client.until(
            lambda: len(client.messages("/cloud")) == values["sent"][0], "what was sent"
        )
        assert values["dropped"][0] > 10
        assert values["sent"][0] + values["dropped"][0] == 40
        assert values["bytes"] >= sum(len(f) for f in client.frames if isinstance(f, bytes))
        assert 0.0 < values["round_trip"] < 60.0
