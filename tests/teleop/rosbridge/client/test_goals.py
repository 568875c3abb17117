"""Goals of the client: results, feedback, rejection, cancellation, and connections that break."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve

from teleop.rosbridge.client.client import Client
from teleop.rosbridge.client.goals import GoalResult, goal_result
from teleop.rosbridge.client.pending_requests import PendingRequests
from teleop.rosbridge.errors import (
    ClientError,
    GoalLostError,
    GoalRejectedError,
    ServiceCallError,
    ServiceError,
)
from teleop.rosbridge.graph.goals import Goal, GoalStatus
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.server.server import Server
from tests.teleop.rosbridge.server.test_server import in_a_loop, serving, until
from tests.teleop.rosbridge.support import REGISTRY

KIND = "farsteer_msgs/action/Move"


@asynccontextmanager
async def moving(handler: Any) -> AsyncIterator[tuple[Server, Client]]:
    """A server with an action, and a client."""
    async with serving() as server, Client(server.url, registry=REGISTRY) as client:
        server.protocol.actions.serve("/move", KIND, handler)
        yield server, client


@in_a_loop
async def test_goals_at_the_same_time_have_their_own_feedback_and_results() -> None:
    goals: list[Goal] = []
    async with moving(goals.append) as (_, client):
        reports: list[Message] = []
        first = asyncio.create_task(
            client.run_goal("/move", KIND, {"distance": 0.5}, feedback=reports.append)
        )
        await until(lambda: len(goals) == 1)
        second = asyncio.create_task(client.run_goal("/move", KIND, {"distance": -1.0}))
        await until(lambda: len(goals) == 2)
        assert [goal.request["distance"] for goal in goals] == [0.5, -1.0]
        goals[1].feedback({"distance": -0.3})
        goals[0].feedback({"distance": 0.2})
        goals[1].abort("", {"outcome": "contact", "distance": -0.4})
        goals[0].succeed({"outcome": "done", "distance": 0.5})
        one, two = await first, await second
        assert [report["distance"] for report in reports] == [0.2]
        assert (one.status, one.values["outcome"]) == (GoalStatus.SUCCEEDED, "done")
        assert (two.status, two.values["outcome"]) == (GoalStatus.ABORTED, "contact")


@in_a_loop
async def test_a_goal_has_its_result_though_the_callback_of_its_feedback_fails() -> None:
    def report(goal: Goal) -> None:
        goal.feedback({"distance": 0.2})
        goal.succeed({"outcome": "done", "distance": 0.5})

    def fall(_: Message) -> None:
        raise ZeroDivisionError

    async with moving(report) as (_, client):
        result = await client.run_goal("/move", KIND, {"distance": 0.5}, feedback=fall)
        assert result.values["outcome"] == "done"


@in_a_loop
async def test_a_goal_that_is_not_executed_is_rejected_with_the_reason() -> None:
    def refuse(goal: Goal) -> None:
        raise ServiceError("somebody else drives")

    async with moving(refuse) as (_, client):
        with pytest.raises(GoalRejectedError, match=r"/move: .*somebody else drives"):
            await client.run_goal("/move", KIND, {})
        with pytest.raises(GoalRejectedError, match="/fly: "):
            await client.run_goal("/fly", KIND, {})
        assert client.connected


@in_a_loop
async def test_a_goal_or_call_that_a_server_answers_with_a_status_fails_with_its_reason() -> None:
    async def attend(connection: ServerConnection) -> None:
        async for frame in connection:
            asked = json.loads(frame)
            answer = {"op": "status", "level": "error", "msg": f"Unknown operation: {asked['op']}"}
            await connection.send(json.dumps({**answer, "id": asked["id"]}))

    async with (
        serve(attend, "127.0.0.1", 0) as old,
        Client(f"ws://127.0.0.1:{old.sockets[0].getsockname()[1]}") as client,
    ):
        with pytest.raises(GoalRejectedError, match="/move: Unknown operation: send_action_goal"):
            await client.run_goal("/move", KIND, {})
        with pytest.raises(ServiceCallError, match="/stop: Unknown operation: call_service"):
            await client.call("/stop")


@in_a_loop
async def test_cancelling_the_coroutine_cancels_the_goal() -> None:
    goals: list[Goal] = []
    cancelled = asyncio.Event()

    def take(goal: Goal) -> None:
        goals.append(goal)
        goal.on_cancel(cancelled.set)

    async with moving(take) as (_, client):
        waiting = asyncio.create_task(client.run_goal("/move", KIND, {}))
        await until(lambda: bool(goals))
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        await asyncio.wait_for(cancelled.wait(), 60.0)
        goals[0].canceled()  # for which nobody waits
        await client.call("/rosapi/get_time")
        assert client.connected


@in_a_loop
async def test_a_goal_is_lost_with_its_connection_and_none_is_sent_without_one() -> None:
    goals: list[Goal] = []
    async with moving(goals.append) as (server, client):
        waiting = asyncio.create_task(client.run_goal("/move", KIND, {}))
        await until(lambda: bool(goals))
        await server.close()
        with pytest.raises(GoalLostError, match="/move: connection lost"):
            await waiting
        await until(lambda: not client.connected)
        with pytest.raises(ClientError, match="/move: not connected to ws://"):
            await client.run_goal("/move", KIND, {})
    assert len(goals) == 1


@in_a_loop
async def test_an_answer_that_nobody_waits_for_or_that_comes_late_counts_for_nothing() -> None:
    goals = PendingRequests(GoalLostError)
    future = goals.add("1", "/move")
    goals.complete("2", {"values": {}, "status": 4})
    goals.complete("1", {"values": {"outcome": "done"}, "status": 99})
    goals.complete("1", {"values": {"outcome": "late"}, "status": 4})
    # Nor does a status that is not known keep a result from being taken.
    expected = GoalResult(GoalStatus.UNKNOWN, {"outcome": "done"})
    assert goal_result("/move", await future) == expected
