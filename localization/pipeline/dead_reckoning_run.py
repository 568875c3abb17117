"""A log without scanner, or without a map, on its way through dead reckoning."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Final

import numpy as np
from scipy.linalg import block_diag

from localization.config import LocalizerConfig
from localization.filter.dead_reckoning import DeadReckoner
from localization.logs.continuity import LogContinuity
from localization.logs.log_interface import LogError, ReadingsLog
from localization.maps.cloud import Cloud
from localization.motion.displacement import odometry_step, speed_step
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import (
    Estimate,
    Health,
    Hint,
    HintVerdict,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Scan,
    WheelSpeeds,
)

_FIRST_READINGS: Final = 5000
"""Number of readings at the beginning from which the source of the motion is chosen."""
_WHEELS_ALONE: Final = 0.02
"""Share of the steps turned by wheels alone from which that is noted, in a log with an inertial unit."""


class DeadReckoningRun:
    """A log on its way through dead reckoning, with the interface of ``LogRun``: no estimate is kept.

    Estimates are ``degraded``, for no map corrects them. Without a map and a start pose, ``map_from_base`` equals
    ``odom_from_base``, in the frame where the log began: with the heading that the inertial unit reports, otherwise with
    heading zero. Iterate it once; afterwards ``notes`` is complete.
    """

    log: ReadingsLog
    cloud: Cloud | None
    """The map that the path is drawn in; None without one."""
    config: LocalizerConfig
    """Its settings; only those of the filter are used."""
    mounts: dict[str, Pose]
    """Always empty: no scanner is used."""
    verdicts: list[HintVerdict]
    """Always empty: hints are not answered."""

    def __init__(
        self,
        log: ReadingsLog,
        config: LocalizerConfig,
        *,
        cloud: Cloud | None = None,
        start: Pose | None = None,
        sensors: SensorConfiguration | None = None,
    ) -> None:
        """Choose the sources of the motion.

        Args:
            log: The log.
            config: Settings, as ``LogRun`` uses them.
            cloud: Map to show the path in.
            start: Pose in the map at which the log begins, taken as exact.
            sensors: Sensors to use; the best that the log has, on uneven ground, unless given.

        Raises:
            LogError: If the log holds neither odometry nor wheels, or not those that are asked for.
        """
        self.log, self.cloud, self.config = log, cloud, config
        self.mounts, self.verdicts = {}, []
        self._start, self._sensors = start, sensors
        seen, self._by_twist = _first_look(log)
        log.share = 0.0
        self._wheels = _motion_source(log, seen, sensors)
        self._inertial = Inertial in seen and (
            sensors is None or sensors.motion not in (Motion.WHEELS, Motion.ODOMETRY)
        )
        self._continuity = LogContinuity(log)
        flat = sensors is not None and sensors.flat
        self._reckoner = DeadReckoner.begun(config.ekf, flat=flat, gyro=self._inertial)
        self._before: Odometry | WheelSpeeds | None = None
        self._counted = Pose.identity()
        self._scans = self._hints = self._resets = self._steps = 0

    @property
    def why(self) -> str:
        """Why it is dead reckoning."""
        return "no scanner in the log" if not self.log.mounts else "no map"

    @property
    def motion(self) -> str:
        """What the motion is made of."""
        wheels = "velocity" if self._by_twist else "displacement"
        wheels = "rim speeds" if self._wheels is WheelSpeeds else f"{wheels} of the odometry"
        if not self._inertial:
            return f"{wheels}, turned by the wheels"
        if not self._reckoner.oriented:
            return f"{wheels}, turned by the gyro"
        heading = "roll and pitch" if self._reckoner.first_yaw is None else "orientation"
        return f"{wheels}, turned by gyro and the {heading} that the inertial unit reports"

    def __iter__(self) -> Iterator[Estimate]:
        """Yield an estimate at each step of the wheels that advances time."""
        stamp = -1
        for reading in self.log:
            self._continuity.observe(reading)
            self._scans += isinstance(reading, Scan | PointScan)
            self._hints += isinstance(reading, Hint)
            if isinstance(reading, Inertial) and self._inertial:
                self._reckoner = self._reckoner.take(reading)
            if not isinstance(reading, self._wheels):
                continue
            self._reckoner = self._reckoner.take(self._odometry(reading))
            if reading.stamp > stamp:
                stamp = reading.stamp
                yield self._estimate(stamp)

    def _odometry(self, reading: Odometry | WheelSpeeds) -> Odometry:
        """Return the pose that the wheels counted, summed up where they report speeds alone."""
        before, self._before = self._before, reading
        self._steps += before is not None
        if isinstance(reading, Odometry) and not self._by_twist:
            self._resets += isinstance(before, Odometry) and odometry_step(before, reading) is None
            return reading
        if before is not None:
            step = speed_step(before, reading, self.config.ekf.effective_track)
            self._counted = self._counted if step is None else self._counted @ step
        return Odometry(reading.stamp, self._counted)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks about the log: what was not used, and what is unusual about it."""
        notes = [*self.log.warnings, *(f"{self.log.path}: {n}" for n in self._continuity.notes)]
        notes += [
            f"{s.count} messages on {t} skipped: {s.reason}" for t, s in self.log.skipped.items()
        ]
        if self._scans:
            notes.append(
                f"no map: {self._scans} scans were not used; `farsteer map` makes a map of them"
            )
        if self._hints:
            notes.append(f"{self._hints} hints were not used: give the first pose as the start")
        if self.cloud is not None and self._start is None:
            notes.append(
                "no start was given: the path begins at the map's origin, wherever the robot was"
            )
        if self._resets:
            notes.append(
                f"the odometry began to count anew {self._resets} times; the motion in between is unknown"
            )
        alone = self._reckoner.wheel_turned
        if self._inertial and alone > _WHEELS_ALONE * max(self._steps, 1):
            notes.append(
                f"the inertial unit was silent for {alone} of {self._steps} steps, whose turns are the wheels'"
            )
        return tuple(notes)

    def _estimate(self, stamp: int) -> Estimate:
        state, start = self._reckoner, self._start
        odom_from_start = Pose.planar(0.0, 0.0, state.first_yaw or 0.0)
        odom = odom_from_start @ state.pose
        map_from_start = odom_from_start if start is None else start
        turn = block_diag(map_from_start.rotation, np.eye(3))
        return Estimate(
            stamp=stamp,
            map_from_base=odom if start is None else start @ state.pose,
            odom_from_base=odom,
            covariance=turn @ state.covariance @ turn.T,
            twist=state.filter.twist,
            health=Health.DEGRADED,
            reasons=(f"dead-reckoned: {self.why}",),
        )


