"""From messages of a robot to poses of the platform, one for each period; no sockets and no clock in here."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from teleop.bridges.motion_platform.bridge_config import Cueing
from teleop.bridges.motion_platform.cueing import Feeling, cues
from teleop.bridges.motion_platform.datagram import PlatformPose
from teleop.bridges.motion_platform.limited_motion import PERIOD, LimitedMotion
from teleop.bridges.motion_platform.platform import FloatArray, Platform

SILENCE: Final = 0.3
"""Time without a message of the inertial unit after which the platform settles level [s]: fifteen were lost."""
_AHEAD: Final = 0.03
"""Longest time by which what is known is carried on [s]: one and a half periods of the unit."""
_BASE: Final = "base_link"


class Follower:
    """Follows a robot. Owns what was received last, the cues and the motion."""

    def __init__(self, platform: Platform, cueing: Cueing, gain: float) -> None:
        """Take the platform and how it shows what is felt."""
        self._platform = platform
        self._cueing, self._gain = cueing, gain
        self._cues = cues(cueing, gain)
        self._motion = LimitedMotion(platform.limits)
        self._rotations: dict[str, tuple[str, Rotation]] = {}
        self._feeling: Feeling | None = None
        self._heard = -np.inf
        self._stopped = False
        self._target = np.zeros(6)
        self._sequence = 0

    def take_imu(self, message: dict[str, Any], now: float) -> None:
        """Take a ``sensor_msgs/Imu`` that arrived at ``now`` [s].

        Raises:
            ValueError: If it is of no use, with the reason; what was received before stays.
        """
        mount = self._from_root(message["header"]["frame_id"], until=_BASE)
        turn = mount.apply(_vector(message["angular_velocity"]))
        force = mount.apply(_vector(message["linear_acceleration"]))
        # REP 145: a unit that knows no orientation says so by this.
        if message["orientation_covariance"][0] == -1.0:
            orientation = self._from_root(_BASE)
        else:
            orientation = _rotation(message["orientation"]) * mount.inv()
        if not np.isfinite([*turn, *force]).all():
            raise ValueError("a number is not finite")
        if self._silent(now):
            self._cues = cues(self._cueing, self._gain)
        self._feeling = Feeling(orientation.as_quat(), turn, force)
        self._heard = now

    def take_transforms(self, message: dict[str, Any]) -> None:
        """Take a ``tf2_msgs/TFMessage``.

        Raises:
            ValueError: If a rotation in it is invalid.
        """
        for transform in message["transforms"]:
            parent, child = transform["header"]["frame_id"], transform["child_frame_id"]
            self._rotations[child] = parent, _rotation(transform["transform"]["rotation"])

    def take_state(self, message: dict[str, Any]) -> None:
        """Take a ``farsteer_msgs/TeleopState``: while the e-stop is latched, the platform is level."""
        self._stopped = bool(message["estop"])

    def step(self, now: float) -> PlatformPose:
        """Return the pose of the next period, which begins at ``now`` [s]."""
        feeling, following = self._feeling, not (self._stopped or self._silent(now))
        before = self._target
        if feeling is not None and following:
            self._target = self._cues(feeling, min(now - self._heard, _AHEAD))
            rate = (self._target - before) / PERIOD
        else:
            self._target, rate = np.zeros(6), np.zeros(6)
        self._motion.step(self._target, rate)
        self._sequence += 1
        pose = self._motion.position
        legs = self._platform.leg_lengths(pose)
        return PlatformPose(self._sequence, round(now * 1e9), following, pose, legs)

    def _silent(self, now: float) -> bool:
        return now - self._heard > SILENCE

    def _from_root(self, frame: str, until: str | None = None) -> Rotation:
        """Return the rotation of a frame in ``until``, or in the root of the tree; what is not known is aligned."""
        turned = Rotation.identity()
        for _ in range(len(self._rotations) + 1):
            if frame == until or frame not in self._rotations:
                return turned
            frame, step = self._rotations[frame]
            turned = step * turned
        raise ValueError(f"the transforms run in a circle through {frame}")


def _vector(message: dict[str, float]) -> FloatArray:
    return np.array([message["x"], message["y"], message["z"]], dtype=np.float64)


def _rotation(message: dict[str, float]) -> Rotation:
    quaternion = np.array(
        [message["x"], message["y"], message["z"], message["w"]], dtype=np.float64
    )
    if not np.isfinite(quaternion).all() or abs(np.linalg.norm(quaternion) - 1.0) > 0.01:
        raise ValueError("a quaternion is not of length 1")
    return Rotation.from_quat(quaternion)
