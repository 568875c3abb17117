"""Runs of clients that never end by themselves are not waited for as long as a person's are."""

from __future__ import annotations

import pytest

from teleop.scenario.session import over_socket


@pytest.fixture(autouse=True)
def _little_linger(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(over_socket, "LINGER", 1.0)
