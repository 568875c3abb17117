"""Displacements of a base from the poses of its own odometry, whatever their stamps say about speed.

Poses are absolute: the difference of two is as good after a pause of seconds as after a tick, and loggers that
stamp in bursts change nothing. Noise belongs to the way driven and to the angle turned.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.mapping.planar_pose import between
from localization.motion.odometry_track import OdometryTrack
from localization.types import SECOND, Odometry, Pose

_MEMORY = 5 * SECOND
"""Poses older than the newest by more than this are dropped, but for the last two [ns]."""


@dataclass(frozen=True, slots=True)
class DisplacementNoise:
    """Errors of wheel odometry, one sigma.

    Real wheels turn by 5 to 7 degrees per metre more or less than they measure in one of twenty metres, and a
    skid-steered base's yaw is wrong by a factor of 0.5 to 1.9.
    """

    share: float = 0.08
    """Error of the way as a share of it, forward and sideways."""
    floor: float = 0.005
    """Error of a displacement in addition [m]."""
    turn_per_way: float = np.deg2rad(3.0)
    """Error of the turn [rad/sqrt(m)]."""
    turn_share: float = 0.2
    """Error of the turn as a share of it."""
    turn_floor: float = np.deg2rad(0.2)
    """Error of the turn in addition [rad]."""

    def covariance(self, step: FloatArray) -> FloatArray:
        """Return the covariance (3, 3) of a displacement (3,), x, y and yaw in the axes of its end."""
        way, turn = float(np.hypot(step[0], step[1])), abs(float(step[2]))
        along = (self.share * way) ** 2 + self.floor**2
        yaw = self.turn_per_way**2 * way + (self.turn_share * turn) ** 2 + self.turn_floor**2
        return np.diag([along, along, yaw])


class BasePoses:
    """Poses of a base in the order of their stamps; those of one instant are one."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._poses: list[Pose] = []

    @property
    def newest(self) -> int | None:
        """Largest stamp [ns]; None before the first pose."""
        return self._stamps[-1] if self._stamps else None

    def add(self, reading: Odometry) -> None:
        """Add a pose; one with the stamp of an earlier one replaces it."""
        k = bisect_left(self._stamps, reading.stamp)
        if k < len(self._stamps) and self._stamps[k] == reading.stamp:
            self._poses[k] = reading.odom_from_base
            return
        self._stamps.insert(k, reading.stamp)
        self._poses.insert(k, reading.odom_from_base)
        old = bisect_left(self._stamps, self._stamps[-1] - _MEMORY)
        drop = max(0, min(old, len(self._stamps) - 2))
        del self._stamps[:drop], self._poses[:drop]

    def track(self, own: Odometry | None = None) -> OdometryTrack:
        """Return the poses as a track to interpolate in.

        Args:
            own: Pose at the instant of a scan; the track is this pose at all times. The pose that a log gives
                with a scan is the one at its beams even where the stamps of its lines are in disorder.
        """
        if own is not None:
            pose = own.odom_from_base
            stamps = [own.stamp - 1, own.stamp]
            return OdometryTrack(
                _MEMORY, tuple((stamp, pose.position, pose.rotation) for stamp in stamps)
            )
        pairs = zip(self._stamps, self._poses, strict=True)
        return OdometryTrack(_MEMORY, tuple((s, p.position, p.rotation) for s, p in pairs))


def displacement(before: Pose, after: Pose) -> FloatArray:
    """Return the planar displacement (3,) from one pose of a base to another, in the axes of the first."""
    planar = [np.array([p.position[0], p.position[1], wrap_angle(p.yaw)]) for p in (before, after)]
    return between(planar[0], planar[1])
