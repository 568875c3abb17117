"""What the referee notes of clients: who came and left and why, and what they tried and may not do."""

from __future__ import annotations

import json
from typing import Any

import pytest

from teleop.robot.topics.topic_table import SIMULATION_ACTION, SIMULATION_SERVICES
from teleop.ros_types import registry
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credentials
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.scenario.referee.outcome import EventKind
from teleop.scenario.session.client_watch import LISTED, ClientWatch


class Watched:
    """A protocol with a topic and a service of the robot's, its first client, and the notes about its clients."""

    def __init__(self, authenticator: Authenticator | None = None, **options: Any) -> None:
        self.protocol = Protocol(registry(), authenticator=authenticator)
        serve_standard(self.protocol)
        self.protocol.topics.advertise("/odom", "nav_msgs/msg/Odometry")
        self.protocol.topics.reserve("/ground_truth/odom")
        self.protocol.services.serve(
            "/teleop/estop", "std_srvs/srv/Trigger", lambda client, request, now: {}
        )
        self.notes: list[tuple[EventKind, str]] = []
        self.watch = ClientWatch(
            self.protocol, lambda kind, text: self.notes.append((kind, text)), **options
        )
        self.before = self.there
        self.client = self.protocol.connect(0)

    @property
    def there(self) -> tuple[bool, bool]:
        """Whether a client is there, and whether one ever was."""
        return self.watch.present, self.watch.ever

    def send(self, **operation: Any) -> None:
        self.protocol.receive(self.client, json.dumps(operation), 0)

    def leave(self) -> None:
        self.protocol.disconnect(self.client, 0)

    def said(self, kind: EventKind) -> list[str]:
        return [text for each, text in self.notes if each is kind]


def test_who_comes_and_leaves_is_noted() -> None:
    watched = Watched()
    assert (watched.before, watched.there) == ((False, False), (True, True))
    watched.leave()
    assert watched.there == (False, True)
    assert watched.said(EventKind.CLIENT) == ["client 1 connected", "client 1 left"]


def test_why_a_client_was_disconnected_is_noted() -> None:
    watched = Watched()
    watched.protocol.connections.close(watched.client, 1008, "for a reason")
    watched.leave()
    assert watched.said(EventKind.CLIENT)[1:] == ["client 1 was disconnected: for a reason"]


def test_a_client_that_owes_a_token_does_not_count() -> None:
    watched = Watched(Authenticator(Credentials(), lambda: 0.0))
    watched.send(op="auth", token="a-token-that-nobody-knows")
    assert watched.there == (False, False)
    assert watched.said(EventKind.CLIENT)[0] == "client 1 showed a token that is not known"


def test_who_leaves_once_the_run_is_over_was_there_and_who_comes_then_was_not() -> None:
    over = False
    watched = Watched(over=lambda: over)
    over = True
    watched.leave()
    assert watched.watch.present
    assert watched.said(EventKind.CLIENT) == ["client 1 connected", "client 1 left"]
    assert Watched(over=lambda: over).there == (False, False)


def test_the_referee_does_not_count() -> None:
    watched = Watched(is_referee=lambda connection: connection.id == 1)
    watched.send(op="publish", topic="/odom", msg={})
    assert (watched.watch.present, watched.notes) == (False, [])


@pytest.mark.parametrize("name", ["/odom", "odom", "/odom/", "//odom", "/ground_truth/odom"])
@pytest.mark.parametrize("op", ["publish", "advertise"])
def test_to_speak_as_the_robot_is_a_violation_however_the_topic_is_spelt(
    op: str, name: str
) -> None:
    watched = Watched()
    for _ in range(3):
        watched.send(op=op, topic=name, type="nav_msgs/Odometry", msg={})
    named = f"/{name.strip('/')}"
    assert watched.said(EventKind.VIOLATION) == [f"client 1 tried to {op} {named}"]


@pytest.mark.parametrize("name", ["/teleop/estop", "teleop/estop", "/sim/step"])
def test_to_answer_in_the_robots_place_is_a_violation(name: str) -> None:
    watched = Watched()
    watched.send(op="advertise_service", service=name, type="std_srvs/Trigger")
    (text,) = watched.said(EventKind.VIOLATION)
    assert text == f"client 1 tried to advertise_service /{name.strip('/')}"


CONTROLS = [
    (
        {"op": "call_service", "service": "/sim/step", "args": {"ticks": 1}},
        "call /sim/step while time goes by the clock",
    ),
    *(
        ({"op": "call_service", "service": service.name}, f"use {service.name}")
        for service in SIMULATION_SERVICES
    ),
    (
        {"op": "send_action_goal", "action": SIMULATION_ACTION.name, "args": {"steps": 9}},
        f"use {SIMULATION_ACTION.name}",
    ),
]
"""Operations that control time or the world, and what the referee notes of who tries them."""


@pytest.mark.parametrize(("operation", "what"), CONTROLS, ids=[what for _, what in CONTROLS])
def test_to_control_time_or_the_world_is_a_violation_and_refused(
    operation: dict[str, Any], what: str
) -> None:
    watched = Watched()
    watched.send(**{"args": {}, "id": "x", **operation})
    assert watched.said(EventKind.VIOLATION) == [f"client 1 tried to {what}"]
    answers = [json.loads(frame.payload) for _, frame in watched.protocol.connections.drain()]  # type: ignore[union-attr]
    assert [each["result"] for each in answers if each.get("id") == "x" and "result" in each] == [
        False
    ]


def test_a_parameter_that_is_set_is_noted_and_no_violation() -> None:
    watched = Watched()
    args = {"name": "/x", "value": "1"}
    watched.send(op="call_service", service="/rosapi/set_param", args=args)
    watched.send(op="call_service", service="/rosapi/get_param", args={"name": "/x"})
    assert watched.said(EventKind.CLIENT)[1:] == ["client 1 called /rosapi/set_param: /x"]
    assert watched.said(EventKind.VIOLATION) == []
    assert '"1"' in watched.protocol.connections.drain()[-1][1].payload.decode()  # type: ignore[union-attr]


def test_a_mistake_is_noted_once_and_no_violation() -> None:
    watched = Watched()
    for _ in range(10):
        watched.send(op="publish", topic="/nobodys", msg={})
    assert len(watched.said(EventKind.CLIENT)) == 2
    assert watched.said(EventKind.VIOLATION) == []


def test_a_client_cannot_fill_the_report() -> None:
    watched = Watched()
    for number in range(LISTED):
        watched.send(op="publish", topic="/odom", msg={})
        watched.leave()
        watched.client = watched.protocol.connect(number)
    for _ in range(3):
        watched.send(op="publish", topic="/odom", msg={})
    for kind in (EventKind.CLIENT, EventKind.VIOLATION):
        assert len(watched.said(kind)) == LISTED + 1
        assert watched.said(kind)[-1] == "further events of this kind are not listed"
