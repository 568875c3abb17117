"""Actions of ROS 2: between clients, and of the host."""

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


def test_a_goal_reaches_its_provider_and_what_becomes_of_it_its_caller(wire: Wire) -> None:
    wire.send(goal(args={}, feedback=True), ASKER)
    assert wire.heard(PROVIDER) == [
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
    assert wire.heard(ASKER) == [told, result({"sequence": [0, 1, 1]}, 4, True)]
    assert wire.heard(PROVIDER) == wire.heard(OTHER) == []


def test_feedback_is_for_who_asked_for_it(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.send(said("action_feedback", values={"sequence": [0]}), PROVIDER)
    assert wire.heard(ASKER) == []


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
def test_a_goal_ends_in_the_ways_in_which_clients_say_so(
    wire: Wire, more: Message, expected: Message
) -> None:
    wire.send(goal(), ASKER)
    assert wire.heard(PROVIDER)
    assert wire.ask(said("action_result", **more), PROVIDER) == []
    assert wire.heard(ASKER) == [expected]


def test_a_cancelled_goal_has_a_good_result_of_status_5(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.heard(PROVIDER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"}, ASKER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"}, ASKER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "nope"}, ASKER)
    assert wire.heard(PROVIDER) == [said("cancel_action_goal")]
    wire.send(said("action_result", values={}, status=5, result=True), PROVIDER)
    assert wire.heard(ASKER) == [result({"sequence": []}, 5, True)]


def test_only_who_sent_a_goal_can_cancel_it_and_only_its_provider_end_it(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.heard(PROVIDER)
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"}, OTHER)
    wire.send(said("action_result", values={}, result=True), OTHER)
    assert wire.heard(PROVIDER) == wire.heard(ASKER) == []


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ({"action": "/nope"}, "Action /nope does not exist"),
        ({"args": {"orders": 1}}, "does not have a field orders"),
        ({"args": {"order": 1.5}}, "requires a int32"),
        ({"args": [1]}, "requires a"),
    ],
)
def test_a_goal_that_cannot_be_pursued_is_answered_at_once(
    wire: Wire, more: Message, text: str
) -> None:
    (heard,) = wire.ask(goal(**more), ASKER)
    assert (heard["op"], heard["status"], heard["result"]) == ("action_result", 0, False)
    assert text in heard["values"]
    assert wire.heard(PROVIDER) == []


def test_values_of_another_type_end_the_goal_and_are_the_providers_error(wire: Wire) -> None:
    wire.send(goal(feedback=True), ASKER)
    wire.heard(PROVIDER)
    assert wire.ask(said("action_feedback", values={"x": 1}), PROVIDER)[0]["level"] == "error"
    assert wire.heard(ASKER) == []
    assert wire.ask(said("action_result", values={"x": 1}), PROVIDER)[0]["level"] == "error"
    (heard,) = wire.heard(ASKER)
    assert (heard["status"], heard["result"]) == (6, False)


def test_a_provider_that_leaves_ends_its_goals(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.protocol.disconnect(wire.clients[PROVIDER], wire.now)
    assert wire.heard(ASKER) == [result("Action /fib: its provider has left", 6, False)]
    assert wire.protocol.actions.all == []


def test_a_caller_that_leaves_has_its_goals_cancelled(wire: Wire) -> None:
    wire.send(goal(), ASKER)
    wire.heard(PROVIDER)
    wire.protocol.disconnect(wire.clients[ASKER], wire.now)
    assert wire.heard(PROVIDER) == [said("cancel_action_goal")]
    assert wire.ask(said("action_result", values={}, status=5), PROVIDER) == []


def test_an_action_has_one_provider(wire: Wire) -> None:
    heard = wire.ask(provide(), OTHER)
    assert heard == [error("advertise_action: action /fib is provided by another client")]
    wire.send({"op": "unadvertise_action", "action": NAME}, OTHER)
    wire.send({"op": "unadvertise_action", "action": NAME}, PROVIDER)
    assert wire.ask(provide(), OTHER) == []


def test_actions_and_goals_are_counted() -> None:
    wire = Wire(clients=2, limits=ClientLimits(services=1, calls=1))
    wire.send(provide(), PROVIDER)
    (status,) = wire.ask(provide(action="/more"), PROVIDER)
    assert "at most 1 actions" in status["msg"]
    wire.send(goal(), ASKER)
    (heard,) = wire.ask(goal(), ASKER)
    assert heard["values"] == "goal g is active already"
    (heard,) = wire.ask(goal(id="h"), ASKER)
    assert heard["values"] == "at most 1 goals may be active"


# Of the host


def test_the_host_pursues_goals_too() -> None:
    wire = Wire()
    goals: list[Goal] = []
    wire.protocol.actions.serve(NAME, KIND, goals.append)
    heard = wire.ask(provide())
    assert heard == [error("advertise_action: action /fib is provided by the server only")]
    wire.send(goal(feedback=True))
    assert goals[0].request == {"order": 5}
    goals[0].feedback({"sequence": [0]})
    wire.send({"op": "cancel_action_goal", "action": NAME, "id": "g"})
    assert goals[0].cancelling
    goals[0].canceled()
    goals[0].succeed({"sequence": [1]})
    assert not goals[0].active
    assert [heard["op"] for heard in wire.heard()] == ["action_feedback", "action_result"]


def test_the_host_may_refuse_or_fall(caplog: pytest.LogCaptureFixture) -> None:
    wire = Wire()

    def refuse(goal: Goal) -> None:
        if goal.request["order"] == 5:
            raise ServiceError("not five")
        raise KeyError

    wire.protocol.actions.serve(NAME, KIND, refuse)
    assert wire.ask(goal()) == [result("not five", 0, False)]
    heard = wire.ask(goal(args={}))
    assert heard[0] == result("Action /fib failed: internal error", 0, False)
    assert "KeyError" in caplog.text
    assert wire.ask(goal()) == [result("not five", 0, False)]
