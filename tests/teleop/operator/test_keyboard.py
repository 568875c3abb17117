"""Keys from a terminal that reports no release."""

from __future__ import annotations

import os

from teleop.operator.keyboard import HOLD, Keyboard, read_keys


def test_key_drives_while_it_repeats_and_no_longer() -> None:
    keyboard = Keyboard()
    keyboard.press("w", 0)
    twist, held = keyboard.twist(HOLD)
    assert held
    assert twist.linear[0] == keyboard.speed
    twist, held = keyboard.twist(HOLD + 1)
    assert not held
    assert not twist.linear.any()


def test_shift_is_faster_and_two_keys_add_up() -> None:
    keyboard = Keyboard()
    keyboard.press("A", 0)
    keyboard.press("W", 0)
    twist, _ = keyboard.twist(1)
    assert twist.linear[0] == keyboard.fast
    assert twist.angular[2] == keyboard.turn


def test_opposite_keys_cancel_and_space_lets_all_go() -> None:
    keyboard = Keyboard()
    keyboard.press("w", 0)
    keyboard.press("s", 0)
    assert not keyboard.twist(1)[0].linear.any()
    keyboard.press(" ", 2)
    assert keyboard.twist(3)[1] is False


def test_action_keys_are_no_motion() -> None:
    keyboard = Keyboard()
    assert [keyboard.press(k, 0) for k in ("e", "r", "t", "f", "q", "w", "x")] == [
        "estop",
        "reset",
        "take_over",
        "find",
        "quit",
        None,
        None,
    ]


def test_arrows_are_read_whole() -> None:
    read_end, write_end = os.pipe()
    os.write(write_end, b"w\x1b[A\x1b[Dq")
    keys = read_keys(read_end)
    os.close(read_end)
    os.close(write_end)
    assert keys == ["w", "\x1b[A", "\x1b[D", "q"]
    keyboard = Keyboard()
    for key in keys[1:3]:
        keyboard.press(key, 0)
    twist, _ = keyboard.twist(1)
    assert twist.linear[0] > 0.0
    assert twist.angular[2] > 0.0
