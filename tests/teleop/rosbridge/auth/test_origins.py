from __future__ import annotations

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
