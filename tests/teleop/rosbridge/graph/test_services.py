"""Services that clients provide to each other."""

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


def test_call_is_forwarded_with_all_arguments_and_its_response_returned(
    wire: Wire,
) -> None:
    wire.send(call(args={"a": 2}), ASKER)
    assert wire.received(PROVIDER) == [
        {
            "op": "call_service",
            "id": "service_request:/add:1",
            "service": "/add",
            "args": {"a": 2, "b": 0},
        }
    ]
    assert wire.received(ASKER) == []
    wire.send(response(values={"sum": 2}, result=True), PROVIDER)
    assert wire.received(ASKER) == [answer({"sum": 2}, True)]
    assert wire.received(PROVIDER) == wire.received(OTHER) == []


def test_names_are_spelled_as_each_side_does() -> None:
    wire = Wire(clients=2)
    wire.send(provide(service="add"), PROVIDER)
    wire.send(call("/add/"), ASKER)
    (request,) = wire.received(PROVIDER)
    assert (request["service"], request["id"]) == ("add", "service_request:add:1")
    wire.send(response(service="add", values={}, result=True), PROVIDER)
    assert wire.received(ASKER)[0]["service"] == "/add/"


@pytest.mark.parametrize("result", [True, False, None, "no"])
def test_response_values_count_regardless_of_the_result_flag(wire: Wire, result: object) -> None:
    wire.send(call(), ASKER)
    wire.send(response(values={"sum": 42}, result=result), PROVIDER)
    assert wire.received(ASKER) == [answer({"sum": 42}, True)]


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ({"result": False}, "Service /add failed: its provider gave no reason"),
        ({"result": False, "values": "out of order"}, "Service /add failed: out of order"),
        ({"result": False, "values": ""}, "Service /add failed: its provider gave no reason"),
        ({"values": [1]}, "Service /add failed: its provider gave no reason"),
    ],
)
def test_response_without_values_is_a_failure(wire: Wire, more: Message, text: str) -> None:
    wire.send(call(), ASKER)
    assert wire.ask(response(**more), PROVIDER) == []
    assert wire.received(ASKER) == [answer(text, False)]


def test_successful_response_without_values_has_defaults(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.send(response(result=True), PROVIDER)
    assert wire.received(ASKER) == [answer({"sum": 0}, True)]


@pytest.mark.parametrize("values", [{"total": 1}, {"sum": "1"}, {"sum": 2**63}])
def test_invalid_response_fails_the_call_and_is_reported_to_the_provider(
    wire: Wire, values: Message
) -> None:
    wire.send(call(), ASKER)
    (status,) = wire.ask(response(values=values, result=True), PROVIDER)
    assert status["level"] == "error"
    assert status["msg"].startswith("service_response: ")
    (received,) = wire.received(ASKER)
    assert received["result"] is False
    assert received["values"].startswith("Service /add returned an invalid response: ")


@pytest.mark.parametrize("args", [{"c": 1}, {"a": 1.5}, [1, 2, 3], "x", {"a": None}, {"a": 2**70}])
def test_bad_arguments_never_reach_the_provider(wire: Wire, args: object) -> None:
    (received,) = wire.ask(call(args=args), ASKER)
    assert received["result"] is False
    assert wire.received(PROVIDER) == []


def test_services_have_one_type_and_the_hosts_cannot_be_replaced(wire: Wire) -> None:
    (status,) = wire.ask(provide("std_srvs/Empty"), OTHER)
    assert "already exists with type rospy_tutorials/srv/AddTwoInts" in status["msg"]
    wire.protocol.services.serve("/mine", "std_srvs/Empty", lambda *_: {})
    received = wire.ask(provide("std_srvs/Empty", "/mine"), OTHER)
    assert received == [error("advertise_service: service /mine is provided by the server only")]


def test_only_the_provider_can_respond(wire: Wire) -> None:
    wire.send(call(), ASKER)
    wire.send({"op": "set_level", "level": "warning"}, OTHER)
    (status,) = wire.ask(response(values={"sum": 13}, result=True), OTHER)
    assert (status["level"], "no pending request" in status["msg"]) == ("warning", True)
    assert wire.received(ASKER) == []


# Timeouts


@pytest.mark.parametrize("timeout", [0, -1, -1e300])
def test_caller_can_disable_the_timeout(wire: Wire, timeout: float) -> None:
    wire.send(call(timeout=timeout), ASKER)
    wire.wait(1e9)
    wire.send(response(values={"sum": 1}, result=True), PROVIDER)
    assert wire.received(ASKER) == [answer({"sum": 1}, True)]


@pytest.mark.parametrize("timeout", ["1", True, [], {}])
def test_invalid_timeout_fails_the_call(wire: Wire, timeout: object) -> None:
    (received,) = wire.ask(call(timeout=timeout), ASKER)
    assert (received["result"], received["values"]) == (
        False,
        "timeout must be a number of seconds",
    )


# Limits


def test_services_and_calls_are_limited() -> None:
    wire = Wire(clients=2, limits=ClientLimits(services=2, calls=2))
    for name in "abc":
        wire.send(provide(service=name), PROVIDER)
    assert [h["msg"] for h in wire.received(PROVIDER)] == [
        "advertise_service: at most 2 services may be provided"
    ]
    for _ in range(3):
        wire.send(call("a"), ASKER)
    (received,) = wire.received(ASKER)
    assert received["values"] == "at most 2 calls may be pending"


def test_call_id_may_follow_the_service_name(wire: Wire) -> None:
    wire.send({"op": "call_service", "service": "/add#7"}, ASKER)
    wire.send(response(values={"sum": 1}), PROVIDER)
    assert wire.received(ASKER) == [answer({"sum": 1}, True, "/add#7", "7")]


@pytest.mark.parametrize("compression", ["png", "none"])
def test_responses_are_encoded_as_requested(wire: Wire, compression: str) -> None:
    wire.send(call(compression=compression), ASKER)
    wire.send(response(values={"sum": 1}), PROVIDER)
    (received,) = wire.received(ASKER)
    assert received["op"] == ("png" if compression == "png" else "service_response")
