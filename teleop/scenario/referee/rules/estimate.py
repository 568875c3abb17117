"""Rules of what the robot believes: sound numbers, an honest bound, no jump of its dead reckoning."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.types import SECOND, Health, Pose, Sweep, Verdict
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import Kidnap
from teleop.scenario.referee.rules.command_in_force import TICK
from teleop.scenario.referee.rules.lookalikes import share_on_map
from teleop.scenario.referee.rules.rule import Rule, RunFacts
from teleop.scenario.referee.run_log import LOCALISED

CHI2_3_997: Final = 13.93
"""Bound that the chi-square distribution of three degrees of freedom exceeds in 0.3 % of all cases."""
_ELSEWHERE: Final = 1.0
"""Error from which on the robot is at another place, which may look like its own [m]."""
_FITS: Final = 0.5
"""Share of a sweep that fits a place that looks right."""
_MARGIN: Final = 0.1
"""By so much less of it may fit than at the true place."""
_FLOOR: Final = np.diag([0.02, 0.02, math.radians(0.5)]) ** 2
"""Error that no operator sees (x, y [m], yaw [rad]), squared: it is added to the claimed covariance."""


class NumbersAreSound(Rule):
    """Every number that the robot believes in is one."""

    name = "sound"
    sentence = "poses and covariances are finite, and covariances have positive eigenvalues"

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        estimate = tick.estimate
        if not np.isfinite(estimate.covariance).all():
            return "the covariance is not finite"
        if estimate.map_from_base is None:
            return None
        if not np.isfinite(estimate.map_from_base.position).all():
            return "the position is not finite"
        if tick.stamp % (SECOND // 5) == 0 and np.linalg.eigvalsh(estimate.covariance)[0] <= 0.0:
            return "the covariance has an eigenvalue that is not positive"
        return None


class ReadingsAreTaken(Rule):
    """The simulated sensors' readings are sound, and none is refused."""

    name = "readings"
    sentence = "no reading of the robot's own sensors is refused"

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        for estimate in tick.estimates:
            for reason in estimate.reasons:
                if reason.startswith("refused"):
                    return reason
        return None


class ErrorIsBounded(Rule):
    """A robot that claims to know where it is does."""

    name = "bound"
    sentence = "while the robot is localised, its error (x, y, heading) is not outside its own 99.7 % bound for a second"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._outside = 0
        self._sweep: Sweep | None = None
        self._patient_until = 0
        self._carried = [
            round(f.at * SECOND) for f in facts.scenario.fault if isinstance(f, Kidnap)
        ]
        self._unnoticed = False
        self._lying = min(
            (f.at * SECOND for f in facts.scenario.fault if f.kind == "wheel_slip"),
            default=math.inf,
        )

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        estimate, guess = tick.estimate, tick.estimate.map_from_base
        for each in tick.estimates:
            self._sweep = each.sweep or self._sweep
            if each.verdict is not None and each.verdict.verdict is Verdict.ACCEPTED:
                # A hint may be wrong and fit; as after a kidnap, the robot has two seconds to doubt it.
                self._patient_until = tick.stamp + SECOND
        localised = estimate.health in LOCALISED and guess is not None
        # In directions that the map does not show a robot has nothing but its wheels, which lie.
        if estimate.health is not Health.TRACKING and tick.stamp > self._lying:
            localised = False
        if self._carried and tick.stamp >= self._carried[0]:
            # Whether it is noticed is judged over many runs: see the statistics of ``farsteer fuzz``.
            self._carried.pop(0)
            self._unnoticed = True
        if not localised:
            self._unnoticed = False
        if not localised or self._unnoticed or guess is None:
            self._outside = 0
            return None
        if tick.stamp < self._patient_until:
            return None
        value = _nees3(guess, tick.truth.map_from_base, estimate.covariance)
        self._outside = self._outside + 1 if value > CHI2_3_997 else 0
        if self._outside * TICK <= SECOND:
            return None
        off = guess.position - tick.truth.map_from_base.position
        if math.hypot(off[0], off[1]) > _ELSEWHERE and self._alike(guess, tick.truth.map_from_base):
            self._outside = 0
            return None
        return (
            f"it says {estimate.health.value}, {math.hypot(off[0], off[1]):.3f} m off, with a squared normalised"
            f" error of {value:.0f}"
        )

    def _alike(self, guess: Pose, true: Pose) -> bool:
        """Return whether the last sweep fits where the robot believes to be as well as where it is."""
        if self._sweep is None:
            return True
        cloud = self.facts.cloud
        found = share_on_map(cloud, self._sweep, guess)
        return found > _FITS and found > share_on_map(cloud, self._sweep, true) - _MARGIN


def _nees3(guess: Pose, true: Pose, covariance: FloatArray) -> float:
    off = true.position - guess.position
    vector = np.array([off[0], off[1], wrap_angle(true.yaw - guess.yaw)])
    axes = np.ix_((0, 1, 5), (0, 1, 5))
    return float(vector @ np.linalg.solve(covariance[axes] + _FLOOR, vector))


class OdometryIsSmooth(Rule):
    """Dead reckoning never jumps (REP 105)."""

    name = "smooth"
    sentence = "the pose by dead reckoning moves in a tick no further than the robot can"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._last: Pose | None = None
        self._wheels = max(
            [1.0, *(f.factor for f in facts.scenario.fault if f.kind == "wheel_slip")]
        )

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        pose, last = tick.estimate.odom_from_base, self._last
        self._last = pose
        if last is None:
            return None
        step = float(np.hypot(*(pose.position - last.position)[:2]))
        farthest = 2.0 * self._wheels * self.facts.max_speed * TICK / SECOND + 0.01
        if step > farthest:
            return f"dead reckoning jumps by {step:.3f} m in a tick"
        return None
