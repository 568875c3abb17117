"""ROS 2 actions of clients and of the host."""

from __future__ import annotations

from typing import Any

import pytest

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_types import Message
from tests.teleop.rosbridge.support import Wire, error

ASKER, PROVIDER, OTHER = 0, 1, 2
KIND = "example_interfaces/Fibonacci"
NAME = "/fib"


def provide(**more: Any) -> Message:
    return {"op": "advertise_action", "action": NAME, "type": KIND, **more}


def goal(**more: Any) -> Message:
    asked = {"op": "send_action_goal", "action": NAME, "action_type": KIND, "id": "g"}
    return {**asked, "args": {"order": 5}, **more}


def said(op: str, number: int = 1, **more: Any) -> Message:
    return {"op": op, "action": NAME, "id": f"action_goal:{NAME}:{number}", **more}


def result(values: object, status: int, good: bool) -> Message:
    return {
        "op": "action_result",
        "action": NAME,
        "id": "g",
        "values": values,
        "status": status,
        "result": good,
    }


@pytest.fixture
def wire() -> Wire:
    wire = Wire(clients=3)
    wire.send(provide(), PROVIDER)
    return wire


def test_goal_is_forwarded_and_feedback_and_result_return(wire: Wire) -> None:
    wire.send(goal(args={}, feedback=True), ASKER)
    assert wire.received(PROVIDER) == [
        {
            "op": "send_action_goal",
            "id": "action_goal:/fib:1",
            "action": NAME,
            "action_type": KIND,
            "args": {"order": 0},
            "feedback": True,
        }
    ]
    wire.send(said("action_feedback", values={"sequence": [0, 1]}), PROVIDER)
    wire.send(
        said("action_result", values={"sequence": [0, 1, 1]}, status=4, result=True), PROVIDER
    )
    told = {"op": "action_feedback", "action": NAME, "id": "g", "values": {"sequence": [0, 1]}}
    assert wire.received(ASKER) == [told, result({"sequence": [0, 1, 1]}, 4, True)]
    assert wire.received(PROVIDER) == wire.received(OTHER) == []


def test_feedback_is_sent_only_on_request(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.send(said("action_feedback", values={"sequence": [0]}), PROVIDER)
    assert wire.received(ASKER) == []


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"values": {"sequence": [1]}, "result": True}, result({"sequence": [1]}, 4, True)),
        ({"values": {"sequence": [1]}}, result({"sequence": [1]}, 4, True)),
        ({"result": True}, result({"sequence": []}, 4, True)),
        ({"values": {}, "status": 6, "result": True}, result({"sequence": []}, 6, True)),
        ({"values": {}, "result": False}, result({"sequence": []}, 6, True)),
        ({"status": 6, "result": False}, result("the goal was aborted", 6, False)),
        ({"values": "no way", "status": 6, "result": False}, result("no way", 6, False)),
    ],
)
def test_goals_end_with_the_status_of_the_provider(
    wire: Wire, more: Message, expected: Message
) -> None:
    wire.send(goal(), ASKER)
    assert wire.received(PROVIDER)
    assert wire.ask(said("action_result", **more), PROVIDER) == []
    assert wire.received(ASKER) == [expected]


def test_cancelled_goal_has_a_result_with_status_5(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.received(PROVIDER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"}, ASKER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"}, ASKER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "nope"}, ASKER)
    assert wire.received(PROVIDER) == [said("cancel_action_goal")]
    wire.send(said("action_result", values={}, status=5, result=True), PROVIDER)
    assert wire.received(ASKER) == [result({"sequence": []}, 5, True)]


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ({"action": "/nope"}, "Action /nope does not exist"),
        ({"args": {"orders": 1}}, "does not have a field orders"),
        ({"args": {"order": 1.5}}, "requires a int32"),
        ({"args": [1]}, "requires a"),
    ],
)
def test_rejected_goal_receives_a_result_at_once(wire: Wire, more: Message, text: str) -> None:
    (received,) = wire.ask(goal(**more), ASKER)
    assert (received["op"], received["status"], received["result"]) == ("action_result", 0, False)
    assert text in received["values"]
    assert wire.received(PROVIDER) == []


def test_invalid_result_aborts_the_goal_and_is_reported_to_the_provider(wire: Wire) -> None:
    wire.send(goal(feedback=True), ASKER)
    wire.received(PROVIDER)
    assert wire.ask(said("action_feedback", values={"x": 1}), PROVIDER)[0]["level"] == "error"
    assert wire.received(ASKER) == []
    assert wire.ask(said("action_result", values={"x": 1}), PROVIDER)[0]["level"] == "error"
    (received,) = wire.received(ASKER)
    assert (received["status"], received["result"]) == (6, False)


def test_actions_and_goals_are_limited() -> None:
    wire = Wire(clients=2, limits=ClientLimits(services=1, calls=1))
    wire.send(provide(), PROVIDER)
    (status,) = wire.ask(provide(action="/more"), PROVIDER)
    assert "at most 1 actions" in status["msg"]
    wire.send(goal(), ASKER)
    (received,) = wire.ask(goal(), ASKER)
    assert received["values"] == "goal g is active already"
    (received,) = wire.ask(goal(id="h"), ASKER)
    assert received["values"] == "at most 1 goals may be active"


# Actions of the host


def test_host_executes_goals() -> None:
    wire = Wire()
    goals: list[Goal] = []
    wire.protocol.actions.serve(NAME, KIND, goals.append)
    received = wire.ask(provide())
    assert received == [error("advertise_action: action /fib is provided by the server only")]
    wire.send(goal(feedback=True))
    assert goals[0].request == {"order": 5}
    goals[0].feedback({"sequence": [0]})
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"})
    assert goals[0].cancelling
    goals[0].canceled()
    goals[0].succeed({"sequence": [1]})
    assert not goals[0].active
    assert [received["op"] for received in wire.received()] == ["action_feedback", "action_result"]


def test_host_may_reject_a_goal_or_fail(caplog: pytest.LogCaptureFixture) -> None:
    wire = Wire()

    def refuse(goal: Goal) -> None:
        if goal.request["order"] == 5:
            raise ServiceError("not five")
        raise KeyError

    wire.protocol.actions.serve(NAME, KIND, refuse)
    assert wire.ask(goal()) == [result("not five", 0, False)]
    received = wire.ask(goal(args={}))
    assert received[0] == result("Action /fib failed: internal error", 0, False)
    assert "KeyError" in caplog.text
    assert wire.ask(goal()) == [result("not five", 0, False)]
