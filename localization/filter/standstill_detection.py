"""Whether a robot stands: what wheels, gyro and accelerometer agree on, and for how long."""

from __future__ import annotations

from dataclasses import dataclass

from localization.filter.ekf_config import EkfConfig

Triple = tuple[float, float, float]

_MEMORY = 2.0
"""The mean force at rest is that of the last so many seconds: long beside what noise there is, short
beside a ramp that a robot is driven up."""


@dataclass(frozen=True, slots=True)
class Rest:
    """How long nothing has moved, and the mean force meanwhile."""

    seconds: float = 0.0
    """[s]; 0 while the robot moves."""
    force: Triple = (0.0, 0.0, 0.0)
    """Specific force [m/s^2]."""
    pushed: bool = False
    """Whether it began when the force changed; the robot may glide."""

    @property
    def undisturbed(self) -> bool:
        """Whether nothing moves at the moment, and nobody pushed."""
        return self.seconds > 0.0 and not self.pushed

    def stands(self, config: EkfConfig) -> bool:
        """Return whether that is long enough for the robot to stand."""
        return 0.0 < self.seconds >= (config.still_recover if self.pushed else config.still_settle)


MOVING = Rest()


def wheels_stand(left: float, right: float, config: EkfConfig) -> bool:
    """Return whether rim speeds [m/s] are those of wheels that stand."""
    return abs(left) < config.still_speed and abs(right) < config.still_speed


def quiet(rate: Triple, bias_variance: Triple, seconds: float, config: EkfConfig) -> bool:
    """Return whether a gyro shows no more than its bias and its noise can be.

    Args:
        rate: angular velocity, the bias as it is known taken off [rad/s].
        bias_variance: how well it is known [rad^2/s^2].
        seconds: over which the rate is a mean [s].
        config: noise and gate.
    """
    x, y, z = rate
    bx, by, bz = bias_variance
    noise = config.gyro_noise**2 / seconds
    return x * x / (bx + noise) + y * y / (by + noise) + z * z / (bz + noise) < config.still_gate


def rest_after(rest: Rest, force: Triple, seconds: float, config: EkfConfig) -> Rest:
    """Return the rest of a robot whose wheels and gyro stay quiet for another moment.

    A force that departs from the mean is a push, or hands that lift it: rest then begins anew.

    Args:
        rest: as it was.
        force: mean specific force of the moment [m/s^2].
        seconds: how long it is [s].
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
