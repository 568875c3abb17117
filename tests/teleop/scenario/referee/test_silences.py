"""What a robot does after its driver has fallen silent, measured of ticks made by hand."""

from __future__ import annotations

from typing import Any

import pytest

from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.robot.safety.control_state import ControlMode
from teleop.scenario.referee.silences import Silences
from tests.teleop.scenario.referee.ticks import Ticks

ARMED, DISARMED = ControlMode.ARMED, ControlMode.DISARMED
IDLE, ESTOP = ControlMode.IDLE, ControlMode.ESTOP


class Drive:
    """A robot that is driven, tick by tick."""

    def __init__(self) -> None:
        self.silences, self.ticks = Silences(), Ticks()
        self.notes: list[str] = []
        self.age = 0

    def tick(self, **options: Any) -> None:
        note = self.silences.take(self.ticks.tick(**options))
        self.notes += [note] if note else []

    def driven(self, speed: float, ticks: int, *, driver: str = "ann", every: int = 5) -> None:
        """Drive with a command in every so many ticks, the first of them included."""
        for i in range(ticks):
            self.age = i % every * TICK_NS
            self.tick(speed=speed, command=speed, mode=ARMED, driver=driver, age=self.age)

    def silent(self, speed: float, ticks: int, **options: Any) -> None:
        """Go on by the last command, which grows old."""
        options = {"mode": ARMED, "driver": "ann", "command": speed, **options}
        for _ in range(ticks):
            self.age += TICK_NS
            self.tick(speed=speed, age=self.age, **options)

    def braking(self, *speeds: float, **options: Any) -> None:
        """Slow down, with no command in force."""
        options = {"mode": DISARMED, "driver": "ann", "reason": "no command", **options}
        for speed in speeds:
            self.age += TICK_NS
            self.tick(speed=speed, age=self.age, **options)


def test_stop_by_the_watchdog_is_measured_from_the_last_command_to_rest() -> None:
    drive = Drive()
    drive.driven(0.5, 11)  # the last command is obeyed in the eleventh tick
    drive.silent(0.5, 24)
    drive.braking(0.4, 0.2, 0.0, 0.0, 0.0)
    silences = drive.silences
    # By hand: 1 + 24 ticks at 0.5 m/s, one at 0.4 and one at 0.2; at rest at the end of the third.
    assert silences.longest_way == pytest.approx(0.02 * (25 * 0.5 + 0.4 + 0.2))
    assert silences.longest_time == pytest.approx(0.02 * 28)
    assert silences.oldest_command == pytest.approx(0.48)
    assert silences.count == 1
    assert drive.notes == ["stopped: no command"]


def test_driver_that_disconnects_between_its_commands_is_measured_from_the_last_one() -> None:
    drive = Drive()
    drive.driven(0.5, 13)  # the last command is obeyed in the eleventh tick
    drive.braking(0.3, 0.0, mode=IDLE, driver="", reason="ann disconnected")
    assert drive.silences.longest_way == pytest.approx(0.02 * (3 * 0.5 + 0.3))
    assert drive.silences.longest_time == pytest.approx(0.02 * 5)
    assert drive.notes == ["stopped: ann disconnected"]


def test_neutral_stick_is_no_stop_of_the_robot_itself() -> None:
    drive = Drive()
    drive.driven(0.5, 10)
    for speed in (0.4, 0.2, 0.0, 0.0):
        drive.tick(speed=speed, mode=ARMED, driver="ann", reason="neutral")
    assert drive.silences.count == 0
    assert drive.silences.longest_time == drive.silences.longest_way == 0.0
    assert drive.notes == []


def test_estop_is_a_stop() -> None:
    drive = Drive()
    drive.driven(0.5, 10, every=1)
    drive.braking(0.4, 0.0, mode=ESTOP, driver="", reason="e-stop by bob")
    assert drive.silences.count == 1
    assert drive.silences.longest_time == pytest.approx(0.06)
    assert drive.notes == ["stopped: e-stop by bob"]


def test_robot_at_rest_that_loses_its_driver_has_not_stopped() -> None:
    drive = Drive()
    drive.driven(0.0, 10)
    drive.braking(0.0, mode=IDLE, driver="", reason="ann disconnected")
    assert drive.silences.count == 0
    assert drive.silences.longest_time == 0.0
    assert drive.notes == ["not driven any more, at rest: ann disconnected"]


