"""The datagram that is sent to a motion base, one for each pose, and a receiver that believes none unseen.

Little-endian, 124 bytes: ``FSMP``, version 1 (u16), flags (u16; bit 0: following, otherwise settling level), sequence
number (u32), reserved 0 (u32), stamp of the sender [ns] (i64), surge, sway, heave [m], roll, pitch, yaw [rad] (6 f64),
lengths of the six legs [m] (6 f64), CRC-32 of all before it (u32).
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop.bridges.motion_platform.limited_motion import PERIOD
from teleop.bridges.motion_platform.platform import AXES, FloatArray, Platform

_BODY: Final = struct.Struct("<4sHHIIq6d6d")
_SUM: Final = struct.Struct("<I")
SIZE: Final = _BODY.size + _SUM.size
"""Bytes of a datagram."""
_MAGIC, _VERSION, _FOLLOWING = b"FSMP", 1, 1

LATE: Final = 0.1
"""Time without a datagram after which a receiver must settle by itself [s]: ten were lost."""
_EXACT: Final = 1e-6
"""How far rates and leg lengths may be from what is computed here [m, rad, s]; doubles keep them to 1e-12."""


@dataclass(frozen=True, slots=True, eq=False)
class PlatformPose:
    """Where the platform is to be."""

    sequence: int
    stamp: int
    following: bool
    pose: FloatArray
    """(6,) of ``AXES`` [m, rad]."""
    legs: FloatArray
    """(6,) [m]."""


class DatagramError(Exception):
    """A datagram that must not move anything; the text says why."""


def pack(sent: PlatformPose) -> bytes:
    """Return the bytes of a datagram."""
    flags = _FOLLOWING if sent.following else 0
    body = _BODY.pack(
        _MAGIC, _VERSION, flags, sent.sequence % 2**32, 0, sent.stamp, *sent.pose, *sent.legs
    )
    return body + _SUM.pack(zlib.crc32(body))


def unpack(data: bytes) -> PlatformPose:
    """Return what a datagram says.

    Raises:
        DatagramError: If it has another form, or was changed on its way.
    """
    if len(data) != SIZE:
        raise DatagramError(f"{len(data)} bytes, a datagram has {SIZE}")
    body, (check,) = data[: _BODY.size], _SUM.unpack(data[_BODY.size :])
    magic, version, flags, sequence, reserved, stamp, *numbers = _BODY.unpack(body)
    if magic != _MAGIC or version != _VERSION or reserved or flags & ~_FOLLOWING:
        raise DatagramError("not of this format, version 1")
    if zlib.crc32(body) != check:
        raise DatagramError("its checksum is wrong")
    if not np.isfinite(numbers).all():
        raise DatagramError("it has a number that is not finite")
    values = np.array(numbers)
    return PlatformPose(sequence, stamp, flags == _FOLLOWING, values[:6], values[6:])


class Receiver:
    """Checks datagrams one by one: order, rate, limits, legs. Owns the last good ones."""

    def __init__(self, platform: Platform) -> None:
        """Take the platform that is to be moved."""
        self._platform = platform
        self._last: PlatformPose | None = None
        self._rate = np.zeros(6)
        self.accepted = self.refused = 0

    def take(self, data: bytes, *, settled: bool = False) -> PlatformPose:
        """Return a pose that may be gone to.

        Args:
            data: The datagram.
            settled: Whether the platform has settled, since none was accepted for ``LATE``: a bridge may begin anew.

        Raises:
            DatagramError: If it may not. What was accepted before stays in force until ``LATE``.
        """
        try:
            pose = unpack(data)
            self._check(pose, settled=settled)
        except DatagramError:
            self.refused += 1
            raise
        self.accepted += 1
        return pose

    def _check(self, pose: PlatformPose, *, settled: bool) -> None:
        limits, last = self._platform.limits, self._last
        _within("position", pose.pose, limits.position)
        off = float(np.abs(self._platform.leg_lengths(pose.pose) - pose.legs).max())
        if off > _EXACT:
            raise DatagramError(f"a leg is {off:.6f} m off what the pose asks for")
        steps = 0 if last is None else (pose.sequence - last.sequence) % 2**32
        in_order = 0 < steps < 2**31
        if last is None or (settled and not in_order):
            _within(
                "first position, which must be level,", pose.pose, limits.acceleration * PERIOD**2
            )
            rate = pose.pose / PERIOD  # it was level a period before
        else:
            if not in_order:
                raise DatagramError(f"number {pose.sequence} after {last.sequence}")
            if pose.stamp <= last.stamp:
                raise DatagramError("its stamp is not after that of the one before")
            rate = (pose.pose - last.pose) / (steps * PERIOD)
            _within("rate", rate, limits.rate)
            # Between the middles of the two intervals of which these are mean rates.
            _within("acceleration", (rate - self._rate) / (steps * PERIOD), limits.acceleration)
        self._last, self._rate = pose, rate


def _within(name: str, values: FloatArray, most: FloatArray) -> None:
    over = np.abs(values) > most * (1.0 + _EXACT) + _EXACT
    if over.any():
        axis = int(np.argmax(over))
        raise DatagramError(f"{name} of {AXES[axis]} {values[axis]:.4f} is beyond {most[axis]:.4f}")
