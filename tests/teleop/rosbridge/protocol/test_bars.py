"""Clients that are kept out for a time, by token or by address."""

from __future__ import annotations

from typing import Any

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credential, Credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Access, Role
from teleop.rosbridge.framing.outgoing_frames import POLICY_VIOLATION, CloseFrame
from teleop.rosbridge.protocol.protocol import Protocol
from tests.teleop.rosbridge.support import SECOND, Wire, decoded

ANONYMOUS = Access("", Role.VIEW, DEFAULT_RULES[Role.VIEW])


def wire_with_tokens() -> Wire:
    keys = []
    for name in ("one", "other"):
        access = Access(name, Role.OPERATE, DEFAULT_RULES[Role.OPERATE])
        keys.append(Credential(access, secret=name))
    return Wire(0, authenticator=Authenticator(Credentials(tuple(keys), ANONYMOUS), lambda: 0.0))


def granted(protocol: Protocol, name: str) -> Access:
    assert protocol.authenticator is not None
    credentials = protocol.authenticator.credentials
    return next(key.granted for key in credentials.keys if key.access.holder == name)


def outputs(wire: Wire, client: int) -> list[Any]:
    wire.protocol.timers.tick(wire.now)
    found = wire.protocol.connections.drain()
    return [decoded(output) for to, output in found if to == client]


def test_barred_token_is_kept_out_until_its_time_is_over_and_others_are_not() -> None:
    wire = wire_with_tokens()
    protocol = wire.protocol
    one, again, other, viewer = (
        protocol.connect(wire.now, "10.0.0.1:5", access)
        for access in (
            granted(protocol, "one"),
            granted(protocol, "one"),
            granted(protocol, "other"),
            None,
        )
    )
    gone = protocol.disconnect_for(one, "too wild", 10 * SECOND, wire.now)
    assert gone == [f"client {number} (10.0.0.1:5)" for number in (one, again)]
    assert {client for client, _ in protocol.connections.drain()} == {one, again}
    wire.now += 9 * SECOND
    back = protocol.connect(wire.now, "10.9.9.9:5", granted(protocol, "one"))
    assert outputs(wire, back) == [CloseFrame(POLICY_VIOLATION, "barred for another 1 s: too wild")]
    wire.now += SECOND
    back = protocol.connect(wire.now, "10.9.9.9:5", granted(protocol, "one"))
    assert outputs(wire, back) == []
    assert not any(one.closing for one in protocol.connections if one.id in (other, viewer, back))


def test_barred_address_gets_the_reason_and_is_let_in_with_a_token_only() -> None:
    wire = wire_with_tokens()
    protocol = wire.protocol
    viewer = protocol.connect(wire.now, "10.0.0.1:5")
    protocol.disconnect_for(viewer, "presses for fun", 60 * SECOND, wire.now)
    protocol.disconnect(viewer, wire.now)
    back = protocol.connect(wire.now, "10.0.0.1:6")
    protocol.receive(back, '{"op":"subscribe","topic":"/t","type":"std_msgs/String"}', wire.now)
    (status,) = outputs(wire, back)
    assert status["msg"] == "subscribe: barred for another 60 s: presses for fun"
    wire.now += 5 * SECOND
    (closed,) = outputs(wire, back)
    assert closed == CloseFrame(POLICY_VIOLATION, "barred for another 60 s: presses for fun")
    neighbour = protocol.connect(wire.now, "10.0.0.2:5")
    operator = protocol.connect(wire.now, "10.0.0.1:7", granted(protocol, "one"))
    wire.now += 6 * SECOND
    assert outputs(wire, neighbour) == outputs(wire, operator) == []


def test_without_tokens_a_barred_address_is_disconnected_at_once() -> None:
    wire = Wire(0)
    client = wire.protocol.connect(wire.now, "10.0.0.1:5")
    wire.protocol.disconnect_for(client, "why", 60 * SECOND, wire.now)
    back = wire.protocol.connect(wire.now, "10.0.0.1:6")
    assert outputs(wire, back) == [CloseFrame(POLICY_VIOLATION, "barred for another 60 s: why")]


def test_barred_clients_wait_for_a_token_in_few_places() -> None:
    wire = wire_with_tokens()
    viewer = wire.protocol.connect(wire.now, "10.0.0.1:5")
    wire.protocol.disconnect_for(viewer, "why", 60 * SECOND, wire.now)
    for port in range(40):
        wire.protocol.connect(wire.now, f"10.0.0.1:{port}")
    wire.protocol.timers.tick(wire.now)
    assert sum(not one.closing for one in wire.protocol.connections) <= 8
