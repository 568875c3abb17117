"""What the referee reads on the wire: it takes any frame without harm."""

from __future__ import annotations

import json
import math

import pytest

from teleop.ros_types import registry
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.scenario.referee.rules.command_in_force import sources
from teleop.scenario.referee.rules.wire_facts import DriveMessage, WireFacts

STICK = {"axes": [0.5, 1.0], "buttons": [0, 0, 0, 0, 1]}


def facts_of(*frames: str) -> WireFacts:
    """Return what the referee knows after frames of a client."""
    protocol = Protocol(registry())
    facts = WireFacts(lambda: 0)
    protocol.observers.add(facts)
    client = protocol.connect(0)
    for frame in frames:
        protocol.receive(client, frame, 0)
    return facts


def published(topic: str, message: object) -> str:
    return json.dumps({"op": "publish", "topic": topic, "msg": message})


def drives(facts: WireFacts) -> list[DriveMessage]:
    return [message for client in facts.clients.values() for message in client.drives]


@pytest.mark.parametrize(
    "frame",
    [
        "[" * 4000,
        '{"op": "publish", "topic": "/cmd_vel", "msg": ' + "[" * 2000,
        published("/cmd_vel", {"linear": {"x": 10**400}}),
        published("/cmd_vel", {"linear": {"x": "fast"}}),
        published("/cmd_vel", {"linear": 1}),
        published("/cmd_vel", {"linear": {"x": math.nan}}),
        published("/joy", {"axes": [10**400, 10**400], "buttons": [0, 0, 0, 0, 1]}),
        published("/joy", {"axes": [math.inf, 1.0], "buttons": [0, 0, 0, 0, 1]}),
        published("/joy", {"axes": {}, "buttons": {}}),
        published("/joy", STICK)[:-3],
    ],
    ids=lambda frame: frame[:60],
)
def test_frame_that_no_client_should_send_is_no_drive_message(frame: str) -> None:
    assert not drives(facts_of(frame))


def test_stick_is_a_drive_message() -> None:
    assert [message.moves for message in drives(facts_of(published("/joy", STICK)))] == [True]


@pytest.mark.parametrize("most", [1e300, 1.7e308])
def test_command_that_is_cut_to_what_the_robot_can_do_has_its_source(most: float) -> None:
    facts = facts_of(published("/cmd_vel", {"linear": {"x": most}, "angular": {"z": -most}}))
    [(client, message)] = sources(facts.clients, 0.7, -0.7, 0)
    assert message.forward == most
    assert client.drives == [message]
    assert not list(sources(facts.clients, 0.7, 0.7, 0))
