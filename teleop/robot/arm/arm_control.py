"""The arm's control: what was admitted becomes the angles of the next tick, and the reason why it does not move."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.arm_plant import ArmReading
from robot_sim.arm.clearance import Clearance, Near
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.load import Load, LoadWatch
from teleop.robot.arm.arm_commands import (
    Goal,
    GripperGoal,
    Hand,
    Stream,
    Trajectory,
    slowed,
)
from teleop.robot.arm.arm_fit import ArmFit, unfelt
from teleop.robot.arm.arm_settings import ArmCommand, ArmSettings, Permit
from teleop.robot.arm.arm_state import ArmMode, ArmState
from teleop.robot.arm.arm_words import MODES, WAYS_OUT, servo_code
from teleop.robot.arm.goal_desk import GoalDesk, OpenGoal
from teleop.robot.arm.goal_results import GoalOutcome
from teleop.robot.arm.goal_runner import GoalRunner
from teleop.robot.arm.gripper import GripperControl
from teleop.robot.arm.hand_control import HandControl, HandStep
from teleop.robot.arm.hindrance import CLEAR, Finding, Hindrance
from teleop.robot.arm.limits import Motion
from teleop.robot.arm.rumble import Rumble

_STOWED: Final = math.radians(3.0)
"""Distance of each joint from its stow pose within which the arm counts as folded [rad]: twice what its servos leave."""
_SELDOM: Final = 10
"""Ticks between two looks around while nothing moves the arm, and between two that are only for display."""


class ArmControl:
    """Owns the arm's commanded motion, and what moves it."""

    def __init__(
        self,
        fit: ArmFit,
        clearance: Clearance,
        reading: ArmReading,
        settings: ArmSettings | None = None,
        *,
        tick: float = 0.02,
    ) -> None:
        """Take an arm that stands still.

        Args:
            fit: Which arm, and where.
            clearance: Measures how near it is to anything; what calls ``tick`` has it look around.
            reading: What is measured now.
            settings: What it obeys; the defaults if not given.
            tick: Time between two ticks [s].
        """
        table = fit.table
        self._settings, self._tick = settings or ArmSettings(), tick
        self._kinematics, self._clearance = Kinematics(table), clearance
        self._hand = HandControl(
            table, clearance, tick=tick, base_from_arm_base=fit.base_from_arm_base
        )
        self._gripper, self._watch = GripperControl(table.gripper, tick), LoadWatch(table)
        self._joints = (*(joint.name for joint in table.joints), table.gripper.joint)
        self._stow = np.array(table.poses["stow"])
        self._unfelt = unfelt(table)
        self._motion = Motion.at_rest(reading.angles)
        self._runner = GoalRunner(fit, clearance, self._hand.limiter, tick=tick)
        self._rumble = Rumble()
        self.desk = GoalDesk()
        """The goals, and their results until the gateway has taken them."""
        self._stream: Stream | None = None
        self._share, self._client, self._estop = 1.0, "", ""
        self._mode, self._reason = ArmMode.IDLE, "nobody moves the arm"
        self._step = HandStep(self._motion)
        self._offer: Finding = CLEAR
        self._load: Load = self._watch.take(0.0, reading.torques.tolist(), reading.rates.tolist())
        self._reading, self._ticks = reading, 0
        self._near: Near | None = None
        self._tip = _pose(self._kinematics.tip(reading.angles))
        self._refused = False
        self._confirmed: tuple[str, int] | None = None
        self.stopped = ""
        """Why the arm itself ended what moved it in the last tick; empty if it did not."""

    # What was admitted

    def follow(self, client: str, stream: Stream, share: float) -> None:
        """Follow a command of the driver.

        Args:
            client: Name of the driver.
            stream: The command.
            share: Of the speed that is allowed, for commands that come late.
        """
        if stream.engaged:
            self.desk.end_arm(GoalOutcome.CANCELLED, "its client moves the arm by hand")
            self._stream, self._share, self._client = slowed(stream, share), share, client
        if isinstance(stream, Hand) and stream.engaged and self.desk.gripper is None:
            self._gripper.pull(stream.trigger)

    def begin(self, client: str, goal: Goal, now: int, age: int) -> None:
        """Begin a goal of the driver, or answer why not."""
        if isinstance(goal, GripperGoal):
            self.desk.open(client, goal, now, age)
            self._gripper.aim(goal.opening, goal.effort)
        elif self._stream is not None:
            self.desk.refuse(client, goal, "the arm is moved by hand: let go first")
        elif why := self._runner.refusal(goal, self._offer):
            self.desk.refuse(client, goal, why)
        else:
            self.desk.open(client, goal, now, age)
            self._client = client

    def note_refusal(self) -> None:
        """Let operators feel that something was refused."""
        self._refused = True
        self._rumble.refused()

    def halt(self, reason: str, outcome: GoalOutcome = GoalOutcome.CANCELLED) -> None:
        """Stop and hold, whatever moves the arm; a goal ends with the outcome."""
        self.desk.end_arm(outcome, reason)
        self._stream, self._client = None, ""
        self._gripper.let_go()
        self._hand.reset()
        self._mode, self._reason = ArmMode.HELD, reason

    def confirm(self, client: str, held: bool, arrival: int) -> None:
        """Note that the driver confirms a motion that runs only while it does, or does not any more."""
        self._confirmed = (client, arrival) if held else None

    def server_lost(self) -> None:
        """Stop; the gateway has ended, and with it all its clients."""
        self.halt("the server has ended", GoalOutcome.SILENT)
        self.desk.forget()

    # What the arm does

    @property
    def restless(self) -> bool:
        """Whether it must look around in the coming tick: always while something moves it, seldom otherwise."""
        return self.busy or not self._motion.resting or self._ticks % _SELDOM == 0

    @property
    def busy(self) -> bool:
        """Whether a client moves it."""
        return self._stream is not None or self.desk.arm is not None

    @property
    def held(self) -> str:
        """Name of what the gripper holds; empty without anything."""
        return self._reading.held

    def tick(self, now: int, permit: Permit) -> ArmCommand:
        """Return what the arm gets for the coming tick.

        Args:
            now: Time of the tick [ns].
            permit: What the robot's safety says.
        """
        self.stopped = ""
        self._mind_goals(now, permit)
        if self._stream is not None and not permit.engaged:
            self._let_go(permit)
        elif self._stream is None and permit.estop != self._estop:
            self._mode, self._reason = ArmMode.HELD, permit.reason
        self._estop = permit.estop
        if any(self._load.giving_way):
            self._give_way()
        elif self._stream is not None:
            self._move_by_hand(self._stream)
        elif self.desk.arm is not None:
            self._pursue(self.desk.arm, now)
        elif not self._motion.resting or self._step.target is not None:
            self._step = self._hand.hold(self._motion)
        self._motion = self._step.motion
        return ArmCommand(self._motion.angles, self._gripper.opening, self._gripper.force)

    def measure(self, reading: ArmReading) -> ArmState:
        """Take what was measured in the tick; return the arm's state."""
        self._reading, self._ticks = reading, self._ticks + 1
        self._load = self._watch.take(self._tick, reading.torques.tolist(), reading.rates.tolist())
        grip = self._gripper.measure(reading.opening, reading.grip_force)
        if self.desk.gripper is not None and (grip.reached or grip.stalled):
            words = "" if grip.reached else f"stalled at {1e3 * grip.opening:.1f} mm"
            self.desk.end_gripper(GoalOutcome.DONE, words, grip)
        finding = self._step.finding
        hindered = self._stream is not None and finding.hindrance is not Hindrance.NONE
        self._rumble.tick(frozenset(reading.touching), reading.held, hindered=hindered)
        if self._ticks % _SELDOM == 0:
            self._near = self._clearance.nearest(reading.angles)
        if self.restless:
            self._tip = _pose(self._kinematics.tip(reading.angles))
        state = self._state(reading)
        self._refused = False
        return state

    def _state(self, reading: ArmReading) -> ArmState:
        tip, target = self._tip, self._step.target
        nearest: Near | None = self._near
        offer = self._offer.way_out
        stowed = bool(np.abs(reading.angles - self._stow).max() <= _STOWED)
        off = self._settings.speed and not stowed
        return ArmState(
            stamp=reading.stamp,
            mode=self._mode,
            reason=self._reason,
            way_out=offer,
            way_out_text=WAYS_OUT.get(offer, ""),
            controller=self._client,
            joints=self._joints,
            angles=reading.angles,
            rates=reading.rates,
            torques=reading.torques,
            wanted=self._motion.angles,
            wanted_rates=self._motion.rates,
            pulses=reading.pulses,
            load=self._load.shares,
            tip=tip,
            target=tip if target is None else target.pose(tip.rotation),
            clearance=0.1 if nearest is None else nearest.distance,
            nearest="" if nearest is None else f"{nearest.names[0]} and {nearest.names[1]}",
            opening=reading.opening,
            wanted_share=self._gripper.share,
            opening_rate=self._gripper.rate,
            grip_force=reading.grip_force,
            held=reading.held,
            stowed=stowed,
            speed_limit=self._settings.speed if off else math.inf,
            turn_limit=self._settings.turn if reading.held else math.inf,
            servo=servo_code(self._step, moved=self._stream is not None, refused=self._refused),
            rumble=self._rumble.strength,
            rumble_ended=self._rumble.ended,
            goals=self.desk.report(self._gripper.grip),
        )

    def _move_by_hand(self, stream: Stream) -> None:
        self._step = self._hand.tick(stream, self._motion, self._share)
        finding = self._step.finding
        self._mode, words = MODES[type(stream)]
        self._reason = finding.reason or words
        self._offer = finding

    def _pursue(self, opened: OpenGoal, now: int) -> None:
        """Bring the goal under way on by a tick."""
        confirmed = self._confirmed
        go = confirmed is not None and (
            confirmed[0] == opened.client and now - confirmed[1] <= self._settings.patience.watchdog
        )
        motion, end = self._runner.tick(
            opened, self._motion, self._reading.angles, self._offer, go=go
        )
        self._step = HandStep(motion)
        self._mode = ArmMode.TRAJECTORY if isinstance(opened.goal, Trajectory) else ArmMode.PLAN
        self._reason = self._runner.reason
        if end is not None:
            outcome, words = end
            self.desk.end_arm(outcome, words)
            self._client, self._offer = "", CLEAR
            good = outcome in (GoalOutcome.DONE, GoalOutcome.PREVIEWED)
            self._mode = ArmMode.IDLE if good else ArmMode.HELD
            self._reason = words or "arrived"

    def _let_go(self, permit: Permit) -> None:
        """Stop for an operator who has let go, or who was stopped."""
        self._stream, self._client = None, ""
        self._gripper.let_go()
        self._mode = ArmMode.HELD if permit.stopped else ArmMode.IDLE
        self._reason = permit.reason
        if permit.stopped:
            self._hand.reset()
        else:
            self._hand.let_go()

    def _give_way(self) -> None:
        """Bring joints that bear too much past where they are, and end what moved the arm."""
        moved = self.busy
        self.halt(self._load.words, GoalOutcome.BLOCKED)
        if moved:
            self.stopped = self._load.words
        giving = np.array(self._load.giving_way)
        # Within its dead band and its play a servo that is led to where it is would push on with all its torque.
        relieved = self._reading.angles - np.sign(self._reading.torques) * self._unfelt
        goal = np.where(giving, relieved, self._motion.angles)
        later = self._hand.limiter.follow(self._motion, goal, np.zeros(len(goal)))
        self._step = HandStep(later)
        self._offer = Finding(way_out="stow")

    def _mind_goals(self, now: int, permit: Permit) -> None:
        """End goals whose client has lost the robot, is silent or wants them no more."""
        patience = self._settings.patience
        for each, end in (
            (self.desk.arm, self._end_arm_goal),
            (self.desk.gripper, self._end_grip),
        ):
            if each is None:
                continue
            if permit.estop:
                end(GoalOutcome.E_STOP, f"e-stop by {permit.estop}")
            elif permit.controller != each.client:
                silent = not permit.controller
                who = permit.controller or "nobody"
                end(
                    GoalOutcome.SILENT if silent else GoalOutcome.TAKEN_OVER, f"{who} has the robot"
                )
            elif silence := patience.silence(each.client, each.alive, each.age, now):
                end(GoalOutcome.SILENT, silence)
            elif each.cancelled:
                end(GoalOutcome.CANCELLED, "cancelled by its client")

    def _end_arm_goal(self, outcome: GoalOutcome, message: str) -> None:
        self.desk.end_arm(outcome, message)
        cancelled = outcome is GoalOutcome.CANCELLED
        self._mode = ArmMode.IDLE if cancelled else ArmMode.HELD
        self._reason = message

    def _end_grip(self, outcome: GoalOutcome, message: str) -> None:
        self._gripper.stop()
        self.desk.end_gripper(outcome, message, self._gripper.grip)


def _pose(matrix: FloatArray) -> Pose:
    return Pose.from_rotation(matrix[:3, 3], matrix[:3, :3])
