"""What the robot's own sensors report of collisions, tilt, stalls and falls, and the e-stop, as notices."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Final

from localization.geometry import euler_from_rotation, rotation_from_quaternion
from localization.types import SECOND

BUMP_SHOWN: Final = 2 * SECOND
"""Time for which a collision stays on the display after the bumper was let go [ns]."""
TILT_NOTABLE: Final = math.radians(8.0)
"""Tilt that is reported [rad]: beyond the ramps for wheelchairs (5 degrees) with the error of the estimate."""
TILT_ALARM: Final = math.radians(25.0)
"""Tilt that is an alarm [rad]: half of that at which the robot tips over sideways, about 50 degrees."""
_NO_TURN: Final = (1.0, 0.0, 0.0, 0.0)


class Severity(IntEnum):
    """How urgent a notice is; greater is worse."""

    CALM = 0
    """Nothing to do."""
    STALE = 1
    """What is shown is old."""
    WARNING = 2
    """Something is not as it should be."""
    ALARM = 3
    """The robot is stopped, hurt or lost."""


@dataclass(frozen=True, slots=True)
class Notice:
    """One thing that an operator should know now."""

    severity: Severity
    """How urgent it is."""
    text: str
    """It, in few words."""


@dataclass(frozen=True, slots=True)
class RobotAlarms:
    """What was reported last; a value."""

    estop: str | None = None
    """Reason of the latched e-stop; None if there is none."""
    bump: str = ""
    """Where the bumpers were pressed last."""
    bumped: int | None = None
    """Arrival of the last message with a pressed bumper [ns]."""
    drive: str = ""
    """Falls and stalls, as ``/diagnostics`` has them."""
    fallen: bool = False
    """Whether the robot has fallen."""
    roll: float | None = None
    """Roll by the inertial unit, left side up positive [rad]; None if it reports no orientation."""
    pitch: float | None = None
    """Pitch by the inertial unit, nose down positive [rad]; None if it reports no orientation."""

    def after(self, topic: str, message: Mapping[str, Any], now: int) -> RobotAlarms:
        """Return the alarms after a message that arrived at a time [ns]; most topics change nothing."""
        match topic:
            case "/teleop/state":
                return replace(self, estop=str(message["reason"]) if message["estop"] else None)
            case "/bumper_state":
                where = _where(message["front_bumpers"], message["rear_bumpers"])
                return replace(self, bump=where, bumped=now) if where else self
            case "/diagnostics":
                return self._diagnosed(message["status"])
            case "/imu/data":
                return self._tilted(message)
        return self

    def notices(self, now: int) -> tuple[Notice, ...]:
        """Return what to report at a time [ns], the worst first."""
        found = []
        if self.estop is not None:
            found.append(Notice(Severity.ALARM, f"E-STOP: {self.estop}"))
        if self.drive:
            severity = Severity.ALARM if self.fallen else Severity.WARNING
            found.append(Notice(severity, self.drive.upper()))
        if self.bumped is not None and now - self.bumped <= BUMP_SHOWN:
            found.append(Notice(Severity.ALARM, f"COLLISION {self.bump}"))
        if (tilt := self.tilt) is not None and tilt >= TILT_NOTABLE:
            severity = Severity.ALARM if tilt >= TILT_ALARM else Severity.WARNING
            found.append(
                Notice(severity, f"TILTED {math.degrees(tilt):.0f} deg{self._direction()}")
            )
        return tuple(sorted(found, key=lambda notice: -notice.severity))

    @property
    def tilt(self) -> float | None:
        """Angle of the robot's up axis from the vertical [rad]; None if it is unknown."""
        if self.roll is None or self.pitch is None:
            return None
        return math.acos(max(-1.0, min(1.0, math.cos(self.roll) * math.cos(self.pitch))))

    def _direction(self) -> str:
        assert self.roll is not None
        assert self.pitch is not None
        if abs(self.pitch) >= abs(self.roll):
            return ", nose down" if self.pitch > 0.0 else ", nose up"
        return ", to the right" if self.roll > 0.0 else ", to the left"

    def _diagnosed(self, status: Sequence[Mapping[str, Any]]) -> RobotAlarms:
        for part in status:
            if part["name"] == "drive":
                level = int(part["level"])
                # Bumpers have a topic of their own, which is faster.
                troubles = [
                    t for t in str(part["message"]).split("; ") if not t.startswith("bumped")
                ]
                bad = level > 0 and troubles not in ([], ["ok"])
                return replace(self, drive="; ".join(troubles) if bad else "", fallen=level > 1)
        return self

    def _tilted(self, message: Mapping[str, Any]) -> RobotAlarms:
        q = message["orientation"]
        quaternion = (float(q["w"]), float(q["x"]), float(q["y"]), float(q["z"]))
        size = math.sqrt(sum(part * part for part in quaternion))
        covariance = [float(c) for c in message["orientation_covariance"]]
        # -1 marks a field that does not exist; drivers that know no orientation also leave zeros or the identity.
        absent = covariance[0] == -1.0 or abs(size - 1.0) > 0.01
        if absent or (quaternion == _NO_TURN and not any(covariance)):
            return replace(self, roll=None, pitch=None)
        roll, pitch, _ = euler_from_rotation(rotation_from_quaternion(quaternion))
        return replace(self, roll=roll, pitch=pitch)


def _where(front: Sequence[bool], rear: Sequence[bool]) -> str:
    """Return in words where bumpers are pressed; each ring is listed from the robot's left."""
    sides = [
        f"{name}{_side(ring)}"
        for name, ring in (("in front", front), ("behind", rear))
        if any(ring)
    ]
    return " and ".join(sides)


def _side(ring: Sequence[bool]) -> str:
    pressed = [i for i, is_pressed in enumerate(ring) if is_pressed]
    middle, at = 0.5 * (len(ring) - 1), sum(pressed) / len(pressed)
    if abs(at - middle) < 0.75:
        return ""
    return ", left" if at < middle else ", right"
