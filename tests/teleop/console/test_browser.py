"""Opening a browser."""

from __future__ import annotations

import threading
import webbrowser

import pytest

from teleop.console.browser import open_in_browser


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that a browser was asked to open, on a machine without a screen."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    found: list[str] = []
    monkeypatch.setattr(webbrowser, "open", found.append)
    return found


@pytest.mark.parametrize("name", ["DISPLAY", "WAYLAND_DISPLAY", "BROWSER"])
def test_browser_is_opened_where_there_is_a_screen(
    name: str, opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, ":1")
    assert open_in_browser("http://127.0.0.1:9090/")
    for thread in threading.enumerate():
        if thread.name == "browser":
            thread.join()
    assert opened == ["http://127.0.0.1:9090/"]


def test_browsers_of_the_terminal_are_not_opened(opened: list[str]) -> None:
    assert not open_in_browser("http://127.0.0.1:9090/")
    assert opened == []
