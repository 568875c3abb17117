"""What ``farsteer serve`` prints of the console page."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from teleop.robot.serving import page_invitation as module
from teleop.robot.serving.address import Address
from teleop.robot.serving.lan_access import LanAccess
from teleop.robot.serving.page_invitation import invitation, local_page_address, page_addresses

HERE = Address("ws://127.0.0.1:9090", "127.0.0.1", 9090, False, False, False, True)
LAN = Address("wss://0.0.0.0:9090", "0.0.0.0", 9090, True, True, False, True)
TOKEN = "a-token-of-an-operator-in-the-network"
ACCESS = LanAccess(TOKEN, Path("/state/token"), Path("/state/robot.crt"), "AB:CD")


class Terminal(io.TextIOWrapper):
    """Standard output that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def addresses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "own_addresses", lambda: ["192.168.1.7", "10.0.0.2"])


def test_address_of_the_page_is_printed() -> None:
    assert invitation(HERE).startswith("open      http://127.0.0.1:9090/ in a browser")
    six = Address("ws://[::1]:9090", "::1", 9090, False, False, False, True)
    assert "http://[::1]:9090/" in invitation(six)


def test_page_that_is_not_built_is_one_line_with_what_to_do() -> None:
    missing = Address("ws://127.0.0.1:9090", "127.0.0.1", 9090, False, False, False)
    for access in (None, ACCESS):
        text = invitation(missing, access)
        assert text.startswith("note: the console page is not built: `make env`")
        assert "\n" not in text


def test_every_address_of_the_machine_is_named_where_it_listens_everywhere() -> None:
    assert page_addresses(LAN) == ["https://192.168.1.7:9090/", "https://10.0.0.2:9090/"]
    assert local_page_address(LAN) == "https://127.0.0.1:9090/"
    assert local_page_address(HERE) == "http://127.0.0.1:9090/"


@pytest.mark.parametrize(("encoding", "drawn"), [("utf-8", True), ("ascii", False)])
def test_terminal_shows_token_and_code(
    encoding: str, drawn: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdout", Terminal(io.BytesIO(), encoding=encoding))
    text = invitation(LAN, ACCESS)
    assert f"https://192.168.1.7:9090/#token={TOKEN} " in text
    assert text.count(TOKEN) == 1
    assert ("\u2588" in text) == drawn
    assert "AB:CD" in text


def test_file_or_pipe_gets_neither_token_nor_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="utf-8"))
    text = invitation(LAN, ACCESS)
    assert "https://192.168.1.7:9090/ on a tablet" in text
    assert TOKEN not in text
    assert "\u2588" not in text
    assert "/state/token" in text


def test_own_tokens_leave_only_the_address_in_the_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", Terminal(io.BytesIO(), encoding="utf-8"))
    text = invitation(LAN, LanAccess())
    assert "\u2588" in text
    assert "token" not in text
    assert "certificate" not in text
