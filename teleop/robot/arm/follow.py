"""The step of the joints in a tick: towards a target of the tip, or at rates of joints, within one set of limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import daqp
import numpy as np

from localization.geometry import FloatArray
from robot_sim.arm.arm_table import JOINTS
from robot_sim.arm.clearance import Near
from robot_sim.arm.inverse import solutions
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.limits import JerkLimiter
from teleop.robot.arm.reach import Target

_POINTING: Final = 0.1
"""Length at which an error of the pointing [rad] counts as one of the position [m]."""
_DAMPING: Final = 1.0
"""Weight of the step's size for each squared metre of error (Levenberg-Marquardt, as mink's ``lm_damping``): with 0.01 a
stretched arm shakes at 1.3 to 1.8 rad/s, with 1.0 at less than 0.04."""
_LEAST: Final = 1e-8
"""What of it remains without an error: the mixture stays solvable where the arm is singular."""
_ITERATIONS: Final = 2
"""Steps of Gauss and Newton in a tick; the second takes the tip from 0.5 mm to 3 um of a hand (95 %)."""
_ENOUGH: Final = 1e-5
"""Error [m] with which the second is left out."""
_KEEP: Final = 0.005
"""Distance to obstacles that steps keep [m]; the check of the next state insists on 2 mm."""
_APPROACH: Final = 0.25
"""Largest share of the rest of the distance that is used up in a tick."""
_MISSED: Final = 1e-3
"""Error [m] above which the wrist is led."""
_STRAIGHT: Final = math.radians(10.0)
"""Bend of the elbow that steps keep, to the side on which it is: the other side is another branch."""
_UNDECIDED: Final = math.radians(2.0)
"""Bend below which it has no side yet: an arm that stands straight may bend either way."""
_WRIST: Final = math.radians(25.0)
"""Pitch of the wrist below which its roll hardly moves the tip, and may be led to where it will be needed ..."""
_LED: Final = 0.06
"""... with this length for a radian [m], at a straight wrist. So 6 of 624 hands that come back from out of reach find the
wrist turned over, and without it 40."""
_FREE: Final = 1e30
"""Stands for no bound."""
_NO_ROWS: Final = np.zeros((0, JOINTS))
_ZEROS: Final[FloatArray] = np.zeros(JOINTS)
_ONES: Final[FloatArray] = np.eye(JOINTS)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """Where the joints shall be at the end of a tick, and how fast they shall move there."""

    angles: FloatArray
    """(5,) [rad]."""
    rates: FloatArray
    """(5,) that the target's own velocity asks for [rad/s]."""