def test_robot_that_was_about_to_move_has_been_stopped() -> None:
    drive = Drive()
    drive.tick(mode=ARMED, driver="ann", command=0.5, speed=0.0)
    drive.braking(0.0, mode=IDLE, driver="", reason="ann disconnected")
    assert drive.silences.count == 1


def test_robot_that_never_stops_is_measured_up_to_the_end() -> None:
    drive = Drive()
    drive.driven(0.5, 1)
    drive.silent(0.5, 149)
    assert drive.silences.count == 0, "it says nothing of it"
    assert drive.silences.longest_way == pytest.approx(0.02 * 150 * 0.5)
    assert drive.silences.longest_time == pytest.approx(3.0)
    assert drive.silences.oldest_command == pytest.approx(2.98)


def test_robot_that_drives_on_without_any_driver_is_measured_too() -> None:
    drive = Drive()
    drive.driven(0.5, 1)
    for _ in range(99):
        drive.tick(speed=0.5, command=0.5, mode=IDLE, driver="", age=0)
    assert drive.silences.longest_way == pytest.approx(1.0)
    assert drive.silences.longest_time == pytest.approx(2.0)
    assert drive.silences.oldest_command == pytest.approx(1.98)


def test_commands_that_keep_coming_are_no_silence() -> None:
    drive = Drive()
    drive.driven(0.5, 500, every=25)
    assert drive.silences.longest_time == drive.silences.longest_way == 0.0
    assert drive.silences.oldest_command == pytest.approx(0.48)


def test_second_silence_is_measured_by_itself_and_the_longest_counts() -> None:
    drive = Drive()
    for ticks in (24, 10):
        drive.driven(0.5, 6)
        drive.silent(0.5, ticks)
        drive.braking(0.0)
    assert drive.silences.count == 2
    assert drive.silences.longest_time == pytest.approx(0.02 * 26)
    assert drive.silences.longest_way == pytest.approx(0.02 * 25 * 0.5)


def test_driver_who_drives_on_before_rest_ends_the_measurement() -> None:
    drive = Drive()
    drive.driven(0.5, 1)
    drive.silent(0.5, 24)
    drive.braking(0.4)
    drive.driven(0.5, 1000)
    assert drive.silences.count == 1
    assert drive.silences.longest_way == pytest.approx(0.02 * (25 * 0.5 + 0.4))


def test_neutral_stick_of_a_robot_that_still_rolls_does_not_end_the_measurement() -> None:
    drive = Drive()
    drive.driven(0.5, 1)
    drive.silent(0.5, 24)
    drive.braking(0.4)
    drive.tick(speed=0.2, mode=ARMED, driver="ann", age=0)
    drive.tick(speed=0.0, mode=ARMED, driver="ann", age=TICK_NS)
    assert drive.silences.longest_way == pytest.approx(0.02 * (25 * 0.5 + 0.4 + 0.2))
    assert drive.silences.longest_time == pytest.approx(0.02 * 28)


def test_take_over_stops_the_robot_that_another_one_drove() -> None:
    drive = Drive()
    drive.driven(0.5, 10)
    drive.tick(speed=0.4, mode=DISARMED, driver="bob", age=0, reason="bob took over")
    drive.tick(speed=0.0, mode=DISARMED, driver="bob", age=TICK_NS)
    assert drive.silences.count == 1
    assert drive.silences.longest_time == pytest.approx(0.04), "of the command that took over"


def test_kidnap_is_no_way_of_a_robot_without_driver() -> None:
    drive = Drive()
    drive.driven(0.5, 1)
    drive.age += TICK_NS
    drive.tick(x=0.01, speed=0.5, mode=ARMED, driver="ann", command=0.5, age=drive.age)
    drive.braking(0.0, x=80.0)
    assert drive.silences.longest_way == pytest.approx(0.02)


def test_turning_on_the_spot_is_no_rest() -> None:
    drive = Drive()
    drive.driven(0.5, 1)
    for turning in (0.5, 0.021):
        drive.braking(0.0, turning=turning)
    assert drive.silences.longest_time == pytest.approx(0.06)
    drive.braking(0.0, turning=0.019)
    drive.braking(0.0, turning=0.5)
    assert drive.silences.longest_time == pytest.approx(0.08)


def test_command_that_was_late_is_old_when_it_is_obeyed() -> None:
    drive = Drive()
    drive.tick(speed=0.1, command=0.5, mode=ARMED, driver="ann", age=3 * SECOND // 10)
    assert drive.silences.oldest_command == pytest.approx(0.3)
