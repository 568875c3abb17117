"""Addresses of robots."""

from __future__ import annotations

import pytest

from teleop.console.robot_address import robot_origin
from teleop.errors import SettingError


@pytest.mark.parametrize(
    ("address", "origin"),
    [
        ("ws://127.0.0.1:9090", "ws://127.0.0.1:9090"),
        ("ws://robot.local:9090/", "ws://robot.local:9090"),
        ("wss://my_robot", "wss://my_robot:443"),
        ("ws://robot", "ws://robot:80"),
        ("WS://[2001:DB8::0:1]:9090", "ws://[2001:db8::1]:9090"),
    ],
)
def test_addresses_become_origins(address: str, origin: str) -> None:
    assert robot_origin(address) == origin


@pytest.mark.parametrize(
    "address",
    [
        *("", "robot", "robot:9090", "http://robot:9090", "file:///etc/passwd", "ws://", "ws:///x"),
        *("ws://robot:0", "ws://robot:99999", "ws://robot:x", "ws://user:word@robot:1"),
        *("ws://a;script-src *:1", "ws://a b:1", "ws://*:9090", "ws://[::1", "ws://[x]:1"),
        *("ws://robot:9090/path", "ws://robot:9090/?token=x", "ws://robot:9090/#x"),
        *("ws://röbot:1", "ws://-a:1", "ws://a..b:1", "ws://'self':1"),
    ],
)
def test_what_is_no_address_of_a_websocket_is_rejected_in_one_line(address: str) -> None:
    with pytest.raises(
        SettingError, match=r"^.* is not a robot's address: ws://HOST:PORT"
    ) as raised:
        robot_origin(address)
    assert "\n" not in str(raised.value)
