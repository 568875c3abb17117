"""Tickets in memory."""

from __future__ import annotations

import pytest

from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Access, Role
from teleop.video import tickets as tickets_module
from teleop.video.tickets import Tickets


def access(holder: str) -> Access:
    return Access(holder, Role.VIEW, DEFAULT_RULES[Role.VIEW])


def test_a_holder_who_asks_without_end_loses_the_oldest_of_his_own_only() -> None:
    tickets = Tickets(lambda: 0.0)
    other = tickets.issue(access("other"))
    issued = [tickets.issue(access("headset")) for _ in range(101)]
    assert tickets.find(issued[0]) is None
    assert tickets.find(issued[1]) == access("headset")
    assert tickets.find(other) == access("other")


def test_all_tickets_together_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tickets_module, "_MAX_TICKETS", 5)
    tickets = Tickets(lambda: 0.0)
    issued = [tickets.issue(access(f"headset {number}")) for number in range(6)]
    assert tickets.find(issued[0]) is None
    assert tickets.find(issued[1]) is not None