def _first_look(log: ReadingsLog) -> tuple[set[type], bool]:
    """Return the kinds of readings at a log's beginning, and whether its odometry reports velocities alone."""
    seen: set[type] = set()
    first: Odometry | None = None
    stands, moves = True, False
    for reading in islice(log, _FIRST_READINGS):
        seen.add(type(reading))
        if isinstance(reading, Odometry):
            first = first or reading
            step = first.odom_from_base.inverse() @ reading.odom_from_base
            stands &= not step.position.any() and step.yaw == 0.0
            moves |= reading.twist is not None
    return seen, stands and moves


def _motion_source(
    log: ReadingsLog, seen: Iterable[type], sensors: SensorConfiguration | None
) -> type[Odometry] | type[WheelSpeeds]:
    """Return the kind of readings that hold the steps of the wheels."""
    wanted: tuple[type[Odometry] | type[WheelSpeeds], ...] = (Odometry, WheelSpeeds)
    if sensors is not None:
        if sensors.wheels:
            wanted = (WheelSpeeds,)
        elif sensors.motion in (Motion.GYRO, Motion.SCANNER):
            raise LogError(
                f"{log.path}: motion {sensors.motion} needs a scanner and a map: without them speed comes from"
                " wheels or odometry alone"
            )
        else:
            wanted = (Odometry,)
    found = [kind for kind in wanted if kind in seen]
    if not found:
        names = {Odometry: "odometry", WheelSpeeds: "wheel speeds"}
        raise LogError(
            f"{log.path}: cannot be dead-reckoned: its first {_FIRST_READINGS} readings hold no"
            f" {' or '.join(names[kind] for kind in wanted)}"
        )
    return found[0]
