from __future__ import annotations

import socket

import pytest

from teleop.rosbridge.auth.origins import Origins

ORIGINS = Origins("127.0.0.1", frozenset({"https://lab.example"}))


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://localhost:8000", "localhost:9090"),
        ("http://127.0.0.1:8000", "127.0.0.1:9090"),
        ("http://[::1]:8000", "[::1]:9090"),
        ("http://192.168.1.7:8000", "192.168.1.7:9090"),
        ("https://lab.example", "192.168.1.7:9090"),
        ("robot.local:9090", "robot.local:9090"),  # jrosbridge, which is not a browser
    ],
)
def test_local_and_listed_origins_are_allowed(origin: str, host: str) -> None:
    assert ORIGINS.allow(origin, host)


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("https://evil.example", "127.0.0.1:9090"),
        ("null", "127.0.0.1:9090"),
        ("null", "null"),
        ("", ""),
        ("evil.example", "robot.local:9090"),
        ("file://", "127.0.0.1:9090"),
        ("", "127.0.0.1:9090"),
        ("http://[", "127.0.0.1:9090"),
        ("http://192.168.1.8", "192.168.1.7:9090"),
        ("http://lab.example", "127.0.0.1:9090"),
        ("http://rebound.example", "rebound.example"),  # a name that resolves to this machine
    ],
)
def test_foreign_origins_are_rejected(origin: str, host: str) -> None:
    assert not ORIGINS.allow(origin, host)


def test_file_origins_are_allowed_only_if_listed() -> None:
    origins = Origins.of("127.0.0.1", ["file://"])
    assert origins.allow("file://", "127.0.0.1:9090")
    assert not origins.allow("null", "127.0.0.1:9090")
    assert not origins.allow("https://evil.example", "127.0.0.1:9090")


LOOPBACK, NETWORK = (Origins.of(host, ["https://lab.example"]) for host in ("127.0.0.1", "0.0.0.0"))


@pytest.mark.parametrize(
    ("host", "allowed", "named"),
    [  # where only this machine listens, and where the network does
        ("lab.example", (True, True), (True, True)),
        ("localhost:9090", (True, True), (True, True)),
        ("127.0.0.2:80", (True, True), (True, True)),
        ("[::1]:9090", (True, True), (True, True)),
        ("", (True, True), (True, True)),
        ("192.168.1.7:8080", (False, True), (False, True)),
        (f"{socket.gethostname()}:8080", (False, True), (False, True)),
        ("evil.example", (False, True), (False, False)),
        ("evil.example:9090", (False, True), (False, False)),
        ("[::", (False, True), (False, False)),
        ("127.0.0.1.evil.example", (False, True), (False, False)),
    ],
)
def test_hosts_that_others_could_own_do_not_name_this_machine(
    host: str, allowed: tuple[bool, bool], named: tuple[bool, bool]
) -> None:
    assert (LOOPBACK.allow_host(host), NETWORK.allow_host(host)) == allowed
    assert (LOOPBACK.names_this_machine(host), NETWORK.names_this_machine(host)) == named
    assert Origins.of("robot.lan", []).names_this_machine("robot.lan:8080")