class Follower:
    """Finds steps by a quadratic programme of five variables with bounds and a row for each pair that is near."""

    def __init__(self, kinematics: Kinematics, limiter: JerkLimiter) -> None:
        """Take the arm and its bounds."""
        self._kinematics, self._limiter, self._tick = kinematics, limiter, limiter.tick
        self._lower = np.array(kinematics.table.lower)
        self._upper = np.array(kinematics.table.upper)
        self._fastest = np.full(JOINTS, kinematics.table.motion.speed * limiter.tick)

    def towards(
        self,
        angles: FloatArray,
        target: Target,
        velocity: tuple[FloatArray, FloatArray],
        near: Sequence[Near] = (),
        share: float = 1.0,
    ) -> Step:
        """Return the step that brings the tip nearest to a target, its pointing counting 0.1 m a radian.

        Minimises |W (J dq - e)|^2 + (damping |W e|^2 + least) |dq|^2 over dq within ``bounds`` and the rows of
        ``near``; e is the error of position and pointing, J the Jacobian without the row of the gripper's roll.

        Args:
            angles: (5,) where the joints are [rad].
            target: Where the tip shall be at the end of the tick.
            velocity: Of the target: (3,) [m/s], and the change of its pointing (3,) [1/s].
            near: Pairs whose distance must not shrink too fast.
            share: Of the speed that is allowed.
        """
        lower, upper = self.bounds(angles, share)
        moved: FloatArray = _ZEROS
        drift: FloatArray = np.zeros(JOINTS)
        pull = None
        for iteration in range(_ITERATIONS):
            error, jacobian, axes = self._error(angles + moved, target)
            square = float(error @ error)
            if iteration and square < _ENOUGH**2:
                break
            across = jacobian.T
            squares = across @ jacobian + (_DAMPING * square + _LEAST) * _ONES
            linear = -(across @ error)
            if not iteration:
                if abs(angles[4]) < _WRIST and square > _MISSED**2:
                    pull = self._wrist_pull(angles, target)
                drift[:] = np.linalg.solve(squares, across @ _seen(axes, velocity))
            if pull is not None:
                weights, goal = pull
                squares += weights
                linear -= weights @ (goal - angles - moved)
            moved = moved + _solve(squares, linear, lower - moved, upper - moved, near, moved)
        # A goal that catches up with a target that stands still must not be passed.
        rates = moved / self._tick
        slower = np.minimum(np.maximum(drift, np.minimum(rates, 0.0)), np.maximum(rates, 0.0))
        return Step(angles + moved, slower)

    def jog(
        self, angles: FloatArray, rates: FloatArray, near: Sequence[Near] = (), share: float = 1.0
    ) -> Step:
        """Return the step that is nearest to rates (5,) of the joints [rad/s]."""
        lower, upper = self.bounds(angles, share)
        step = _solve(np.eye(JOINTS), -rates * self._tick, lower, upper, near, np.zeros(JOINTS))
        return Step(angles + step, step / self._tick)

    def bounds(self, angles: FloatArray, share: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Return the smallest and largest step (5,) of each joint [rad].

        Speeds from which it can still be braked before a limit; where a joint stands beyond one, it may stay or come
        back. So 0 is always among them, and the way back always open.
        """
        room = np.maximum(0.0, np.array([angles - self._lower, self._upper - angles]))
        braking = self._tick * self._limiter.brakable(room)
        down, up = np.minimum(np.minimum(share * self._fastest, braking), room)
        if angles[2] < -_UNDECIDED:
            up[2] = min(up[2], max(0.0, -_STRAIGHT - angles[2]))
        elif angles[2] > _UNDECIDED:
            down[2] = min(down[2], max(0.0, angles[2] - _STRAIGHT))
        return -down, up

    def _wrist_pull(
        self, angles: FloatArray, target: Target
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return the weights (5, 5) and the angles (5,) to which roll and pitch are pulled, if there are such.

        They meet the target with this elbow; within the limits there is one such pair of roll and pitch. A wrist that
        passes through straight without knowing it may run into the limit of its roll.
        """
        found = solutions(self._kinematics, target.position, target.pointing)
        found = found[(found[:, 2] * angles[2] > 0.0) & (np.abs(found[:, 0] - angles[0]) < 1.0)]
        if not len(found):
            return None
        weight = (_LED * (1.0 - abs(float(angles[4])) / _WRIST)) ** 2
        nearest = int(np.abs(found - angles).max(axis=1).argmin())
        return np.diag([0.0, 0.0, 0.0, weight, weight]), found[nearest]

    def _error(
        self, angles: FloatArray, target: Target
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the weighted error (5,), its Jacobian (5, 5), and the axes (2, 3) that pointing errors turn about."""
        tip, jacobian = self._kinematics.tip_and_jacobian(angles)
        rotation = tip[:3, :3]
        ahead, left, up = (rotation.T @ target.pointing).tolist()
        aside = math.hypot(left, up)
        # The rotation vector from x to the target lies across both; behind the gripper any does.
        turn = math.atan2(aside, ahead)
        share = turn / aside if aside > 1e-9 else 1.0
        error = np.empty(5)
        error[:3] = target.position - tip[:3, 3]
        error[3:] = -_POINTING * share * up, _POINTING * share * left
        if aside <= 1e-9 and ahead < 0.0:
            error[4] = _POINTING * math.pi
        axes = rotation.T[1:]
        return error, np.concatenate([jacobian[:3], _POINTING * (axes @ jacobian[3:])]), axes


def _seen(axes: FloatArray, velocity: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return a target's velocity as the error's (5,): how fast it turns about the two axes is seen from its x."""
    left, up = (axes @ velocity[1]).tolist()
    return np.array([*velocity[0].tolist(), -_POINTING * up, _POINTING * left])


def _solve(
    squares: FloatArray,
    linear: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    near: Sequence[Near],
    moved: FloatArray,
) -> FloatArray:
    """Minimise x' squares x / 2 + linear' x between bounds, approaching nothing that is near too fast."""
    if near:
        rows = np.array([pair.gradient for pair in near])
        rests = np.array([pair.distance for pair in near]) - _KEEP
        least = -_APPROACH * np.maximum(0.0, rests) - rows @ moved
        lower = np.concatenate([lower, least])
        upper = np.concatenate([upper, np.full(len(near), _FREE)])
    else:
        rows = _NO_ROWS
    step, _, flag, _ = daqp.solve(squares, linear, rows, upper, lower)
    # It has a solution, for x = -moved is within all bounds; should rounding deny it, nothing moves.
    return np.asarray(step) if flag == 1 else np.zeros(JOINTS)
