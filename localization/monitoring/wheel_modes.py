"""Modes of the wheels: whether they roll or slip, weighed by what is felt, what KISS-ICP sees and what the map shows.

A robot on rolling wheels is as fast as they are. One whose wheels slip is as fast as it was, and what is felt changes
that; the wheels say nothing of it. Either mode turns into the other at a rate, and each comparison of the wheels with
another witness multiplies the odds between them by how much better one explains the difference: two modes of a switching
Kalman filter (Blom and Bar-Shalom, IEEE Transactions on Automatic Control 33, 1988), of which the more probable one
gives the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from localization.errors import LocalizationError
from localization.filter.ekf import FilterState
from localization.filter.ekf_config import EkfConfig
from localization.filter.prediction import rolling_noise
from localization.filter.updates import CORRELATION
from localization.motion.kiss_odometry import ObservedMotion
from localization.motion.sensor_configuration import SensorConfiguration

_FORCE_ERROR = 0.06
"""Bias of an accelerometer, one sigma [m/s^2] (see ``EkfConfig.tilt``)."""
_ANY_SPEED = 1.0
"""Error of the speed before anything has measured it, one sigma [m/s]."""
_SURE = math.log(99.0)
"""Odds of slip, as a logarithm, after a difference that no rolling wheel makes."""


@dataclass(frozen=True, slots=True)
class WheelConfig:
    """How wheels come to slip, and what they are worth while they roll."""

    rates: tuple[float, float] = (0.014, 1.4)
    """How often wheels that roll begin to slip, and how soon slip that nothing shows any more ends [1/s]: half of it
    does in half a second."""
    noise: float = 0.05
    """Error of one reading of the wheels' speed, one sigma [m/s]."""
    max_acceleration: float = 9.0
    """Largest acceleration that tyres can transmit, for a friction coefficient of about 0.9 [m/s^2]: how fast the speed
    changes where nothing feels it."""

    def __post_init__(self) -> None:
        if not min(*self.rates, self.noise) > 0.0:
            raise LocalizationError(
                f"wheels.rates and wheels.noise must be above 0, got {self.rates} and {self.noise}"
            )


