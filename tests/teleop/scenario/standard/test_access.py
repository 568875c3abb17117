"""Who may control the world: each service tried as a cheat, with and without tokens, in all ways there are."""

from __future__ import annotations

import pytest

from teleop.scenario.standard.access import RefereeAccess
from tests.teleop.scenario.standard.support import Desk, pose

ACTION = "/sim/simulate_steps"
ARGUMENTS = {
    "steps": 3,
    "scope": 255,
    "entity": "robot",
    "state": {},
    "set_pose": True,
    "name": "crate",
    "entity_resource": {"uri": "person"},
    "initial_pose": {"pose": pose(20.0, 4.0)},
}
"""With which something would happen."""


def services(desk: Desk) -> list[str]:
    found = [s.name for s in desk.protocol.services.all if s.kind.name.startswith("simulation_int")]
    assert len(found) == 22
    return found


def assert_refused(desk: Desk, client: int) -> None:
    """Try each service and the action as a client; nothing may happen, and each attempt is reported."""
    name = desk.protocol.connections.name(client)
    before = desk.stepped.stamp, desk.simulation.truth().map_from_base.position.tobytes()
    for service in services(desk):
        del desk.violations[:]
        known = desk.protocol.services.find(service)
        assert known is not None
        fields = {field.name for field in known.kind.request.fields}
        args = {name: value for name, value in ARGUMENTS.items() if name in fields}
        for spelt in (service, service[1:], f"{service}#7"):
            desk.send(client, op="call_service", service=spelt, args=args)
        answers = [o for o in desk.received(client) if o["op"] == "service_response"]
        assert [a["result"] for a in answers] == [False] * 3
        reason = "is the referee's; connect with the token"
        assert all(reason in a["values"] for a in answers), answers
        assert desk.violations == [(name, service)] * 3
    del desk.violations[:]
    desk.send(client, op="send_action_goal", id="g", action=ACTION, args={"steps": 3})
    (result,) = [o for o in desk.received(client) if o["op"] == "action_result"]
    assert result["result"] is False
    assert desk.violations == [(name, ACTION)]
    assert (desk.stepped.stamp, desk.simulation.truth().map_from_base.position.tobytes()) == before


@pytest.mark.slow
def test_client_without_token_controls_nothing_where_there_are_no_tokens(desk: Desk) -> None:
    client = desk.connect()
    assert_refused(desk, client)
    # What is not guarded is as it always was.
    desk.send(client, op="call_service", id="e", service="/teleop/estop")
    assert any(o.get("id") == "e" and o["result"] for o in desk.received(client))


def test_referee_may_present_its_token_later_and_a_wrong_one_ends_the_connection(
    desk: Desk,
) -> None:
    client, other = desk.connect(), desk.connect()
    desk.send(client, op="auth", token=desk.access.token)
    assert desk.ask(client, "step_simulation", steps=1)[0]
    desk.send(other, op="auth", token="x" * 43)
    assert desk.received(other)[-1]["op"] == "closed"
    assert desk.violations == []


def test_call_with_nonsense_for_arguments_is_reported_as_well(desk: Desk) -> None:
    client = desk.connect()
    desk.send(client, op="call_service", service="/sim/step_simulation", args={"steps": "many"})
    assert desk.received(client)[-1]["result"] is False
    assert [service for _, service in desk.violations] == ["/sim/step_simulation"]
    # A mistake of the referee is no violation.
    desk.ask(desk.referee, "step_simulation", steps="many")
    assert len(desk.violations) == 1


def test_nobody_can_offer_the_services_in_the_robots_place(desk: Desk) -> None:
    client = desk.connect()
    for service in services(desk):
        del desk.violations[:]
        kind = desk.protocol.services.find(service)
        assert kind is not None
        desk.send(client, op="advertise_service", service=service, type=kind.kind.name)
        assert desk.received(client)[-1]["op"] == "status"
        assert [name for _, name in desk.violations] == [service]
    del desk.violations[:]
    kind_of_action = "simulation_interfaces/action/SimulateSteps"
    desk.send(client, op="advertise_action", action=ACTION, type=kind_of_action)
    assert [name for _, name in desk.violations] == [ACTION]
    desk.done("step_simulation", steps=1)


def test_token_is_new_with_each_robot_and_hard_to_guess() -> None:
    tokens = {RefereeAccess(lambda client, service: None).token for _ in range(3)}
    assert len(tokens) == 3
    assert min(map(len, tokens)) >= 43


def test_token_appears_in_no_representation(desk: Desk) -> None:
    credentials = desk.access.credentials()
    assert desk.access.token not in repr(credentials) + repr(desk.access)
    access = desk.protocol.connections.access(desk.referee)
    assert desk.access.token not in repr(access)
