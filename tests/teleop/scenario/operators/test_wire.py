"""A client in memory is a client as any other: the same frames, permissions and ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from teleop.link.emulation import LinkConfig, LinkEmulation
from teleop.ros_types import registry
from teleop.rosbridge import Authenticator, Protocol, read_credentials
from teleop.rosbridge.auth.permissions import UNGUARDED
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.scenario.operators.memory_transport import MemoryTransport, WireError
from teleop.scenario.operators.wire import Answer

SECOND = 1_000_000_000
JOY = {"axes": [0.0, 1.0], "buttons": [0, 0, 0, 0, 1]}


class Host(Observer):
    """A protocol with a clock of its own, and what it sees of its clients."""

    def __init__(self, **options: Any) -> None:
        self.now = 0
        self.protocol = Protocol(registry(), **options)
        self.protocol.observers.add(self)
        self.transport = MemoryTransport(self.protocol, lambda: self.now)
        self.joys: list[tuple[int, dict[str, Any], int]] = []
        self.left: list[int] = []
        self.protocol.topics.subscribe(
            "/joy", "sensor_msgs/msg/Joy", lambda *args: self.joys.append(args)
        )
        self.protocol.topics.advertise("/clock", "rosgraph_msgs/msg/Clock")
        self.protocol.services.serve(
            "/double", "std_srvs/srv/SetBool", lambda client, request, now: {"success": True}
        )

    def disconnected(self, connection: Connection, now: int) -> None:
        self.left.append(connection.id)

    def say(self, sec: int) -> None:
        self.protocol.topics.publish("/clock", {"clock": {"sec": sec, "nanosec": 0}}, self.now)

    def pass_time(self, seconds: float) -> None:
        self.now += round(seconds * SECOND)
        self.protocol.timers.tick(self.now)


def test_what_is_published_arrives_with_the_time_of_the_clock() -> None:
    host = Host()
    wire = host.transport.connect()
    host.pass_time(1.5)
    wire.publish("/joy", "sensor_msgs/Joy", {"header": {"stamp": wire.stamp}, **JOY})
    [(client, message, now)] = host.joys
    assert (client, now) == (wire.client, 1_500_000_000)
    assert list(message["axes"]) == [0.0, 1.0]
    assert message["header"]["stamp"] == {"sec": 1_700_000_001, "nanosec": 500_000_000}


def test_messages_wait_until_they_are_delivered() -> None:
    host = Host()
    wire = host.transport.connect()
    seen: list[dict[str, Any]] = []
    wire.subscribe("/clock", "rosgraph_msgs/Clock", seen.append)
    host.say(1)
    host.say(2)
    assert seen == []
    wire.deliver()
    assert [message["clock"]["sec"] for message in seen] == [1, 2]


def test_throttled_topic_comes_at_its_rate_and_its_last_message_late() -> None:
    host = Host()
    wire = host.transport.connect()
    seen: list[dict[str, Any]] = []
    wire.subscribe("/clock", "rosgraph_msgs/Clock", seen.append, throttle_rate=1000)
    for second in range(3):
        host.say(second)
        host.pass_time(0.4)
    wire.deliver()
    assert [message["clock"]["sec"] for message in seen] == [0, 2]


def test_call_is_answered_and_a_failure_says_why() -> None:
    host = Host()
    wire = host.transport.connect()
    answers: list[Answer] = []
    wire.call("/double", "std_srvs/SetBool", {"data": True}, answers.append)
    wire.call("/no/such", on_answer=answers.append)
    assert answers == []
    wire.deliver()
    assert answers == [
        Answer({"success": True, "message": ""}),
        Answer({}, "Service /no/such does not exist"),
    ]


def test_invalid_message_is_answered_with_a_status() -> None:
    host = Host()
    wire = host.transport.connect()
    wire.publish("/joy", "sensor_msgs/Joy", {"axes": "full ahead"})
    wire.deliver()
    [status] = wire.statuses
    assert status.level == "error"
    assert "axes" in status.text


def test_callback_may_publish() -> None:
    host = Host()
    wire = host.transport.connect()
    wire.subscribe(
        "/clock", "rosgraph_msgs/Clock", lambda _: wire.publish("/joy", "sensor_msgs/Joy", JOY)
    )
    host.say(1)
    assert host.joys == []
    wire.deliver()
    assert len(host.joys) == 1


SECRET = "a secret of 16 characters"


@pytest.fixture
def guarded(tmp_path: Path) -> Host:
    """A protocol that nobody may use without a token."""
    file = tmp_path / "tokens.toml"
    file.write_text(f'[tokens.driver]\ntoken = "{SECRET}"\nrole = "operate"\n')
    file.chmod(0o600)
    return Host(authenticator=Authenticator(read_credentials(file), lambda: 0.0))


def test_token_is_shown_at_the_connection_or_by_an_operation(guarded: Host) -> None:
    early, late = guarded.transport.connect(token=SECRET), guarded.transport.connect()
    early.publish("/joy", "sensor_msgs/Joy", JOY)
    late.send({"op": "auth", "token": SECRET})
    late.publish("/joy", "sensor_msgs/Joy", JOY)
    assert [client for client, _, _ in guarded.joys] == [early.client, late.client]


def test_client_without_a_token_is_refused_what_needs_one(guarded: Host) -> None:
    wire = guarded.transport.connect()
    wire.publish("/joy", "sensor_msgs/Joy", JOY)
    wire.deliver()
    assert guarded.joys == []
    assert "token is required" in wire.statuses[-1].text


def test_wrong_token_does_not_connect(guarded: Host) -> None:
    with pytest.raises(WireError, match="token is not accepted"):
        guarded.transport.connect(token="another one of 16 characters")


def test_host_may_grant_access_without_a_token(guarded: Host) -> None:
    wire = guarded.transport.connect(access=UNGUARDED)
    wire.publish("/joy", "sensor_msgs/Joy", JOY)
    assert len(guarded.joys) == 1


def test_closed_wire_sends_nothing_and_the_robot_knows() -> None:
    host = Host()
    wire = host.transport.connect()
    wire.close()
    assert host.left == [wire.client]
    assert wire.closed == "closed by the client"
    wire.publish("/joy", "sensor_msgs/Joy", JOY)
    assert host.joys == []


def test_client_that_the_robot_disconnects_learns_the_reason_and_leaves() -> None:
    host = Host()
    wire = host.transport.connect()
    host.protocol.connections.close(wire.client, 1008, "rate limit exceeded")
    assert wire.closed == "rate limit exceeded"
    host.pass_time(0.02)
    assert host.left == [wire.client]


def test_hung_client_stays_connected_and_does_nothing() -> None:
    host = Host()
    wire = host.transport.connect()
    seen: list[dict[str, Any]] = []
    wire.subscribe("/clock", "rosgraph_msgs/Clock", seen.append)
    host.say(1)
    wire.hang()
    host.say(2)
    wire.deliver()
    wire.publish("/joy", "sensor_msgs/Joy", JOY)
    assert (seen, host.joys, host.left, wire.closed) == ([], [], [], None)


def test_link_delays_both_directions_and_the_end() -> None:
    link = LinkEmulation(LinkConfig.parse(("delay=0.3",)))
    host = Host(frame_delay=link)
    wire = host.transport.connect()
    seen: list[dict[str, Any]] = []
    wire.subscribe("/clock", "rosgraph_msgs/Clock", seen.append)
    host.pass_time(0.3)
    wire.publish("/joy", "sensor_msgs/Joy", JOY)
    host.say(1)
    wire.deliver()
    assert (host.joys, seen) == ([], [])
    host.pass_time(0.3)
    wire.deliver()
    assert [now for _, _, now in host.joys] == [600_000_000]
    assert len(seen) == 1
    wire.close()
    assert host.left == []
    host.pass_time(0.3)
    assert host.left == [wire.client]


class _Kept:
    """Keeps what is sent."""

    def __init__(self) -> None:
        self.operations: list[tuple[int, str]] = []

    def add(self, now: int, operation: Any) -> None:
        self.operations.append((now, operation["op"]))


def test_recorder_gets_all_that_is_sent() -> None:
    host, kept = Host(), _Kept()
    wire = host.transport.connect(recorder=kept)
    host.pass_time(1.0)
    wire.publish("/joy", "sensor_msgs/Joy", JOY)
    wire.call("/double")
    assert kept.operations == [
        (SECOND, "advertise"),
        (SECOND, "publish"),
        (SECOND, "call_service"),
    ]
