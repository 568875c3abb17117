"""The wheels under watch: what KISS-ICP and a tyre's grip say against what they rolled."""

from __future__ import annotations

from scipy.stats import chi2

from localization.config import LocalizerConfig
from localization.filter.ekf import SkidSteerEkf
from localization.geometry import FloatArray
from localization.motion.motion_model import Motion
from localization.types import Pose

_SLIP_GATE = float(chi2.ppf(0.999, 1))
"""Beyond it KISS-ICP's forward motion contradicts the wheels' (99.9 %)."""


class WheelWatch:
    """Owns what is known of slip, and how the robot moved by other eyes than the wheels'."""

    def __init__(self, config: LocalizerConfig) -> None:
        self._config = config
        motion = config.sensors.motion
        self._measured = config.sensors.wheels or motion is Motion.ODOMETRY
        self._slip_until = -1
        self._rolled, self._rolling_before = 0.0, 0.0
        self._judged = 0.0
        self._way: Pose | None = None
        self._time = 0.0
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
        if (
            abs(rolling - before)
            > self._config.max_acceleration * seconds + self._config.wheel_speed_noise
        ):
            if not self.slipping(now):
                self.speed = before
            self.distrust(now)

    def roll(self, way: float) -> None:
        """Add up how far the wheels rolled [m]."""
        self._rolled += way

    def rest(self) -> None:
        """Begin anew: nothing rolled yet, nothing seen."""
        self._judged = self._rolled / self._time if self._time else self._judged
        self._rolled, self._way, self._time = 0.0, None, 0.0

    def look(self, motion: Pose, elapsed: float) -> bool:
        """Take note of a motion that KISS-ICP saw; return whether it is time to judge by it.

        Over a few hundredths of a second KISS-ICP's millimetres are a speed that no wheel has. So the
        motions of sweeps that come fast are put together, and judged as one.

        Args:
            motion: ``base_then_from_base_now`` since the last sweep.
            elapsed: how long that took [s].
        """
        self._way = motion if self._way is None else self._way @ motion
        self._time += elapsed
        return self._time >= self._config.slip_window

    def plausible(self) -> bool:
        """Return whether the robot can have moved as KISS-ICP saw it move.

        Wheels that spin or lock move a robot between not at all and as they roll, but for a shove.
        Without wheels, only a tyre's grip is known.
        """
        speed, _ = self._seen_now()
        shove = self._config.overspeed_margin
        if self._measured:
            rolled = self._rolled / self._time
            return min(0.0, rolled) - shove <= speed <= max(0.0, rolled) + shove
        gain = speed - (self.speed or 0.0)
        return abs(gain) <= self._config.max_acceleration * self._time + shove

    def believe(self) -> None:
        """Take over speed and turning from what KISS-ICP saw."""
        self.speed, self._turn = self._seen_now()

    def contradicted(self, covariance: FloatArray, ekf: SkidSteerEkf) -> bool:
        """Return whether the wheels rolled farther or less far than KISS-ICP saw the robot go.

        Or whether it saw a robot go sideways that should stand: pushed, or carried off.

        Args:
            covariance: (3, 3) of the x, y [m] and yaw [rad] that it saw last; since it goes by its local
                map, its error does not grow with the number of sweeps.
            ekf: knows how exact wheels are that do not slip.
        """
        if not self._measured or self._way is None:
            return False
        _, turn = self._seen_now()
        noise = ekf.rolling_noise(self._rolled / self._time, turn)
        off = float(self._way.position[0]) - self._rolled
        if self._outruns(off):
            return False
        if off**2 > _SLIP_GATE * (float(covariance[0, 0]) + noise**2 * self._time):
            return True
        aside, loose = float(self._way.position[1]), ekf.config.side_noise**2 * self._time
        return ekf.standing and aside**2 > _SLIP_GATE * (float(covariance[1, 1]) + loose)

    def _outruns(self, off: float) -> bool:
        """Return whether the robot would run ahead of wheels that speed up, by ``off`` [m].

        A tyre pulls towards its rim's speed, so no slip does that. KISS-ICP does: its local map has one
        view of the place where a robot stood, holds it back by a centimetre as it sets off, and lets go.
        """
        rolled = self._rolled / self._time
        gains = abs(rolled) - abs(self._judged) > self._config.wheel_speed_noise / 2
        return gains and off * rolled > 0.0

    def _seen_now(self) -> tuple[float, float]:
        """Forward speed [m/s] and yaw rate [rad/s] since the last judgement."""
        if self._way is None:
            return 0.0, 0.0
        return float(self._way.position[0]) / self._time, self._way.yaw / self._time
