"""An arc under the deadman over the socket, in lockstep: what "drive there" of any client is made of."""

from __future__ import annotations

from typing import Any

import pytest

from tests.teleop.robot.served_robots import meeting
from tests.teleop.support import Peer, Robots, in_a_loop


async def ask_for(client: Peer, identity: str, **values: object) -> None:
    await client.send(
        op="send_action_goal",
        id=identity,
        action="/move",
        action_type="farsteer_msgs/action/Move",
        args={"hold_to_run": True, **values},
        feedback=True,
    )


async def hold(client: Peer, seconds: float) -> None:
    """Hold the deadman with the stick at rest, at 10 Hz."""
    for _ in range(round(10 * seconds)):
        await client.joy(0.0)
        await client.step(5)


def results(client: Peer) -> dict[str, dict[str, Any]]:
    return {o["id"]: o["values"] for o in client.received if o["op"] == "action_result"}


@pytest.mark.slow
@in_a_loop
async def test_arc_is_driven_with_feedback_and_ends_with_the_reason(robots: Robots) -> None:
    async with meeting(robots(guard=True), 2) as (_, (client, other)):
        await client.subscribe("/teleop/state", "/drive_limits")
        await ask_for(client, "done", distance=0.5, angle=0.5)
        await hold(client, 4.0)
        assert results(client)["done"]["outcome"] == "done"
        assert results(client)["done"]["angle"] == pytest.approx(0.5, abs=0.02)
        moved = [o["values"] for o in client.received if o["op"] == "action_feedback"]
        assert moved[-1]["state"] == "moving"
        assert moved[-1]["distance"] == pytest.approx(0.5, abs=0.05)

        await ask_for(client, "cancelled", distance=1.0)
        await hold(client, 1.0)
        await client.send(op="cancel_action_goal", id="cancelled", action="/move")
        await hold(client, 1.0)

        await ask_for(client, "released", distance=1.0)
        await hold(client, 1.0)
        await client.joy(0.0, deadman=0)
        await client.step(50)

        await ask_for(client, "taken_over", distance=1.0)
        await hold(client, 1.0)
        assert client.last("/teleop/state")["linear"] > 0.2
        assert 0.0 < client.last("/teleop/state")["guard_ahead"] <= 4.0
        await other.ask("/teleop/take_over")
        await client.step(5)
        ends = {identity: values["outcome"] for identity, values in results(client).items()}
        assert ends == {name: name for name in ("done", "cancelled", "released", "taken_over")}
        assert client.last("/teleop/state")["linear"] == 0.0
        assert client.last("/drive_limits")["acceleration"] == 0.5
