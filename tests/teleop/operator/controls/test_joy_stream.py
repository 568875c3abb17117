"""Which Joy message is due."""

from __future__ import annotations

from localization.types import Twist
from teleop.operator.controls.joy_stream import STANDSTILL, JoyStream

_AHEAD = Twist.planar(0.35, 0.0)


def test_stroke_begins_neutral_and_ends_with_a_release() -> None:
    joy = JoyStream()
    assert joy.next(STANDSTILL, False, disarmed=False) is None
    assert joy.next(_AHEAD, True, disarmed=False) == (STANDSTILL, True)
    assert joy.next(_AHEAD, True, disarmed=False) == (_AHEAD, True)
    assert joy.next(STANDSTILL, False, disarmed=False) == (STANDSTILL, False)
    assert joy.next(STANDSTILL, False, disarmed=False) is None


def test_robot_that_waits_for_a_neutral_stick_gets_it_while_the_key_is_held() -> None:
    joy = JoyStream()
    joy.next(_AHEAD, True, disarmed=False)
    assert joy.next(_AHEAD, True, disarmed=True) == (STANDSTILL, True)
    assert joy.next(_AHEAD, True, disarmed=True) == (STANDSTILL, True)
    assert joy.next(_AHEAD, True, disarmed=False) == (_AHEAD, True)
    joy.refused("send a neutral stick first")
    assert joy.next(_AHEAD, True, disarmed=False) == (STANDSTILL, True)
    assert joy.next(_AHEAD, True, disarmed=False) == (_AHEAD, True)
    joy.refused("client 3 drives")
    assert joy.next(_AHEAD, True, disarmed=False) == (_AHEAD, True)


def test_nothing_is_sent_for_a_robot_that_waits_while_nothing_is_held() -> None:
    joy = JoyStream()
    joy.refused("send a neutral stick first")
    assert joy.next(STANDSTILL, False, disarmed=True) is None
