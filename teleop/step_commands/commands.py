"""What a step command asks for: a step, or a photograph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

from teleop.errors import TeleopError

MAX_DISTANCE: Final = 100.0
"""Longest straight step [m]; chosen, as a step is driven out of sight."""

MAX_ANGLE: Final = math.tau
"""Largest turn of one step [rad]: once around."""


class StepCommandError(TeleopError, ValueError):
    """A step command is invalid; the message names the field, and what would have worked."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the robot: straight on, a turn on the spot, or both as one arc.

    Raises:
        StepCommandError: A value is out of its range, or it is no motion at all.
    """

    distance: float = 0.0
    """Distance to drive along the way, positive forward [m]; 0 for a turn on the spot."""
    angle: float = 0.0
    """Angle to turn on that way, positive to the left [rad]; 0 for a straight step."""
    speed: float = 0.0
    """Speed [m/s], of a turn [rad/s]; 0 for the robot's own."""

    def __post_init__(self) -> None:
        for name in ("distance", "angle", "speed"):
            if not math.isfinite(value := getattr(self, name)):
                raise StepCommandError(f"{name} must be a finite number, got {value}")
        if not self.distance and not self.angle:
            raise StepCommandError(
                "a step needs a distance [m], an angle [rad], or both for an arc; got 0 and 0"
            )
        if abs(self.distance) > MAX_DISTANCE:
            raise StepCommandError(
                f"distance must be -{MAX_DISTANCE:g} to {MAX_DISTANCE:g} m, got {self.distance:g}"
            )
        if abs(self.angle) > MAX_ANGLE:
            raise StepCommandError(
                f"angle must be -2 pi to 2 pi rad, once around, got {self.angle:g}"
            )
        if self.speed < 0.0:
            raise StepCommandError(
                f"speed must be > 0, or 0 for the robot's own, got {self.speed:g}"
            )


@dataclass(frozen=True, slots=True)
class Photo:
    """A picture of the robot's camera, to be stored."""


StepCommand: TypeAlias = Step | Photo
"""What a command asks for."""
