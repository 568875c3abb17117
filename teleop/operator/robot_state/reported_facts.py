"""What the robot reports of its e-stop, collisions, stalls, falls and tilt, as facts that alarms follow from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from localization.geometry import euler_from_rotation, rotation_from_quaternion
from localization.types import SECOND
from teleop.operator.robot_state.held_robot import HeldRobot
from teleop.operator.words import Facts

_NO_TURN: Final = (1.0, 0.0, 0.0, 0.0)
_PRESSED: Final = "e-stop by "


@dataclass(frozen=True, slots=True)
class ReportedFacts:
    """What was reported last; a value."""

    estop: str | None = None
    """Reason of the latched e-stop; None if there is none."""
    bump: str = ""
    """Where the bumpers were pressed last."""
    bumped: int | None = None
    """Arrival of the last message with a pressed bumper [ns]."""
    drive: str = ""
    """Falls and stalls, as ``/diagnostics`` has them."""
    drive_level: int = 0
    """How bad they are: 1 a warning, 2 an error; 0 if there are none."""
    roll: float | None = None
    """Roll by the inertial unit, left side up positive [rad]; None if it reports no orientation."""
    pitch: float | None = None
    """Pitch by the inertial unit, nose down positive [rad]; None if it reports no orientation."""

    held: HeldRobot = field(default_factory=HeldRobot)
    """Whether the robot stands though it is asked to move."""

    def after(self, topic: str, message: Mapping[str, Any], now: int) -> ReportedFacts:
        """Return the facts after a message that arrived at a time [ns]; most topics change nothing."""
        match topic:
            case "/teleop/state":
                estop = str(message["reason"]) if message["estop"] else None
                return replace(self, estop=estop, held=self.held.asked_to(message))
            case "/tf":
                return replace(self, held=self.held.at(message["transforms"], now))
            case "/bumper_state":
                where = _where(message["front_bumpers"], message["rear_bumpers"])
                return replace(self, bump=where, bumped=now) if where else self
            case "/diagnostics":
                return self._diagnosed(message["status"])
            case "/imu/data":
                return self._tilted(message)
        return self

    def facts(self, now: int) -> Facts:
        """Return what is known at a time [ns], by the names that the rules of the alarms use."""
        reason = self.estop or ""
        pressed = reason.startswith(_PRESSED)
        return {
            "estop": self.estop is not None,
            "estop_by": reason.removeprefix(_PRESSED) if pressed else "",
            "estop_reason": "" if pressed else reason,
            "blocked": self.held.seconds(now),
            "bump": self.bump,
            "bump_age": None if self.bumped is None else (now - self.bumped) / SECOND,
            "drive_level": self.drive_level,
            "drive_trouble": self.drive,
            "tilt": None if self.tilt is None else math.degrees(self.tilt),
            "tilt_direction": self._direction(),
        }

    @property
    def tilt(self) -> float | None:
        """Angle of the robot's up axis from the vertical [rad]; None if it is unknown."""
        if self.roll is None or self.pitch is None:
            return None
        return math.acos(max(-1.0, min(1.0, math.cos(self.roll) * math.cos(self.pitch))))

    def _direction(self) -> str:
        if self.roll is None or self.pitch is None:
            return ""
        if abs(self.pitch) >= abs(self.roll):
            return "nose down" if self.pitch > 0.0 else "nose up"
        return "to the right" if self.roll > 0.0 else "to the left"

    def _diagnosed(self, status: Sequence[Mapping[str, Any]]) -> ReportedFacts:
        for part in status:
            if part["name"] == "drive":
                level = int(part["level"])
                # Bumpers have a topic of their own, which is faster.
                troubles = [
                    t for t in str(part["message"]).split("; ") if not t.startswith("bumped")
                ]
                if level > 0 and troubles not in ([], ["ok"]):
                    return replace(self, drive="; ".join(troubles), drive_level=level)
                return replace(self, drive="", drive_level=0)
        return self

    def _tilted(self, message: Mapping[str, Any]) -> ReportedFacts:
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
