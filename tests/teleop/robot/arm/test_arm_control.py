"""The arm's control by itself: loads, what it asks of the vehicle, and what operators see and feel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from localization.types import Pose
from robot_sim.arm.arm_plant import ArmReading
from robot_sim.arm.clearance import Clearance
from teleop.robot.arm.arm_commands import Hand, JointJog, Stream
from teleop.robot.arm.arm_control import ArmControl
from teleop.robot.arm.arm_fit import ArmFit, unfelt
from teleop.robot.arm.arm_settings import ArmSettings, Permit
from teleop.robot.arm.arm_state import ArmState
from tests.teleop.robot.arm.support import STOW, TABLE

TICK = 20_000_000
IDLE = Permit("", engaged=False, stopped=False, reason="nobody moves the arm", estop="")
BUSY = Permit("ann", engaged=True, stopped=False, reason="", estop="")
TURN = JointJog((0.5, 0.0, 0.0, 0.0, 0.0))


class Bench:
    """A control whose arm is where it is commanded, in empty space; a test sets what else is measured."""

    def __init__(self, angles: np.ndarray[Any, Any] = STOW, **settings: Any) -> None:
        self.stamp = 0
        zeros = np.zeros(5)
        self.reading = ArmReading(0, angles, zeros, zeros, 0.0, 0.0, (), "", False, zeros)
        fit = ArmFit(TABLE, "bracket")
        self.control = ArmControl(fit, Clearance(TABLE), self.reading, ArmSettings(**settings))

    def tick(self, stream: Stream | None = None, ticks: int = 1, **measured: Any) -> ArmState:
        """Command and measure."""
        for _ in range(ticks):
            if stream is not None:
                self.control.follow("ann", stream, 1.0)
            command = self.control.tick(self.stamp, BUSY if stream is not None else IDLE)
            self.stamp += TICK
            fields: dict[str, Any] = {"stamp": self.stamp, "angles": command.angles} | measured
            self.reading = replace(self.reading, **fields)
            state = self.control.measure(self.reading)
        return state


def test_joint_that_bears_too_much_gives_way_and_says_so() -> None:
    bench = Bench(np.array(TABLE.poses["ready"]))
    stall = TABLE.joints[1].servo.torque(TABLE.supply)
    heavy = np.array([0.0, 0.95 * stall, 0.0, 0.0, 0.0])
    sagged = np.array(TABLE.poses["ready"]) - [0.0, 0.2, 0.0, 0.0, 0.0]
    ended = []
    for _ in range(40):
        bench.tick(TURN, torques=heavy, angles=sagged)
        ended.append(bench.control.stopped)
    assert "shoulder (arm_joint_2) bears 95%" in next(filter(None, ended))
    state = bench.tick(None, 40, torques=heavy, angles=sagged)
    assert state.mode == "held"
    assert "shoulder" in state.reason
    assert state.load[1] == pytest.approx(0.95)
    # Led only to where it is, a servo within its dead band and its play would push on with all its torque.
    relieved = sagged[1] - unfelt(TABLE)[1]
    assert state.wanted[1] == pytest.approx(relieved, abs=0.002), "it backs off past where it is"
    assert state.way_out == "stow"


def test_speed_off_the_stow_pose_is_a_setting() -> None:
    ready = np.array(TABLE.poses["ready"])
    assert Bench(ready).tick().speed_limit == 0.2
    assert Bench(ready, speed=0.35).tick().speed_limit == 0.35
    assert Bench(ready, speed=0.0).tick().speed_limit == np.inf


def test_operators_feel_contacts_grips_and_refusals_for_a_moment() -> None:
    bench = Bench()
    assert bench.tick().rumble == 0.0
    assert bench.tick(touching=("table",), hit=True).rumble > 0.5
    states = [bench.tick(touching=("table",), hit=True) for _ in range(20)]
    assert states[-1].rumble == 0.0, "a contact that lasts is felt once"
    assert sum(state.rumble_ended for state in states) == 1
    assert bench.tick(touching=("table", "parcel 1"), held="parcel 1").rumble > 0.2
    bench.tick(None, 20)
    bench.control.note_refusal()
    state = bench.tick()
    assert state.rumble > 0.3
    assert state.servo == -1
    assert bench.tick().servo == 0


def test_arm_at_a_limit_is_felt_and_named() -> None:
    bench = Bench(np.array(TABLE.poses["ready"]))
    up = Pose.from_euler((0.0, 0.0, 0.0))
    bench.tick(Hand(up, engaged=True), 3)
    for way in np.linspace(0.0, 0.6, 60):
        state = bench.tick(Hand(Pose.from_euler((way, 0.0, 0.0)), engaged=True))
    assert "out of reach" in state.reason
    assert state.rumble == pytest.approx(0.25)
    assert state.servo == 6


def test_trigger_of_a_hand_closes_the_jaws() -> None:
    bench = Bench(np.array(TABLE.poses["ready"]))
    for trigger in np.linspace(1.0, 0.0, 20):
        hand = Hand(Pose.identity(), engaged=True, trigger=float(trigger))
        bench.tick(hand)
    assert bench.control.tick(bench.stamp, BUSY).opening == pytest.approx(0.06)


def test_late_commands_move_the_arm_more_slowly() -> None:
    fast, slow = Bench(), Bench()
    for _ in range(20):
        fast.tick(TURN)
        slow.control.follow("ann", TURN, 0.25)
        slow.control.tick(slow.stamp, BUSY)
        slow.stamp += TICK
    ways = [bench.control.tick(bench.stamp, BUSY).angles[0] for bench in (fast, slow)]
    assert 0.0 < ways[1] < 0.5 * ways[0]
