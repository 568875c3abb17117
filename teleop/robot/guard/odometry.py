"""Where the robot was in the last half second, by its wheels and its gyro: what carries points from scan to scan."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from localization.geometry import FloatArray
from localization.types import SECOND, Inertial, Reading, WheelSpeeds
from robot_sim import SkidSteer
from teleop.robot.guard.beams import planar
from teleop.robot.guard.braking import along_arc
from teleop.robot.guard.outline import Outline

_KEPT: Final = SECOND // 2
"""Time for which poses are kept [ns]; a sweep of the slowest scanner takes 0.1 s."""
_TRAIL: Final = 3.0
"""Length of the path just driven that is kept [m]: chosen, several times the robot's length."""
_STRIDE: Final = 0.05
"""Distance between two poses of it [m], and angle times 0.3 m."""
_STANDS: Final = 0.01
"""Speed of a wheel's rim up to which it stands [m/s]: five sigma of the encoders."""
_BIAS: Final = 0.03
"""Largest turn rate of a standing robot that is taken for a part of the gyro's bias [rad/s]: three times that of a small
MEMS unit at switching on; more is a robot that is turned by hand."""
_FASTEST: Final = 20.0
"""Speed of a wheel's rim from which on an encoder is wrong [m/s]: ten times that of the fastest platform."""
_TREMBLE: Final = 0.02
"""Turn rate that is taken for the gyro's noise [rad/s]: what stands beside a robot that drives straight on would else seem
to come nearer now and then."""
_LEARNT: Final = 100
"""Readings over which the bias is averaged: a second."""


