"""The wheels under watch: what KISS-ICP and a tyre's grip say against what they rolled."""

from __future__ import annotations

from scipy.stats import chi2

from localization.configuration import LocalizerConfig
from localization.geometry import FloatArray
from localization.suites import Motion
from localization.types import Pose

_SLIP_GATE = float(chi2.ppf(0.999, 1))
"""Beyond it KISS-ICP's forward motion contradicts the wheels' (99.9 %)."""


class WheelWatch:
    """Owns what is known of slip, and how the robot moved by other eyes than the wheels'."""

    def __init__(self, config: LocalizerConfig) -> None:
        self._config = config
        motion = config.suite.motion
        self._measured = config.suite.wheels or motion is Motion.ODOMETRY
        self._slip_until = -1
        self._rolled = 0.0
        self._rolling_before = 0.0
        self.speed: float | None = None
        """Forward speed [m/s] to go by while the wheels slip; None until KISS-ICP saw one."""
        self._turn = 0.0

    @property
    def seen(self) -> tuple[float, float]:
        """Forward speed [m/s] and yaw rate [rad/s] as KISS-ICP saw them last."""
        return self.speed or 0.0, self._turn

    def slipping(self, now: int) -> bool:
        """Return whether the wheels are distrusted at a stamp [ns]."""
        return now < self._slip_until

    def distrust(self, now: int) -> None:
        """Take note of a sign of slip at a stamp [ns]."""
        self._slip_until = now + self._config.slip_memory

    def grip(self, rolling: float, seconds: float, now: int) -> None:
        """Wheels that gain speed faster than any tyre can pass on are spinning.

        Args:
            rolling: forward speed that the rims amount to [m/s].
            seconds: since they were read before.
            now: [ns].
        """
        before, self._rolling_before = self._rolling_before, rolling
        if abs(rolling - before) > self._config.traction * seconds + self._config.traction_floor:
            if not self.slipping(now):
                self.speed = before
            self.distrust(now)

    def roll(self, way: float) -> None:
        """Add up how far the wheels rolled since the last sweep [m]."""
        self._rolled += way

    def rest(self) -> None:
        """Begin a new sweep: nothing rolled yet."""
        self._rolled = 0.0

    def plausible(self, motion: Pose, elapsed: float) -> bool:
        """Return whether the robot can have moved as KISS-ICP says it did.

        Wheels that spin or lock move a robot between not at all and as they roll, but for a shove.
        Without wheels, only a tyre's grip is known.

        Args:
            motion: ``base_then_from_base_now`` over the last sweep.
            elapsed: how long it took [s].
        """
        speed = float(motion.position[0]) / elapsed
        shove = self._config.shove
        if self._measured:
            rolled = self._rolled / elapsed
            return min(0.0, rolled) - shove <= speed <= max(0.0, rolled) + shove
        gain = speed - (self.speed or 0.0)
        return abs(gain) <= self._config.traction * elapsed + shove

    def see(self, motion: Pose, elapsed: float) -> None:
        """Take over speed and turning from a motion that KISS-ICP saw in ``elapsed`` seconds."""
        self.speed, self._turn = float(motion.position[0]) / elapsed, motion.yaw / elapsed

    def contradicted(
        self, motion: Pose, covariance: FloatArray, noise: float, elapsed: float
    ) -> bool:
        """Return whether the wheels rolled farther or less far than KISS-ICP saw the robot go.

        Args:
            motion: ``base_then_from_base_now`` as KISS-ICP saw it.
            covariance: (3, 3) of its x, y [m] and yaw [rad].
            noise: of wheels that do not slip, one sigma [m/s/sqrt(Hz)].
            elapsed: how long it took [s].
        """
        if not self._measured:
            return False
        off = float(motion.position[0]) - self._rolled
        return off**2 > _SLIP_GATE * (float(covariance[0, 0]) + noise**2 * elapsed)

    def mean_rolling(self, elapsed: float) -> float:
        """Return the mean speed that the wheels rolled with since the last sweep [m/s]."""
        return self._rolled / elapsed
