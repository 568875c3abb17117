"""Speed limits of the driven platform."""

from __future__ import annotations

from dataclasses import dataclass

from localization.types import Twist
from robot_sim import DriveConfig


@dataclass(frozen=True, slots=True)
class SpeedLimits:
    """The largest speeds that the robot is commanded to."""

    max_speed: float
    """Largest forward or backward speed [m/s]."""
    max_turn: float
    """Largest turn rate in either direction [rad/s]."""

    @classmethod
    def of(cls, drive: DriveConfig) -> SpeedLimits:
        """Return the limits of a drive, the one place where their values are set."""
        return cls(drive.max_speed, drive.max_turn)

    def limited(self, twist: Twist) -> Twist:
        """Return the planar part of a twist within the limits.

        Beyond a limit speed and turn rate are scaled alike, as the drive does, which keeps the curve.
        """
        forward, turn = float(twist.linear[0]), float(twist.angular[2])
        excess = max(1.0, abs(forward) / self.max_speed, abs(turn) / self.max_turn)
        return Twist.planar(forward / excess, turn / excess)
