"""Held keys as a twist: with reports of releases, and in terminals that only repeat."""

from __future__ import annotations

import pytest

from teleop.operator.controls.key_events import Key, KeyEvent
from teleop.operator.controls.keyboard import NORMAL, TERMINAL_SILENCE, Keyboard
from teleop.operator.controls.repeat_timing import DELAY_MARGIN, UNMEASURED_DELAY, RepeatTiming
from teleop.operator.operating_data import gears

_MS = 1_000_000
_SPEED, _TURN = gears()[NORMAL].speed, gears()[NORMAL].turn


def _wants(board: Keyboard, now: int) -> tuple[float, float] | None:
    """What the keys request; None if none is held."""
    twist, held = board.twist(now)
    return (float(twist.linear[0]), float(twist.angular[2])) if held else None


def _hold(board: Keyboard, key: str, begin: int, end: int, *, delay: int, every: int = 33) -> None:
    """Hold a key [ms] as terminals show it: a press, and repeats after a delay."""
    board.take(Key(key), begin * _MS)
    for at in range(begin + delay, end, every):
        board.take(Key(key), at * _MS)


# ---- terminals that only repeat


@pytest.mark.parametrize("delay", [250, 400, 500, 600, 660])
def test_key_that_is_held_drives_without_a_stutter_from_the_first_stroke(delay: int) -> None:
    board = Keyboard()
    board.take(Key("w"), 0)
    due = delay
    for now in range(0, 3000, 10):
        if now == due:
            board.take(Key("w"), now * _MS)
            due += 30
        assert _wants(board, now * _MS) == (_SPEED, 0.0), now


def test_release_is_seen_soon_after_the_last_repeat_once_repeats_come() -> None:
    board = Keyboard()
    _hold(board, "w", 0, 2000, delay=660)
    last = board._newest // _MS
    assert _wants(board, (last + 100) * _MS) == (_SPEED, 0.0)
    assert _wants(board, (last + 150) * _MS) is None


def test_hold_of_a_tap_follows_the_measured_delay() -> None:
    board = Keyboard()
    assert not board.timing.measured
    assert board.timing.first_hold == UNMEASURED_DELAY + DELAY_MARGIN
    _hold(board, "w", 0, 1000, delay=250)
    assert board.timing.delays == (250 * _MS,)
    board.take(Key("a"), 5000 * _MS)
    assert _wants(board, 5300 * _MS) == (0.0, _TURN)
    assert _wants(board, 5320 * _MS) is None
    assert "0.31 s after its press (measured)" in board.unknown


def test_taps_of_a_finger_are_not_measured_as_the_terminals_delay() -> None:
    board = Keyboard()
    for at in (0, 300, 600):  # taps
        board.take(Key("w"), at * _MS)
    _hold(board, "w", 900, 2000, delay=500)
    assert board.timing.delays == (500 * _MS,)


def test_slow_jittering_connection_lengthens_the_hold() -> None:
    board = Keyboard()
    board.take(Key("w"), 0)
    now = 500
    for gap in (0, 30, 90, 10, 110, 20):
        now += gap
        board.take(Key("w"), now * _MS)
    assert board.timing.repeat_hold == 330 * _MS
    assert RepeatTiming((), (400 * _MS,)).repeat_hold == 500 * _MS


def test_second_key_makes_a_curve_for_as_long_as_it_is_held() -> None:
    board = Keyboard()
    _hold(board, "w", 0, 1000, delay=250)
    # From now on the terminal repeats the second key only.
    board.take(Key("a"), 1000 * _MS)
    for now in range(1250, 3000, 33):
        assert _wants(board, now * _MS) == (_SPEED, _TURN)
        board.take(Key("a"), now * _MS)
    last = board._newest // _MS
    # Whether the first is still held is not reported: the robot stops.
    assert _wants(board, (last + 150) * _MS) is None


def test_first_key_pressed_anew_drives_alone() -> None:
    board = Keyboard()
    _hold(board, "w", 0, 1000, delay=250)
    board.take(Key("a"), 1000 * _MS)
    assert _wants(board, 1100 * _MS) == (_SPEED, _TURN)
    board.take(Key("w"), 1200 * _MS)
    assert _wants(board, 1210 * _MS) == (_SPEED, 0.0)


def test_opposite_key_takes_the_place_of_the_first() -> None:
    board = Keyboard()
    board.take(Key("w"), 0)
    board.take(Key("down"), 10 * _MS)
    assert _wants(board, 20 * _MS) == (-_SPEED, 0.0)


def test_space_or_the_loss_of_the_window_let_all_go() -> None:
    board = Keyboard()
    board.take(Key("w"), 0)
    board.release_all()
    assert _wants(board, _MS) is None


@pytest.mark.parametrize("releases", [False, True])
def test_key_held_through_an_e_stop_drives_only_when_pressed_anew(releases: bool) -> None:
    board = Keyboard(reports_releases=releases)
    held = KeyEvent.REPEAT if releases else KeyEvent.PRESS
    board.take(Key("w"), 0)
    board.block(100 * _MS)
    now = 100
    for now in range(110, 3000, 30):
        board.take(Key("w", held), now * _MS)
        assert _wants(board, now * _MS) is None
    board.take(Key("w", KeyEvent.RELEASE), now * _MS)
    board.take(Key("w"), (now + 1000) * _MS)
    assert _wants(board, (now + 1010) * _MS) == (_SPEED, 0.0)


# ---- terminals that report releases


def test_reported_release_ends_the_motion_at_once_and_two_keys_are_independent() -> None:
    board = Keyboard(reports_releases=True)
    assert board.unknown == ""
    board.take(Key("w"), 0)
    board.take(Key("a"), 100 * _MS)
    board.take(Key("w", KeyEvent.REPEAT), 110 * _MS)
    assert _wants(board, 120 * _MS) == (_SPEED, _TURN)
    board.take(Key("a", KeyEvent.RELEASE), 200 * _MS)
    assert _wants(board, 200 * _MS) == (_SPEED, 0.0)
    board.take(Key("w", KeyEvent.RELEASE), 300 * _MS)
    assert _wants(board, 300 * _MS) is None


def test_terminal_that_answers_no_more_releases_all_keys() -> None:
    board = Keyboard(reports_releases=True)
    board.take(Key("w"), 0)
    for now in range(0, 5000, 100):
        board.answered(now * _MS)
        assert _wants(board, now * _MS) is not None
    assert _wants(board, 4900 * _MS + TERMINAL_SILENCE) is not None
    assert _wants(board, 4900 * _MS + TERMINAL_SILENCE + 1) is None
    # A late answer brings no key back.
    board.answered(9000 * _MS)
    assert _wants(board, 9000 * _MS) is None


# ---- both


def test_gears_are_shifted_within_their_number() -> None:
    board = Keyboard(reports_releases=True)
    board.take(Key("up"), 0)
    assert _wants(board, 0) == (_SPEED, 0.0)
    board.shift(99)
    assert _wants(board, 0) == (gears()[-1].speed, 0.0)
    board.shift(-1)
    assert _wants(board, 0) == (gears()[0].speed, 0.0)


def test_other_keys_are_no_motion() -> None:
    board = Keyboard()
    assert [board.take(Key(key), 0) for key in ("e", "q", "enter", "w")] == [False] * 3 + [True]
