"""Addresses of this machine."""

from __future__ import annotations

import socket
from ipaddress import IPv4Address

import pytest

from teleop.console.lan import own_addresses as module
from teleop.console.lan.own_addresses import own_addresses, own_names


def test_addresses_are_of_this_machine_and_not_loopback() -> None:
    for address in own_addresses():
        assert not IPv4Address(address).is_loopback
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind((address, 0))  # fails for addresses of others


def test_the_address_that_leads_outside_is_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_outside", lambda: "10.1.1.1")
    monkeypatch.setattr(module, "_of_interfaces", lambda: ["127.0.0.1", "172.17.0.1", "10.1.1.1"])
    assert own_addresses() == ["10.1.1.1", "172.17.0.1"]
    monkeypatch.setattr(module, "_outside", lambda: None)
    monkeypatch.setattr(module, "_of_interfaces", lambda: ["127.0.0.1"])
    assert own_addresses() == []


@pytest.mark.parametrize(
    ("host", "names"),
    [
        ("Robot-7", ["robot-7", "robot-7.local"]),
        ("robot.lab.example", ["robot", "robot.local"]),
        ("localhost", []),
        ("my robot", []),
        ("", []),
    ],
)
def test_names_are_those_that_can_stand_in_an_address(
    host: str, names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: host)
    assert own_names() == names
