"""Pieces of a course of the joints: where the arm is along them, and how fast it may go there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from localization.geometry import FloatArray
from localization.types.arrays import read_only
from robot_sim.arm.arm_table import JOINTS, MotionLimits


@dataclass(frozen=True, slots=True)
class Pace:
    """Bounds of a parameter that grows along a piece, with which every joint keeps its own bounds."""

    rate: float
    """Greatest rate [1/s]."""
    acceleration: float
    """Greatest change of the rate [1/s^2]."""
    jerk: float
    """Greatest change of that [1/s^3]."""

    @property
    def stopping(self) -> float:
        """Time in which the greatest rate is stopped [s]."""
        return self.rate / self.acceleration + self.acceleration / self.jerk


class Piece(Protocol):
    """A piece of a course, by a parameter from 0 to ``length``."""

    @property
    def length(self) -> float:
        """Where it ends."""

    @property
    def pace(self) -> Pace:
        """How fast the parameter may grow."""

    @property
    def flying(self) -> bool:
        """Whether the joints stand still at both ends though the parameter goes on at its greatest rate."""

    def at(self, places: FloatArray) -> FloatArray:
        """Return (3, N, 5): at places (N,) the angles [rad], and their first and second derivatives by the parameter."""


@dataclass(frozen=True, slots=True, eq=False)
class Straight:
    """A straight way between two poses; the parameter is the way of the joint that goes furthest [rad]."""

    begin: FloatArray
    """(5,) [rad]."""
    end: FloatArray
    """(5,) [rad]."""
    limits: MotionLimits
    """Bounds of each joint."""
    length: float = field(init=False)
    """Way of the joint that goes furthest [rad]."""
    pace: Pace = field(init=False)
    """That joint's own bounds."""
    flying: bool = field(init=False, default=False)
    """It does not; see ``Piece``."""

    def __post_init__(self) -> None:
        for name in ("begin", "end"):
            object.__setattr__(self, name, read_only(getattr(self, name), (JOINTS,), name))
        object.__setattr__(self, "length", float(np.abs(self.end - self.begin).max()))
        limits = self.limits
        object.__setattr__(self, "pace", Pace(limits.speed, limits.acceleration, limits.jerk))

    def at(self, places: FloatArray) -> FloatArray:
        """Return angles and derivatives (3, N, 5); see ``Piece``."""
        way = self.end - self.begin
        found = np.zeros((3, len(places), JOINTS))
        found[0] = self.begin + np.minimum(places / self.length, 1.0)[:, None] * way
        found[0, places >= self.length] = self.end
        found[1] = way / self.length
        return found
