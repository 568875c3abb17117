"""``/sim/step``: who may step, what a step returns, and the same bytes for the same operations."""

from __future__ import annotations

import socket

import pytest

from robot_sim import TICK_NS
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.topics.topic_table import INPUTS, OUTPUTS
from tests.teleop.rosbridge.support import client_ids
from tests.teleop.support import (
    SPAWN,
    Robots,
    arm,
    drive,
    hint_message,
    in_a_loop,
    peer,
    stamp_of,
)


@in_a_loop
async def test_step_answers_after_all_messages_of_its_ticks(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/clock", "/scan", "/tf")
        for ticks in (1, 7, 50):
            before = len(client.messages("/clock"))
            reached = await client.step(ticks)
            clocks = [stamp_of(m["clock"]) for m in client.messages("/clock")[before:]]
            assert clocks == [reached - n * TICK_NS for n in reversed(range(ticks))]
            assert client.received[-1]["op"] == "service_response"


@in_a_loop
async def test_deferred_work_is_done_once_after_each_response_has_been_sent(
    robots: Robots,
) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/scan", "/tf")
        (caller,) = client_ids(rig.server.protocol)
        unsent: list[int] = []
        LockstepService(
            rig.stepper.stepped, deferred=lambda: unsent.append(rig.server.waiting(caller))
        )
        for steps in range(1, 4):
            await client.step(5)
            await client.ask("/rosapi/get_time")
            assert unsent == [0] * steps


@in_a_loop
async def test_step_of_invalid_length_is_rejected(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        for ticks, complaint in (
            (0, "ticks must be 1 to 500, got 0"),
            (10**9, "ticks must be 1 to 500, got 1000000000"),
            (-1, "field ticks, but got one out of range"),
            ("five", "for field ticks, but got a <class 'str'>"),
            (2.5, "for field ticks, but got a <class 'float'>"),
        ):
            good, values = await client.ask("/sim/step", ticks=ticks)
            assert not good
            assert complaint in values
        assert rig.robot.simulation.stamp == 0
        assert await client.step(1) == TICK_NS


@in_a_loop
async def test_only_the_owner_steps_while_it_is_connected(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as owner:
        await owner.step()
        async with peer(rig.server.url) as other:
            assert await other.ask("/sim/step", ticks=1) == (
                False,
                f"{rig.server.protocol.connections.name(1)} owns the stepping; wait until it disconnects",
            )
            assert "127.0.0.1:" in rig.server.protocol.connections.name(1)
        assert await owner.step() == 2 * TICK_NS


@in_a_loop
async def test_robot_is_at_rest_before_the_next_client_steps(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as heir:
        await heir.subscribe("/ground_truth/odom", "/teleop/state")
        async with peer(rig.server.url) as owner:
            await arm(owner)
            await drive(owner, 1.0, steps=15)
            assert (await heir.ask("/sim/step", ticks=1))[0] is False
            assert heir.speed > 0.6
        await rig.departure()
        at_rest = rig.robot.simulation.truth()
        assert abs(at_rest.twist.linear[0]) < 0.005
        stamp = await heir.step(5)
        assert stamp - at_rest.stamp == 5 * TICK_NS
        assert abs(heir.speed) < 0.005
        assert heir.last("/teleop/state")["state"] == "idle"


@in_a_loop
async def test_step_ends_when_its_caller_leaves_in_the_middle(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as heir:
        await heir.subscribe("/clock", "/ground_truth/odom")
        await heir.settle()
        async with peer(rig.server.url) as owner:
            await arm(owner)
            await drive(owner, 1.0, steps=10)
            await owner.send(op="call_service", service="/sim/step", args={"ticks": 500})
            await owner.joy(1.0)
            await heir.until(lambda: len(heir.messages("/clock")) > 55)
            owner.abort()
            await rig.departure()
        stamp = rig.robot.simulation.stamp
        assert stamp < 500 * TICK_NS
        assert abs(rig.robot.simulation.truth().twist.linear[0]) < 0.005
        assert await heir.step(1) == stamp + TICK_NS


@in_a_loop
async def test_overlapping_step_calls_are_rejected(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        for identity in ("first", "second"):
            await client.send(
                op="call_service", id=identity, service="/sim/step", args={"ticks": 50}
            )
        await client.until(lambda: client.answer("first") and client.answer("second"))
        first, second = client.answer("first"), client.answer("second")
        assert first is not None
        assert second is not None
        assert first["result"] is True
        assert second["values"] == "the last step has not ended yet"
        assert rig.robot.simulation.stamp == 50 * TICK_NS


def bound_socket(port: int, to: int) -> socket.socket:
    """Return a connected socket from a port of our choice: the robot names clients by their address."""
    source = socket.socket()
    source.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    source.bind(("127.0.0.1", port))
    source.connect(("127.0.0.1", to))
    source.setblocking(False)
    return source


async def a_short_run(robots: Robots, port: int) -> tuple[int, list[str | bytes]]:
    async with robots(seed=4) as rig:
        source = bound_socket(port, rig.server.port)
        source_port = source.getsockname()[1]
        async with peer(rig.server.url, source=source) as client:
            for n, topic in enumerate(OUTPUTS):
                await client.subscribe(topic.name, compression=("none", "cbor")[n % 2])
            await client.subscribe(*(i.name for i in INPUTS), "/map_info", "/tf_static")
            await client.hint(hint_message(*SPAWN, sigma=0.7))
            await client.step(60)
            await arm(client)
            await drive(client, 1.0, steps=10)
            await client.say('{"op":"publish","topic":"/joy","msg":{"axes":["x"]}}')
            await client.ask("/teleop/estop")
            await client.step(25)
            await client.ask("/teleop/estop_reset")
            await client.step(10)
            return source_port, client.frames


@pytest.mark.slow
@in_a_loop
async def test_same_operations_give_the_same_bytes(robots: Robots) -> None:
    port, first = await a_short_run(robots, 0)
    _, again = await a_short_run(robots, port)
    assert len(first) > 500
    assert first == again
