"""Services that clients provide for each other."""

from __future__ import annotations

from typing import Any

import pytest

from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.message_types import Message
from tests.teleop.rosbridge.support import Wire, error

ASKER, PROVIDER, OTHER = 0, 1, 2
SUM = "rospy_tutorials/AddTwoInts"


def provide(kind: str = SUM, service: str = "/add") -> Message:
    return {"op": "advertise_service", "service": service, "type": kind}


def call(service: str = "/add", **more: Any) -> Message:
    return {"op": "call_service", "service": service, "id": "c", **more}


def response(number: int = 1, service: str = "/add", **more: Any) -> Message:
    identity = f"service_request:{service}:{number}"
    return {"op": "service_response", "service": service, "id": identity, **more}


def answer(values: object, good: bool, service: str = "/add", identity: object = "c") -> Message:
    return {
        "op": "service_response",
        "service": service,
        "values": values,
        "result": good,
        "id": identity,
    }


@pytest.fixture
def wire() -> Wire:
    wire = Wire(clients=3)
    wire.send(provide(), PROVIDER)
    return wire


def test_a_call_reaches_its_provider_with_all_arguments_and_the_answer_its_caller(
    wire: Wire,
) -> None:
    wire.send(call(args={"a": 2}), ASKER)
    assert wire.heard(PROVIDER) == [
        {
            "op": "call_service",
            "id": "service_request:/add:1",
            "service": "/add",
            "args": {"a": 2, "b": 0},
        }
    ]
    assert wire.heard(ASKER) == []
    wire.send(response(values={"sum": 2}, result=True), PROVIDER)
    assert wire.heard(ASKER) == [answer({"sum": 2}, True)]
    assert wire.heard(PROVIDER) == wire.heard(OTHER) == []


def test_a_client_may_call_what_it_provides_itself(wire: Wire) -> None:
    (request,) = wire.ask(call(args=[1, 2]), PROVIDER)
    assert request["args"] == {"a": 1, "b": 2}
    heard = wire.ask(response(values={"sum": 3}, result=True), PROVIDER)
    assert heard == [answer({"sum": 3}, True)]


def test_calls_are_numbered_and_may_be_answered_in_any_order(wire: Wire) -> None:
    for identity in (1, 2):
        wire.send(call(id=identity), ASKER)
    ids = [heard["id"] for heard in wire.heard(PROVIDER)]
    assert ids == ["service_request:/add:1", "service_request:/add:2"]
    for number in (2, 1):
        wire.send(response(number, values={"sum": number}, result=True), PROVIDER)
    assert [(h["id"], h["values"]["sum"]) for h in wire.heard(ASKER)] == [(2, 2), (1, 1)]


def test_names_come_back_as_each_side_wrote_them() -> None:
    wire = Wire(clients=2)
    wire.send(provide(service="add"), PROVIDER)
    wire.send(call("/add/"), ASKER)
    (request,) = wire.heard(PROVIDER)
    assert (request["service"], request["id"]) == ("add", "service_request:add:1")
    wire.send(response(service="add", values={}, result=True), PROVIDER)
    assert wire.heard(ASKER)[0]["service"] == "/add/"


@pytest.mark.parametrize("result", [True, False, None, "no"])
def test_values_count_whatever_the_provider_says_of_its_result(wire: Wire, result: object) -> None:
    wire.send(call(), ASKER)
    wire.send(response(values={"sum": 42}, result=result), PROVIDER)
    assert wire.heard(ASKER) == [answer({"sum": 42}, True)]


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ({"result": False}, "Service /add failed: its provider gave no reason"),
        ({"result": False, "values": "out of order"}, "Service /add failed: out of order"),
        ({"result": False, "values": ""}, "Service /add failed: its provider gave no reason"),
        ({"values": [1]}, "Service /add failed: its provider gave no reason"),
    ],
)
def test_a_provider_without_values_has_failed(wire: Wire, more: Message, text: str) -> None:
    wire.send(call(), ASKER)
    assert wire.ask(response(**more), PROVIDER) == []
    assert wire.heard(ASKER) == [answer(text, False)]