class Odometry:
    """Owns the pose in a plane of its own; the wheels say how far, the gyro by how much it turns."""

    def __init__(self, robot: SkidSteer, outline: Outline) -> None:
        self._track, self._outline = robot.effective_track, outline
        self.pose = (0.0, 0.0, 0.0)
        """x, y [m] and yaw [rad]."""
        self.speeds = (0.0, 0.0)
        """Forward speed [m/s] and turn rate [rad/s]."""
        self._poses: deque[tuple[int, float, float, float]] = deque([(0, 0.0, 0.0, 0.0)])
        self._gyro_stamp = -SECOND
        self._trail: deque[tuple[float, float, float, bool]] = deque([(*self.pose, False)])
        self._wheel_stamp = 0
        self._bias, self._rested = 0.0, 0
        self.driven = 0.0
        """Way so far, with 0.35 m for each radian [m]: what remembered points drift by."""
        self.stands = False
        """Whether the wheels stand."""

    def add(self, reading: Reading) -> None:
        """Add a reading of wheels or gyro; others are ignored."""
        x, y, yaw = self.pose
        if isinstance(reading, Inertial):
            rate = float(reading.angular_velocity[2])
            dt = (reading.stamp - self._gyro_stamp) / SECOND
            self._gyro_stamp = reading.stamp
            if 0.0 < dt < 0.5 and math.isfinite(rate):
                rate = self._unbiased(rate)
                yaw += rate * dt
                self.speeds = (self.speeds[0], rate if abs(rate) > _TREMBLE else 0.0)
        elif isinstance(reading, WheelSpeeds):
            dt = (reading.stamp - self._wheel_stamp) / SECOND
            self._wheel_stamp = reading.stamp
            if not max(abs(reading.left), abs(reading.right)) < _FASTEST:
                return
            self.stands = max(abs(reading.left), abs(reading.right)) < _STANDS
            forward = 0.5 * (reading.left + reading.right)
            turn = (reading.right - reading.left) / self._track
            x, y = x + forward * dt * math.cos(yaw), y + forward * dt * math.sin(yaw)
            if reading.stamp - self._gyro_stamp > _KEPT:  # no gyro: the wheels must do
                yaw += turn * dt
                self.speeds = (forward, turn)
            self.speeds = (forward, self.speeds[1])
        else:
            return
        then = self.pose
        self.driven += math.hypot(x - then[0], y - then[1]) + 0.35 * abs(yaw - then[2])
        self.pose = (x, y, yaw)
        self._poses.append((reading.stamp, x, y, yaw))
        while self._poses[0][0] < reading.stamp - _KEPT:
            self._poses.popleft()
        last = self._trail[-1]
        if math.hypot(x - last[0], y - last[1]) + 0.3 * abs(yaw - last[2]) > _STRIDE:
            self._trail.append((*self.pose, self.speeds[0] < 0.0))
            if len(self._trail) > round(_TRAIL / _STRIDE):
                self._trail.popleft()

    def _unbiased(self, rate: float) -> float:
        """Return a turn rate without the bias, which shows while the wheels stand [rad/s].

        Unless it is taken away, what is remembered turns around a robot that stands: by 6 degrees in ten seconds.
        """
        if self.stands and abs(rate - self._bias) < _BIAS:
            self._rested = min(self._rested + 1, _LEARNT)
            self._bias += (rate - self._bias) / self._rested
            return 0.0
        return rate - self._bias

    def at(self, stamps: FloatArray) -> FloatArray:
        """Return the poses (N, 3) at times (N,) of the last half second [ns]."""
        known = np.array(self._poses)
        return np.stack([np.interp(stamps, known[:, 0], known[:, i]) for i in (1, 2, 3)], -1)

    def into_base(self, points: FloatArray) -> FloatArray:
        """Return points (N, 2) of the plane in ``base_link`` now."""
        x, y, yaw = self.pose
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = points[:, 0] - x, points[:, 1] - y
        return np.stack((c * dx + s * dy, c * dy - s * dx), -1)

    def out_of_base(self, points: FloatArray) -> FloatArray:
        """Return points (N, 2) in ``base_link`` now, in the plane."""
        return planar(points, np.array([self.pose]))

    def gaps(self, points: FloatArray) -> FloatArray:
        """Return the distances (N,) of points (N, 2) in ``base_link`` from the robot's outline [m]; negative inside."""
        return self._outline.gaps(np.zeros(3), points)

    def forget_trail(self) -> None:
        """Forget the path just driven."""
        self._trail = deque([(*self.pose, False)])

    def driven_over(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points (N, 2) of the plane the robot has covered on the path just driven."""
        return self._beside(np.array(self._trail), self.into_base(points)) < 0.0

    def beside_way_here(self, points: FloatArray) -> FloatArray:
        """Return how near the robot came to points (N, 2) in ``base_link`` now on the path just driven [m].

        Without what it drove backwards: there, where it does not see, each step would allow the next to go a little nearer.
        """
        trail = np.array(self._trail)
        return self._beside(trail[trail[:, 3] == 0.0], points)

    def _beside(self, trail: FloatArray, points: FloatArray) -> FloatArray:
        poses = np.column_stack((self.into_base(trail[:, :2]), trail[:, 2] - self.pose[2]))
        nearest: FloatArray = self._outline.gaps(poses, points).min(axis=0, initial=math.inf)
        return nearest

    def follows_trail(self, forward: float, turn: float) -> bool:
        """Return whether the next 0.4 m of the arc of a motion lie on the path just driven, within 0.1 m and 15 degrees.

        Args:
            forward: Forward speed, not 0 [m/s].
            turn: Turn rate [rad/s].
        """
        along = np.copysign(np.linspace(0.1, 0.4, 4), forward)
        yaw = np.abs(along) * (turn / max(abs(forward), 1e-6))
        x, y, _ = along_arc(along, yaw).T
        trail = np.array(self._trail)
        xy = self.into_base(trail[:, :2])
        apart = np.hypot(x[:, None] - xy[:, 0], y[:, None] - xy[:, 1])
        turned = yaw[:, None] - (trail[:, 2] - self.pose[2])
        turned = np.abs(np.remainder(turned + math.pi, 2.0 * math.pi) - math.pi)
        return bool(((apart < 0.1) & (turned < math.radians(15.0))).any(axis=1).all())
