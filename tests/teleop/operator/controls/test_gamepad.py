"""Gamepads: stick, deadman, unplugging; and the events of pygame, if it is installed."""

from __future__ import annotations

from typing import Any

import pytest

from teleop.operator.controls.gamepad import (
    DEADMAN,
    TURBO,
    ButtonChanged,
    Gamepad,
    PadChanged,
    StickMoved,
)
from teleop.operator.operating_data import gears


def _wants(pad: Gamepad) -> tuple[float, float] | None:
    twist, held = pad.twist(1)
    return (float(twist.linear[0]), float(twist.angular[2])) if held else None


@pytest.fixture
def pad() -> Gamepad:
    """A pad whose stick is pushed ahead and to the right."""
    pad = Gamepad()
    pad.take(PadChanged(7, "Pad", present=True))
    pad.take(StickMoved(7, 1, -1.0))
    pad.take(StickMoved(7, 0, 1.0))
    return pad


def test_stick_drives_only_while_the_deadman_is_held(pad: Gamepad) -> None:
    assert pad.names == ("Pad",)
    assert _wants(pad) is None
    pad.take(ButtonChanged(7, DEADMAN, pressed=True))
    assert _wants(pad) == (0.5, -1.2)
    pad.take(ButtonChanged(7, TURBO, pressed=True))
    assert _wants(pad) == (gears()[-1].speed, -gears()[-1].turn)
    pad.take(ButtonChanged(7, DEADMAN, pressed=False))
    assert _wants(pad) is None


def test_unplugged_pad_is_neutral_and_needs_its_deadman_anew(pad: Gamepad) -> None:
    pad.take(ButtonChanged(7, DEADMAN, pressed=True))
    pad.take(PadChanged(7, "", present=False))
    assert _wants(pad) is None
    assert pad.names == ()
    pad.take(StickMoved(7, 1, -1.0))
    pad.take(PadChanged(7, "Pad", present=True))
    assert _wants(pad) is None
    pad.take(ButtonChanged(7, DEADMAN, pressed=True))
    assert _wants(pad) == (0.0, 0.0)


def test_deadman_held_through_an_e_stop_must_be_pressed_anew(pad: Gamepad) -> None:
    pad.take(ButtonChanged(7, DEADMAN, pressed=True))
    pad.block()
    assert _wants(pad) is None
    pad.take(ButtonChanged(7, DEADMAN, pressed=False))
    pad.take(ButtonChanged(7, DEADMAN, pressed=True))
    assert _wants(pad) is not None


def test_stick_near_its_middle_is_at_rest_and_the_rest_is_rescaled(pad: Gamepad) -> None:
    pad.take(ButtonChanged(7, DEADMAN, pressed=True))
    for value, speed in ((0.11, 0.0), (-0.56, 0.25), (-2.0, 0.5), (float("nan"), 0.0)):
        pad.take(StickMoved(7, 1, value))
        assert pad.twist(1)[0].linear[0] == pytest.approx(speed)


def test_buttons_are_actions(pad: Gamepad) -> None:
    pressed = [pad.take(ButtonChanged(7, b, pressed=True)) for b in (1, 8, 9, 3, 0)]
    assert pressed == ["estop", "reset", "take_over", "find", None]
    assert pad.take(ButtonChanged(7, 1, pressed=False)) is None
    assert pad.take(ButtonChanged(99, 1, pressed=True)) is None  # of no known pad


def test_events_of_pygame_are_those_of_the_standard_layout() -> None:
    try:
        import pygame
    except ImportError:
        from teleop.operator.controls.pygame_pads import open_pads

        assert open_pads() is None
        return
    from teleop.operator.controls.pygame_pads import PygamePads

    pads = PygamePads()
    try:
        pads.poll()

        def post(kind: int, **values: Any) -> None:
            pygame.event.post(pygame.event.Event(kind, instance_id=3, **values))

        post(pygame.CONTROLLERAXISMOTION, axis=1, value=-32768)
        post(pygame.CONTROLLERAXISMOTION, axis=4, value=9)  # a trigger
        post(pygame.CONTROLLERBUTTONDOWN, button=9)
        post(pygame.CONTROLLERBUTTONUP, button=9)
        post(pygame.CONTROLLERBUTTONDOWN, button=5)  # the guide button
        post(pygame.CONTROLLERDEVICEREMOVED)
        assert pads.poll() == [
            StickMoved(3, 1, -1.0),
            ButtonChanged(3, DEADMAN, pressed=True),
            ButtonChanged(3, DEADMAN, pressed=False),
            PadChanged(3, "", present=False),
        ]
        assert pads.poll() == []
    finally:
        pads.close()
