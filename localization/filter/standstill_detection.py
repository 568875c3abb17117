"""Standstill: whether wheels, gyro and accelerometer agree that the robot stands, and for how long."""

from __future__ import annotations

from dataclasses import dataclass

from localization.filter.ekf_config import EkfConfig

Triple = tuple[float, float, float]

_MEMORY = 2.0
"""The mean force at rest is taken over this time [s]: long enough to average noise, short against the change of
slope on a ramp."""


@dataclass(frozen=True, slots=True)
class Rest:
    """How long nothing has moved, and the mean force meanwhile; a value."""

    seconds: float = 0.0
    """Time since the last motion [s]; 0 while the robot moves."""
    force: Triple = (0.0, 0.0, 0.0)
    """Mean specific force meanwhile [m/s^2]."""
    pushed: bool = False
    """Whether the rest began with a change of force, after which the robot may glide."""

    @property
    def undisturbed(self) -> bool:
        """Whether nothing moves at the moment, and no push came before."""
        return self.seconds > 0.0 and not self.pushed

    def stands(self, config: EkfConfig) -> bool:
        """Return whether nothing has moved for long enough."""
        return 0.0 < self.seconds >= (config.still_recover if self.pushed else config.still_settle)


MOVING = Rest()


def wheels_stand(left: float, right: float, config: EkfConfig) -> bool:
    """Return whether rim speeds [m/s] are those of wheels at rest."""
    return abs(left) < config.still_speed and abs(right) < config.still_speed


def quiet(rate: Triple, bias_variance: Triple, seconds: float, config: EkfConfig) -> bool:
    """Return whether bias and noise explain what a gyro shows.

    Args:
        rate: angular velocity less the estimated bias [rad/s].
        bias_variance: variance of that estimate [rad^2/s^2].
        seconds: interval over which the rate is a mean [s].
        config: noise and gate.
    """
    x, y, z = rate
    bx, by, bz = bias_variance
    noise = config.gyro_noise**2 / seconds
    return x * x / (bx + noise) + y * y / (by + noise) + z * z / (bz + noise) < config.still_gate


def rest_after(rest: Rest, force: Triple, seconds: float, config: EkfConfig) -> Rest:
    """Return the rest of a robot whose wheels and gyro stay quiet for another interval.

    A force that departs from the mean is a push or a lift: the rest then begins anew.

    Args:
        rest: before the interval.
        force: mean specific force in the interval [m/s^2].
        seconds: length of the interval [s].
        config: noise and gate.
    """
    if rest.seconds == 0.0:
        return Rest(seconds, force)
    x, y, z = (a - b for a, b in zip(force, rest.force, strict=True))
    if x * x + y * y + z * z > config.still_gate * config.still_force**2:
        return Rest(seconds, force, pushed=True)
    total = rest.seconds + seconds
    share = seconds / min(total, _MEMORY)
    mx, my, mz = rest.force
    return Rest(total, (mx + share * x, my + share * y, mz + share * z), rest.pushed)
