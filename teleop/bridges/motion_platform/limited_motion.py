"""Motion that follows a target and never leaves its limits, whatever the target does.

With time steps of dt the position moves by the new rate times dt. A state is safe if braking at the greatest
acceleration A from it ends within the position's limit X: x + v^2 / 2A <= X for v > 0, and likewise below. The sum of
the steps of such a braking is at most v^2 / 2A, because the rate falls within each step; so from a safe state a rate
with |v' - v| <= A dt that leads to a safe state always exists (v - A dt, or 0), and the limits hold by induction.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from teleop.bridges.motion_platform.platform import FloatArray, Limits

PERIOD: Final = 0.01
"""Time between two poses [s]."""


class LimitedMotion:
    """Six axes in motion. Owns their positions and rates; it begins level and at rest."""

    def __init__(self, limits: Limits) -> None:
        """Take the limits."""
        self._limits = limits
        self.position = np.zeros(6)
        """Where the platform is (6,) [m, rad]."""
        self.rate = np.zeros(6)
        """How fast it moves (6,) [m/s, rad/s]."""

    def step(self, target: FloatArray, target_rate: FloatArray) -> None:
        """Move for one period towards a target (6,), which itself moves at a rate (6,); what is not finite is level."""
        most, fastest, brake = self._limits.position, self._limits.rate, self._limits.acceleration
        target = np.clip(np.nan_to_num(target, posinf=0.0, neginf=0.0), -most, most)
        along = np.clip(np.nan_to_num(target_rate, posinf=0.0, neginf=0.0), -fastest, fastest)
        rate = along + landing_rate(target - self.position, brake)
        low, high = safe_rates(self.position, self.rate, self._limits)
        self.rate = np.clip(rate, low, high)
        self.position = self.position + self.rate * PERIOD


def landing_rate(away: FloatArray, brake: FloatArray) -> FloatArray:
    """Return the greatest rates (6,) from which distances (6,) away are reached without going past them.

    The rate v is gone through for one period and then braked: v dt + v^2 / 2A = |away|.
    """
    reach = np.sqrt((brake * PERIOD) ** 2 + 2.0 * brake * np.abs(away)) - brake * PERIOD
    # What is reached within one period needs no braking: the rate falls to zero by one step of A dt.
    near = np.minimum(np.abs(away) / PERIOD, brake * PERIOD)
    return np.asarray(np.sign(away) * np.maximum(reach, near))


def safe_rates(
    position: FloatArray, rate: FloatArray, limits: Limits
) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest next rates (6,) that keep all limits, from a safe state."""
    change = limits.acceleration * PERIOD
    low = np.maximum(rate - change, -limits.rate)
    high = np.minimum(rate + change, limits.rate)
    upper = landing_rate_within(limits.position - position, limits.acceleration)
    lower = -landing_rate_within(limits.position + position, limits.acceleration)
    # Rounding may put a bound on the wrong side of what braking allows, which by the proof is always safe.
    braked = np.where(rate > 0.0, np.maximum(rate - change, 0.0), np.minimum(rate + change, 0.0))
    high = np.maximum(np.minimum(high, upper), np.minimum(braked, high))
    low = np.minimum(np.maximum(low, lower), np.maximum(braked, low))
    return low, high


def landing_rate_within(room: FloatArray, brake: FloatArray) -> FloatArray:
    """Return the greatest rates (6,) that lead to safe states with some room (6,) to a limit."""
    room = np.maximum(room, 0.0)
    return np.asarray(np.sqrt((brake * PERIOD) ** 2 + 2.0 * brake * room) - brake * PERIOD)


def settling_time(limits: Limits) -> float:
    """Return the time [s] after which the platform is level and at rest from any state, if its target is that.

    On each axis: braking, the way across the whole range at the greatest rate, and gaining and losing that rate.
    """
    across = 2.0 * limits.position / limits.rate
    return float(np.max(across + 3.0 * limits.rate / limits.acceleration)) + 2.0 * PERIOD
