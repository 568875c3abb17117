"""Wheel slip: what KISS-ICP observes and what tyres can transmit, against what the wheels rolled."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from localization.filter.ekf import FilterState
from localization.filter.ekf_config import EkfConfig
from localization.filter.prediction import rolling_noise
from localization.geometry import FloatArray
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import SECOND, Pose

_RECENT = 4
"""Slip that ended no longer ago than so many times its memory may be what wheels come back from."""
_ROOM = 3.0
"""So many sigma a position, or a speed, may be off."""
_UNSEEN = 2.0
"""KISS-ICP sees nothing of the speed if it did not for so many windows."""
_FORCE_ERROR = 0.06
"""Bias of an accelerometer, one sigma [m/s^2] (see ``EkfConfig.tilt``)."""


class SlipSettings(Protocol):
    """What ``LocalizerConfig`` says of slip; the names are explained there."""

    @property
    def sensors(self) -> SensorConfiguration:
        """Which sensors the robot has."""

    @property
    def ekf(self) -> EkfConfig:
        """The noise of rolling wheels."""

    @property
    def slip_memory(self) -> int:
        """How long wheels are distrusted [ns]."""

    @property
    def slip_window(self) -> float:
        """Time over which wheels and KISS-ICP are compared [s]."""

    @property
    def overspeed_margin(self) -> float:
        """How much faster than its wheels a robot moves [m/s]."""

    @property
    def wheel_speed_noise(self) -> float:
        """Change of wheel speed that noise causes [m/s]."""

    @property
    def max_acceleration(self) -> float:
        """What tyres transmit [m/s^2]."""


class SlipDetector(NamedTuple):
    """What is known of slip, and the robot's velocity as observed without the wheels; a value.

    Over a few hundredths of a second KISS-ICP's millimetres are a speed that no wheel has. The motions of
    sweeps that arrive fast are therefore put together until they cover ``LocalizerConfig.slip_window``, and
    compared with the wheels as one: ``observed``, then, if ``complete``, ``plausible``, ``confirmed`` and
    ``contradicted``, then ``restarted``.
    """

    config: SlipSettings
    """The thresholds."""
    slip_until: int = -1
    """The wheels are distrusted before this stamp [ns]."""
    slip_since: int = -1
    """Stamp of the first sign of slip in the present stretch of time in which they are [ns]."""
    rolling_speed: float = 0.0
    """Forward speed that the wheels rolled when they were read last [m/s]."""
    rolled: float = 0.0
    """Distance that the wheels rolled in the present window [m]."""
    last_speed: float = 0.0
    """Mean speed at which the wheels rolled in the window before [m/s]."""
    trusted_speed: float = 0.0
    """Mean speed at which the wheels rolled before they were distrusted last, or that the map has shown since
    then [m/s]."""
    motion: Pose | None = None
    """Motion ``base_then_from_base_now`` that KISS-ICP observed in the present window."""
    elapsed: float = 0.0
    """Length of the present window [s]."""
    speed: float | None = None
    """Forward speed [m/s] to use while the wheels slip: the last that was observed or that trusted wheels rolled, and what
    was felt since then; None before the first."""
    speed_sigma: float = 0.0
    """Its error when the wheels came in doubt, or when it was observed since then, one sigma [m/s]."""
    felt_sigma: float = 0.0
    """Error of what was felt since then, one sigma [m/s]."""
    unseen: float = 0.0
    """Time since then [s]."""
    turn_rate: float = 0.0
    """Yaw rate that KISS-ICP observed last [rad/s]."""
    ahead: float = 0.0
    """Way of the robot by the map beyond what the wheels rolled, in a stretch of time in which they are distrusted [m]."""
    compared: float = 0.0
    """Length of that stretch so far [s]."""

    @property
    def velocity(self) -> tuple[float, float]:
        """Forward speed [m/s] and yaw rate [rad/s] as KISS-ICP observed them last."""
        return self.speed or 0.0, self.turn_rate

    @property
    def _measured(self) -> bool:
        """Whether anything measures how the wheels roll."""
        sensors = self.config.sensors
        return sensors.wheels or sensors.displaced

    def slipping(self, now: int) -> bool:
        """Return whether the wheels are distrusted at a stamp [ns]."""
        return now < self.slip_until

    def shows(self, now: int) -> bool:
        """Return whether to say at a stamp [ns] that the wheels slip.

        Displacements that a base counts itself stall and catch up, and only what contradicts them for longer is slip.
        """
        if not self.config.sensors.displaced:
            return self.slipping(now)
        return (
            self.slipping(now) and self.slip_until - self.slip_since >= 2 * self.config.slip_memory
        )

    def distrusted(self, now: int) -> SlipDetector:
        """Return the detector after a sign of slip at a stamp [ns]."""
        until = now + self.config.slip_memory
        if self.slipping(now):
            return self._replace(slip_until=until)
        sigma = self.config.wheel_speed_noise
        return self._replace(
            slip_until=until,
            slip_since=now,
            trusted_speed=self.last_speed,
            speed_sigma=sigma,
            felt_sigma=0.0,
            unseen=0.0,
        )

    def wheels_read(self, rolling: float, seconds: float, now: int) -> SlipDetector:
        """Return the detector after a reading of the wheels, which may spin up faster than tyres can grip.

        Args:
            rolling: forward speed that the rims amount to [m/s].
            seconds: since they were read before.
            now: stamp of the reading [ns].
        """
        c, before = self.config, self.rolling_speed
        detector = self._replace(rolling_speed=rolling)
        if self.slipping(now) and self._refuted(rolling):
            return detector.distrusted(now)
        if abs(rolling - before) <= c.max_acceleration * seconds + c.wheel_speed_noise:
            return detector
        if self._grips_again(rolling, now):
            return detector
        if not self.slipping(now):
            detector = detector._replace(speed=before)
        return detector.distrusted(now)

    def felt(self, acceleration: float, sigma: float, seconds: float, now: int) -> SlipDetector:
        """Return the detector after an acceleration was felt [m/s^2]: it carries the speed on while the wheels slip.

        Between bare walls nothing else distinguishes wheels that spin from wheels that grip again at another speed. Its
        errors add up: after two or three seconds at walking pace the wheels are believed again.

        Args:
            acceleration: along the robot, without gravity [m/s^2].
            sigma: what the robot's tilt leaves open of it [m/s^2].
            seconds: for how long.
            now: stamp of the reading [ns].
        """
        if self.speed is None or not self.slipping(now):
            return self
        gained = acceleration * seconds
        return self._replace(
            speed=self.speed + gained,
            trusted_speed=self.trusted_speed + gained,
            felt_sigma=self.felt_sigma + math.hypot(_FORCE_ERROR, sigma) * seconds,
            unseen=self.unseen + seconds,
        )

    def _refuted(self, rolling: float) -> bool:
        """Return whether wheels that are distrusted roll at a speed that the robot surely does not have [m/s].

        Where KISS-ICP sees the way, it contradicts them itself: a robot that climbs or is shoved feels more than its speed.
        """
        c = self.config
        if self.speed is None or self.unseen < _UNSEEN * c.slip_window:
            return False
        sigma = math.hypot(self.speed_sigma, self.felt_sigma)
        return abs(rolling - self.speed) > c.wheel_speed_noise + _ROOM * sigma

    def _grips_again(self, rolling: float, now: int) -> bool:
        """Return whether wheels that have slipped roll at the robot's speed of before again.

        They were trusted once nothing had contradicted them for a while: between walls nothing does.
        """
        c = self.config
        recent = 0 <= now - self.slip_until < _RECENT * c.slip_memory
        off, was_off = (
            abs(rolling - self.trusted_speed),
            abs(self.rolling_speed - self.trusted_speed),
        )
        return recent and off < c.overspeed_margin < was_off

    def shown_by_map(self, way: float, elapsed: float, sigma: float, now: int) -> SlipDetector:
        """Return the detector after registered sweeps showed how far the robot came.

        KISS-ICP begins from its own speed while the wheels are distrusted, and could run away. Between walls it
        sees no motion along them, and what the wheels read may be as wrong as it was: as long as the map
        contradicts them, they are distrusted.

        Args:
            way: forward motion since the last sweep, by the map [m].
            elapsed: time since then [s].
            sigma: of the position along the way [m].
            now: stamp of the sweep [ns].
        """
        if not self.slipping(now):
            return self._replace(ahead=0.0, compared=0.0)
        # A sweep that fits elsewhere makes no robot as fast as that.
        low, high = self._reach(now)
        margin = self.config.overspeed_margin
        shown = self._replace(
            trusted_speed=min(max(way / elapsed, low - margin), high + margin),
            ahead=self.ahead + way - self.rolling_speed * elapsed,
            compared=self.compared + elapsed,
        )
        fresh = shown._replace(ahead=0.0, compared=0.0)
        room = margin * shown.compared + _ROOM * sigma
        if self.config.sensors.wheels and abs(shown.ahead) > room:
            return fresh.distrusted(now)
        return shown if shown.compared * SECOND < self.config.slip_memory else fresh

    def rolled_on(self, distance: float) -> SlipDetector:
        """Return the detector after the wheels rolled for another distance [m]."""
        return self._replace(rolled=self.rolled + distance)

    def restarted(self) -> SlipDetector:
        """Return the detector at the beginning of a new window."""
        last = self.rolled / self.elapsed if self.elapsed > 0.0 else self.last_speed
        return self._replace(last_speed=last, rolled=0.0, motion=None, elapsed=0.0)

    def observed(self, motion: Pose, elapsed: float) -> SlipDetector:
        """Return the detector after KISS-ICP observed a motion.

        Args:
            motion: ``base_then_from_base_now`` since the last sweep.
            elapsed: time since the last sweep [s].
        """
        way = motion if self.motion is None else self.motion @ motion
        return self._replace(motion=way, elapsed=self.elapsed + elapsed)

    def unobserved(self, elapsed: float, now: int) -> SlipDetector:
        """Return the detector after a sweep in which KISS-ICP observed nothing; what it observed before grows old.

        Args:
            elapsed: time since the last sweep [s].
            now: stamp of the sweep [ns].
        """
        if not self.config.sensors.wheels:
            return self.restarted()
        window = self._replace(elapsed=self.elapsed + elapsed).restarted()
        speed = self.trusted_speed if self.slipping(now) else window.last_speed
        return window._replace(speed=speed)

    @property
    def complete(self) -> bool:
        """Whether the window is long enough to compare wheels and KISS-ICP."""
        return self.elapsed >= self.config.slip_window

    def plausible(self, now: int) -> bool:
        """Return whether the robot can have moved as KISS-ICP observed.

        Wheels that spin or lock move a robot at a speed between none and their own, but for a push. While they
        are distrusted, it may go on at their speed of before, or as the map shows: it slides, or its encoders
        read nothing. Without wheels, only the grip of tyres bounds the change of speed.

        Args:
            now: stamp at the end of the window [ns].
        """
        c = self.config
        speed, _ = self._observed_velocity
        if self._measured:
            rolled = self.rolled / self.elapsed
            before = self.trusted_speed if self.slipping(now) else 0.0
            low, high = min(0.0, rolled, before), max(0.0, rolled, before)
            return low - c.overspeed_margin <= speed <= high + c.overspeed_margin
        gain = speed - (self.speed or 0.0)
        return abs(gain) <= c.max_acceleration * self.elapsed + c.overspeed_margin

    def _reach(self, now: int) -> tuple[float, float]:
        """Return the least and the greatest speed that wheels, or a robot that goes on as before, may have [m/s]."""
        before = self.trusted_speed if self.slipping(now) else 0.0
        speeds = (0.0, self.last_speed, self.rolling_speed, before)
        return min(speeds), max(speeds)

    def confirmed(self, covariance: FloatArray, now: int) -> SlipDetector:
        """Return the detector with the speed and yaw rate that KISS-ICP observed.

        Along a bare corridor it observes none, and returns what it began with: while the wheels slip, a speed counts
        by its error beside that of the speed known before, which a push may have changed.

        Args:
            covariance: (3, 3) of the x, y [m] and yaw [rad] observed last.
            now: stamp at the end of the window [ns].
        """
        speed, turn_rate = self._observed_velocity
        if self.speed is None or not self.slipping(now):
            return self._replace(speed=speed, turn_rate=turn_rate)
        sigma = math.hypot(self.speed_sigma, self.felt_sigma)
        known = sigma**2 + self.config.overspeed_margin**2
        error = float(covariance[0, 0]) / self.elapsed**2
        seen = self._replace(
            speed=self.speed + known / (known + error) * (speed - self.speed), turn_rate=turn_rate
        )
        if error > sigma**2:
            return seen
        return seen._replace(speed_sigma=error**0.5, felt_sigma=0.0, unseen=0.0)

    def contradicted(self, covariance: FloatArray, state: FilterState) -> bool:
        """Return whether KISS-ICP observed that the wheels slipped.

        They rolled farther, or less far, than the robot moved; or a robot that should stand moved sideways:
        pushed, or carried off.

        Args:
            covariance: (3, 3) of the x, y [m] and yaw [rad] observed last; KISS-ICP refers to its local
                map, so that its error does not grow with the number of sweeps.
            state: the filter's, for whether the robot stands.
        """
        if not self._measured or self.motion is None:
            return False
        ekf = self.config.ekf
        off = float(self.motion.position[0]) - self.rolled
        _, turn = self._observed_velocity
        noise = rolling_noise(ekf, self.rolled / self.elapsed, turn)
        if self._outruns(off):
            return False
        # Variances of both: KISS-ICP's, and the random walk of rolling wheels over the window.
        if off**2 > ekf.gate(1) * (float(covariance[0, 0]) + noise**2 * self.elapsed):
            return True
        sideways, loose = float(self.motion.position[1]), ekf.side_noise**2 * self.elapsed
        gate = ekf.gate(1) * (float(covariance[1, 1]) + loose)
        return state.standing(ekf) and sideways**2 > gate

    def _outruns(self, off: float) -> bool:
        """Return whether the robot would run ahead of wheels that speed up, by ``off`` [m].

        A tyre pulls towards the speed of its rim, so that no slip explains it. An artefact of KISS-ICP does:
        its local map has one view of the place where a robot stood, holds it back by a centimetre as it
        sets off, and lets go.
        """
        rolled = self.rolled / self.elapsed
        gains = abs(rolled) - abs(self.last_speed) > self.config.wheel_speed_noise / 2
        return gains and off * rolled > 0.0

    @property
    def _observed_velocity(self) -> tuple[float, float]:
        """Forward speed [m/s] and yaw rate [rad/s] in the present window."""
        if self.motion is None or self.elapsed <= 0.0:
            return 0.0, 0.0
        return float(self.motion.position[0]) / self.elapsed, self.motion.yaw / self.elapsed