def test_a_good_answer_without_values_is_made_of_defaults(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.send(response(result=True), PROVIDER)
    assert wire.heard(ASKER) == [answer({"sum": 0}, True)]


@pytest.mark.parametrize("values", [{"total": 1}, {"sum": "1"}, {"sum": 2**63}])
def test_values_of_another_type_are_the_callers_no_and_the_providers_error(
    wire: Wire, values: Message
) -> None:
    wire.send(call(), ASKER)
    (status,) = wire.ask(response(values=values, result=True), PROVIDER)
    assert status["level"] == "error"
    assert status["msg"].startswith("service_response: ")
    (heard,) = wire.heard(ASKER)
    assert heard["result"] is False
    assert heard["values"].startswith("Service /add returned an invalid response: ")


@pytest.mark.parametrize("args", [{"c": 1}, {"a": 1.5}, [1, 2, 3], "x", {"a": None}, {"a": 2**70}])
def test_bad_arguments_never_reach_the_provider(wire: Wire, args: object) -> None:
    (heard,) = wire.ask(call(args=args), ASKER)
    assert heard["result"] is False
    assert wire.heard(PROVIDER) == []


def test_a_provider_that_leaves_fails_its_calls_at_once_and_leaves_no_ghost(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.protocol.disconnect(wire.clients[PROVIDER], wire.now)
    assert wire.heard(ASKER) == [answer("Service /add: its provider has left", False)]
    assert wire.protocol.services.all == []
    assert wire.ask(call(), ASKER) == [answer("Service /add does not exist", False)]
    assert wire.protocol.timers.due is None


def test_a_service_taken_back_fails_its_calls_and_its_late_answer_meets_no_other(
    wire: Wire,
) -> None:
    wire.send(call(), ASKER)
    wire.send({"op": "unadvertise_service", "service": "/add"}, PROVIDER)
    assert wire.heard(ASKER) == [answer("Service /add: its provider has left", False)]
    wire.send(provide(), PROVIDER)
    wire.send(call(), ASKER)
    assert [h["id"] for h in wire.heard(PROVIDER)][-1] == "service_request:/add:2"
    wire.send(response(1, values={"sum": 1}, result=True), PROVIDER)
    assert wire.heard(ASKER) == []


def test_taking_back_what_was_not_provided_is_no_error(wire: Wire) -> None:
    assert wire.ask({"op": "unadvertise_service", "service": "/add"}, OTHER) == []
    assert [service.name for service in wire.protocol.services.all] == ["/add"]


def test_a_caller_that_leaves_is_forgotten(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.protocol.disconnect(wire.clients[ASKER], wire.now)
    assert wire.protocol.timers.due is None
    wire.heard(PROVIDER)
    assert wire.ask(response(values={"sum": 1}, result=True), PROVIDER) == []


def test_the_last_to_provide_answers_and_who_was_there_before_takes_over_again(wire: Wire) -> None:
    wire.send(provide(), OTHER)
    wire.send(call(), ASKER)
    assert [h["id"] for h in wire.heard(OTHER)] == ["service_request:/add:1"]
    wire.protocol.disconnect(wire.clients[OTHER], wire.now)
    wire.heard(ASKER)
    wire.send(call(), ASKER)
    assert [h["id"] for h in wire.heard(PROVIDER)] == ["service_request:/add:1"]


def test_one_name_has_one_type_and_the_hosts_are_the_hosts(wire: Wire) -> None:
    (status,) = wire.ask(provide("std_srvs/Empty"), OTHER)
    assert "already exists with type rospy_tutorials/srv/AddTwoInts" in status["msg"]
    wire.protocol.services.serve("/mine", "std_srvs/Empty", lambda *_: {})
    heard = wire.ask(provide("std_srvs/Empty", "/mine"), OTHER)
    assert heard == [error("advertise_service: service /mine is provided by the server only")]


def test_only_the_provider_can_answer(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.send({"op": "set_level", "level": "warning"}, OTHER)
    (status,) = wire.ask(response(values={"sum": 13}, result=True), OTHER)
    assert (status["level"], "no pending request" in status["msg"]) == ("warning", True)
    assert wire.heard(ASKER) == []


# Time


def test_a_call_times_out_after_five_seconds(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.wait(4999)
    assert wire.heard(ASKER) == []
    wire.wait(1)
    text = "Timeout exceeded while waiting for service response: 5 s"
    assert wire.heard(ASKER) == [answer(text, False)]
    wire.heard(PROVIDER)
    assert wire.ask(response(values={"sum": 1}, result=True), PROVIDER) == []
    assert wire.heard(ASKER) == []


@pytest.mark.parametrize(("timeout", "last"), [(0.5, 500), (2, 2000), (60.0, 60_000)])
def test_the_caller_may_say_how_long_it_waits(wire: Wire, timeout: float, last: int) -> None:
    wire.send(call(timeout=timeout), ASKER)
    wire.wait(last - 1)
    assert wire.heard(ASKER) == []
    wire.wait(1)
    assert wire.heard(ASKER)[0]["result"] is False


@pytest.mark.parametrize("timeout", [0, -1, -1e300])
def test_a_caller_may_wait_for_ever(wire: Wire, timeout: float) -> None:
    wire.send(call(timeout=timeout), ASKER)
    assert wire.protocol.timers.due is None
    wire.wait(1e9)
    wire.send(response(values={"sum": 1}, result=True), PROVIDER)
    assert wire.heard(ASKER) == [answer({"sum": 1}, True)]


@pytest.mark.parametrize("timeout", ["1", True, [], {}])
def test_a_timeout_that_is_no_number_is_the_callers_no(wire: Wire, timeout: object) -> None:
    (heard,) = wire.ask(call(timeout=timeout), ASKER)
    assert (heard["result"], heard["values"]) == (False, "timeout must be a number of seconds")


def test_an_answer_in_time_leaves_no_timer(wire: Wire) -> None:
    wire.send(call(), ASKER)
    assert wire.protocol.timers.due == wire.now + 5_000_000_000
    wire.send(response(values={}, result=True), PROVIDER)
    assert wire.protocol.timers.due is None


# QueueLimits


def test_services_and_calls_are_counted() -> None:
    wire = Wire(clients=2, limits=ClientLimits(services=2, calls=2))
    for name in "abc":
        wire.send(provide(service=name), PROVIDER)
    assert [h["msg"] for h in wire.heard(PROVIDER)] == [
        "advertise_service: at most 2 services may be provided"
    ]
    for _ in range(3):
        wire.send(call("a"), ASKER)
    (heard,) = wire.heard(ASKER)
    assert heard["values"] == "at most 2 calls may be pending"


def test_an_old_clients_id_may_stand_behind_the_name(wire: Wire) -> None:
    wire.send({"op": "call_service", "service": "/add#7"}, ASKER)
    wire.send(response(values={"sum": 1}), PROVIDER)
    assert wire.heard(ASKER) == [answer({"sum": 1}, True, "/add#7", "7")]


@pytest.mark.parametrize("compression", ["png", "none"])
def test_an_answer_is_packed_as_the_caller_wishes(wire: Wire, compression: str) -> None:
    wire.send(call(compression=compression), ASKER)
    wire.send(response(values={"sum": 1}), PROVIDER)
    (heard,) = wire.heard(ASKER)
    assert heard["op"] == ("png" if compression == "png" else "service_response")
