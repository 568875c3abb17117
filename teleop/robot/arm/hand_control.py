"""Control of the arm by a hand, a twist, a moving pose or rates of joints: from the newest wish to the next state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.arm_table import JOINTS, ArmTable
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_commands import JointJog, Stream
from teleop.robot.arm.follow import Follower
from teleop.robot.arm.hand import Grip
from teleop.robot.arm.hindrance import CLEAR, Diagnosis, Finding, Hindrance
from teleop.robot.arm.limits import JerkLimiter, Motion
from teleop.robot.arm.next_state import NEAR, NextState
from teleop.robot.arm.reach import Reach, Target
from teleop.robot.arm.targets import Targets


@dataclass(frozen=True, slots=True, eq=False)
class HandStep:
    """The next state of the arm, and what is in the way of what is wanted."""

    motion: Motion
    """State at the end of the tick."""
    target: Target | None = None
    """Where the tip is wanted, as far as the arm reaches; None if no place is."""
    goal: FloatArray | None = None
    """(5,) angles that come nearest to it in this tick, before the bounds of the motion [rad]."""
    share: float = 1.0
    """Share of the way to them that the check of the next state admitted; 0 brakes."""
    finding: Finding = CLEAR
    """Why the tip is not where it is wanted, and what leads on."""


class HandControl:
    """Owns the goal of the joints between ticks; the state of motion is its caller's.

    The goal follows what is wanted within speeds, limits and distances; the motion follows the goal within the bounds of
    acceleration and jerk, and only as long as it could still stop in time.
    """

    def __init__(
        self,
        table: ArmTable,
        clearance: Clearance | None = None,
        *,
        tick: float = 0.02,
        base_from_arm_base: Pose | None = None,
    ) -> None:
        """Begin with nothing wanted.

        Args:
            table: The arm.
            clearance: What it must not touch; None for nothing.
            tick: Time between two calls [s].
            base_from_arm_base: Mount of the arm; the table's bracket if not given.
        """
        kinematics = self._kinematics = Kinematics(table)
        self.limiter = JerkLimiter(table, tick)
        self._clearance = clearance
        self._follower = Follower(kinematics, self.limiter)
        self._reach = Reach(kinematics)
        self._next = NextState(table, self.limiter, clearance)
        self._diagnosis = Diagnosis(kinematics, clearance, tick)
        self._targets = Targets(base_from_arm_base or table.mounts["bracket"], tick)
        self._goal: FloatArray | None = None
        self._tip: FloatArray = np.eye(4)
        self._rates = np.zeros(JOINTS)
        self._kind: type[Stream] | None = None

    def reset(self) -> None:
        """Forget the operator; the next one begins where the arm stands."""
        self._pause()
        self._targets.clutch.reset()

    def let_go(self) -> None:
        """Note that the operator has let go, and may take the arm again."""
        self._pause()
        self._targets.clutch.let_go()

    def hold(self, motion: Motion, finding: Finding = CLEAR) -> HandStep:
        """Return the next state on the shortest way to standstill; may be called in any tick."""
        self._pause()
        return HandStep(self.limiter.stop(motion), finding=finding)

    def tick(self, wish: Stream, motion: Motion, share: float = 1.0) -> HandStep:
        """Return the next state for the newest wish.

        Args:
            wish: What the client wants; the same as a tick ago if nothing new has come.
            motion: State of now, as commanded.
            share: Of the speed that is allowed, for wishes that come late.
        """
        if type(wish) is not self._kind:
            self._pause()
            self._kind = type(wish)
        if self._goal is None:  # where the arm stands, or would if it stopped
            self._go_to(self.limiter.stopping(motion)[-1])
            self._rates = np.zeros(JOINTS)
        assert self._goal is not None
        before, tip = self._goal, self._tip
        near = () if self._clearance is None else self._clearance.near(before, NEAR)
        target, beyond, rates = None, 0.0, np.zeros(JOINTS)
        if isinstance(wish, JointJog):
            rates = np.array(wish.rates)
            step = self._follower.jog(before, rates, near, share)
        else:
            wanted = self._targets.take(wish, tip)
            if wanted is None:
                return self.hold(motion, self._untrusted())
            target, beyond = self._reach.clamped(wanted[0], Target.of(tip))
            step = self._follower.towards(before, target, wanted[1], near, share)
        moved = self._next.goal(before, step.angles - before, near)
        goal = before + moved
        self._go_to(goal)
        # Half of the newest and half of what was: the noise of a hand is greatest in its speed.
        self._rates = 0.5 * (self._rates + step.rates)
        later, admitted = self._next.after(motion, goal, self._rates, share)
        held = not admitted and later.resting
        if held:
            moved = np.zeros(JOINTS)
        if target is None:
            finding = self._diagnosis.jogged(goal, moved, rates, near)
        else:
            finding = self._diagnosis.followed(goal, self._tip, target, beyond, near)
        if held:
            self._go_to(later.angles)  # a goal that cannot be reached from here must not run away
        return HandStep(later, target, goal, admitted, finding)

    def _go_to(self, goal: FloatArray) -> None:
        self._goal, self._tip = goal, self._kinematics.tip(goal)

    def _pause(self) -> None:
        self._targets.pause()
        self._diagnosis.forget()
        self._goal = None

    def _untrusted(self) -> Finding:
        """Return why a hand does not count."""
        clutch = self._targets.clutch
        if clutch.grip is Grip.JUMPED:
            way = f"{100.0 * clutch.jump:.0f} cm"
            reason = f"the hand jumped by {way}: open the clutch and close it again"
            return Finding(Hindrance.JUMPED, reason)
        if clutch.grip is Grip.LOST:
            return Finding(Hindrance.UNTRACKED, "the hand is not tracked")
        return CLEAR
