"""What of the future is shown: commands on their way, and where the guard ends them."""

from __future__ import annotations

import math

import pytest

from teleop.prediction.command_history import CommandHistory, Followed
from teleop.prediction.foresight import SECONDS, foreseen
from teleop.prediction.predicted_motion import Command, DriveLimits

LIMITS = DriveLimits(0.5, 1.0, 2.0, 4.0, lag=0.04)


def says(at: float, forward: float, **more: float) -> Followed:
    """Return what a robot says that drives ahead."""
    return Followed(Command(at, forward, 0.0), **more)


def test_what_the_robot_says_takes_the_place_of_what_was_sent_before() -> None:
    history = CommandHistory()
    history.followed(says(10.0, 0.0))
    history.sent(Command(10.3, 0.5, 0.0))
    history.sent(Command(10.6, -0.5, 0.0))
    history.followed(says(10.1, 0.1, guard=0.5, late=0.8))
    # The guard limits the one that goes on, and not the one that turns back.
    assert [c.forward for c in history.commands()[2:]] == pytest.approx([0.2, -0.4])
    history.followed(says(10.45, 0.5))
    assert history.commands()[2:] == [Command(10.45, 0.5, 0.0), Command(10.6, -0.5, 0.0)]
    history.followed(says(13.0, 0.0))
    assert history.commands() == [Command(13.0, 0.0, 0.0)]
    history.followed(says(0.1, 0.0))
    assert history.commands() == [Command(0.1, 0.0, 0.0)]


def test_path_begins_where_a_command_sent_now_takes_effect_and_lasts_three_seconds() -> None:
    history = CommandHistory()
    for at in (8.0, 9.0, 10.0):
        history.followed(says(at, 0.5))
    shown = foreseen(history, 10.0, 10.6, LIMITS)
    assert shown.motions[shown.effect].x == pytest.approx(0.3)
    assert shown.motions[-1].x == pytest.approx(0.5 * (0.6 + SECONDS), abs=0.011)
    assert not shown.cut


@pytest.mark.parametrize("ahead", [1.0, 2.5])
def test_path_is_cut_where_the_guard_would_stop_it(ahead: float) -> None:
    history = CommandHistory()
    for at in (8.0, 9.0, 10.0):
        history.followed(says(at, 0.5, ahead=ahead))
    shown = foreseen(history, 9.9, 10.2, LIMITS)
    assert shown.cut
    assert shown.motions[-1].x == pytest.approx(0.5 * (0.1 + ahead), abs=0.02)


@pytest.mark.parametrize("turn", [0.0, 1.2])
def test_another_arc_than_the_guard_looked_at_is_not_cut(turn: float) -> None:
    history = CommandHistory()
    history.sent(Command(9.5, 0.5, 0.0))
    history.followed(says(10.0, 0.0, guard=0.0, ahead=0.0))
    assert history.asked == Command(9.5, 0.5, 0.0)
    history.sent(Command(10.3, -0.5, turn))
    shown = foreseen(history, 10.0, 10.3, LIMITS)
    assert not shown.cut
    assert math.hypot(shown.motions[-1].x, shown.motions[-1].y) > 0.5