class WheelModes(NamedTuple):
    """The odds that the wheels slip, and the robot's speed; a value."""

    config: WheelConfig
    """Rates and noise."""
    sensors: SensorConfiguration
    """Which sensors the robot has."""
    ekf: EkfConfig
    """The noise of wheels that roll or slip."""
    odds: float
    """Logarithm of the odds that the wheels slip."""
    slipped_for: float = 0.0
    """Time since that became more probable than not [s]; 0 while they roll."""
    speed: float = 0.0
    """Forward speed [m/s]: the wheels measure it while they roll, all others always."""
    sigma: float = _ANY_SPEED
    """Its error, one sigma [m/s]."""
    turn_rate: float = 0.0
    """Yaw rate that KISS-ICP observed last [rad/s]."""
    rolling: float = 0.0
    """Forward speed that the wheels rolled when they were read last [m/s]."""
    rolled: float = 0.0
    """Distance that the wheels rolled since the last sweep [m]."""

    @classmethod
    def rolling_on(
        cls, config: WheelConfig, sensors: SensorConfiguration, ekf: EkfConfig
    ) -> WheelModes:
        """Return the modes of wheels that nobody has compared yet."""
        return cls(config, sensors, ekf, _usual(config))

    @property
    def slipping(self) -> bool:
        """Whether the wheels are more likely to slip than to roll."""
        return self.odds > 0.0

    @property
    def shows(self) -> bool:
        """Whether to say that the wheels slip.

        Displacements that a base counts itself stall and catch up: only slip that lasts longer than three quarters of
        all slips do is said.
        """
        if not self.sensors.displaced:
            return self.slipping
        _, ends = self.config.rates
        return self.slipping and self.slipped_for >= math.log(4.0) / ends

    @property
    def velocity(self) -> tuple[float, float]:
        """Forward speed [m/s] and yaw rate [rad/s] without the wheels."""
        return self.speed, self.turn_rate

    def after(
        self, seconds: float, acceleration: float | None = None, sigma: float = 0.0
    ) -> WheelModes:
        """Return the modes after some time: either may have turned into the other.

        Args:
            seconds: that passed.
            acceleration: felt meanwhile along the robot, without gravity [m/s^2]; None if nothing feels it.
            sigma: what the robot's tilt leaves open of it [m/s^2].
        """
        begins, ends = self.config.rates
        usual = begins / (begins + ends)
        kept = math.exp(-(begins + ends) * seconds)
        slips = usual + (1.0 / (1.0 + math.exp(-self.odds)) - usual) * kept
        # Unfelt, the change of speed is anything that tyres can transmit.
        unknown = (
            self.config.max_acceleration / math.sqrt(3.0)
            if acceleration is None
            else math.hypot(_FORCE_ERROR, sigma)
        )
        return self._replace(
            odds=math.log(slips) - math.log1p(-slips),
            slipped_for=self.slipped_for + seconds if self.slipping else 0.0,
            speed=self.speed + (acceleration or 0.0) * seconds,
            sigma=min(self.sigma + unknown * seconds, _ANY_SPEED),
        )

    def contradicted(self) -> WheelModes:
        """Return the modes after a witness contradicted the wheels by more than they can be off while they roll."""
        return self._replace(odds=max(self.odds, _SURE))

    def wheels_read(self, rolling: float, seconds: float) -> WheelModes:
        """Return the modes after a reading of the wheels, which may spin up or lock without the robot.

        Args:
            rolling: forward speed that the rims amount to [m/s].
            seconds: since they were read before; errors of the speed are the same for a while.
        """
        noise = self.config.noise**2
        share = min(1.0, seconds / CORRELATION)
        seen = self._weighed(share * self._evidence(rolling - self.speed, self.sigma**2 + noise))
        seen = seen._replace(rolling=rolling)
        return seen if seen.slipping else seen._measured(rolling, noise)

    def rolled_on(self, distance: float) -> WheelModes:
        """Return the modes after the wheels rolled for another distance [m]."""
        return self._replace(rolled=self.rolled + distance)

    def after_sweep(self) -> WheelModes:
        """Return the modes after a sweep, from which on the wheels' way counts."""
        return self._replace(rolled=0.0)

    def plausible(self, observed: ObservedMotion, elapsed: float) -> bool:
        """Return whether the robot can have moved as KISS-ICP observed.

        Wheels that spin or lock move a robot at a speed between none and their own, or it goes on as it was.

        Args:
            observed: motion since the last sweep.
            elapsed: time since then [s].
        """
        motion, covariance = observed
        seen, rolled = float(motion.position[0]) / elapsed, self.rolled / elapsed
        margin = self.ekf.gate(1) * (self.sigma**2 + float(covariance[0, 0]) / elapsed**2)
        low, high = min(0.0, rolled, self.speed), max(0.0, rolled, self.speed)
        return max(low - seen, seen - high, 0.0) ** 2 <= margin

    def compared(
        self, observed: ObservedMotion, elapsed: float, state: FilterState
    ) -> tuple[WheelModes, bool]:
        """Return the modes after the wheels were compared with KISS-ICP, and whether that contradicts them.

        They rolled farther, or less far, than the robot moved; or a robot that should stand moved sideways:
        pushed, or carried off.

        Args:
            observed: motion since the last sweep.
            elapsed: time since then [s].
            state: the filter's, for whether the robot stands.
        """
        c, (motion, covariance) = self.ekf, observed
        seen, turn = float(motion.position[0]) / elapsed, motion.yaw / elapsed
        error, modes = float(covariance[0, 0]) / elapsed**2, self._replace(turn_rate=turn)
        if not self.sensors.wheels:
            return modes._measured(seen, error), False
        rolled = self.rolled / elapsed
        rough = rolling_noise(c, rolled, turn) ** 2 / elapsed
        evidence = self._evidence(seen - rolled, error + rough)
        if state.standing(c):
            loose = float(covariance[1, 1]) / elapsed**2 + c.side_noise**2 / elapsed
            evidence += self._evidence(float(motion.position[1]) / elapsed, loose)
        modes = modes._weighed(evidence)._measured(seen, error)
        return modes, modes.slipping and evidence > 0.0

    def shown_by_map(self, way: float, elapsed: float, sigma: float) -> WheelModes:
        """Return the modes of wheels that slip after registered sweeps showed how far the robot came.

        KISS-ICP begins from its own speed while the wheels slip, and could run away. A sweep that fits elsewhere makes
        no robot faster.

        Args:
            way: forward motion since the last sweep, by the map [m].
            elapsed: time since then [s].
            sigma: of the position along the way [m].
        """
        error = 2.0 * (sigma / elapsed) ** 2
        off = (way / elapsed - self.speed) ** 2
        if not self.slipping or off > self.ekf.gate(1) * (self.sigma**2 + error):
            return self
        shown = self._measured(way / elapsed, error)
        if not self.sensors.wheels:
            return shown
        return shown._weighed(self._evidence(way / elapsed - self.rolling, error))

    def _evidence(self, off: float, variance: float) -> float:
        """Return the evidence of a difference of speeds for slip: that of a normal distribution which is so much wider.

        Args:
            off: the difference [m/s].
            variance: that it has while the wheels roll [m^2/s^2].
        """
        wider = variance + self.ekf.slip_forward**2 / CORRELATION
        return 0.5 * (off**2 * (1.0 / variance - 1.0 / wider) + math.log(variance / wider))

    def _weighed(self, evidence: float) -> WheelModes:
        """Return the modes after some evidence for slip; none makes it rarer than it usually is."""
        return self._replace(odds=max(self.odds + evidence, min(self.odds, _usual(self.config))))

    def _measured(self, speed: float, variance: float) -> WheelModes:
        """Return the modes after a measurement of the robot's speed [m/s]: a Kalman update."""
        known = self.sigma**2
        gain = known / (known + variance)
        return self._replace(
            speed=self.speed + gain * (speed - self.speed), sigma=math.sqrt((1.0 - gain) * known)
        )


def _usual(config: WheelConfig) -> float:
    """Return the logarithm of the odds that wheels slip of which nothing else is known."""
    begins, ends = config.rates
    return math.log(begins / ends)
