"""Ramps, steps, kerbs and platforms: drivable boxes, level or inclined."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.number_checks import check_finite, check_positive
from robot_sim.scene_objects.blocks import Block


@dataclass(frozen=True, slots=True)
class Slab:
    """A drivable plate; where its two ends differ in height, it is a ramp."""

    name: str
    """Name of the slab."""
    x: float
    """x of the centre [m]."""
    y: float
    """y of the centre [m]."""
    length: float
    """Extent along its own x, over the ground [m]."""
    width: float
    """Extent along its own y [m]."""
    rise: tuple[float, float]
    """Height of its upper face at its -x and its +x end [m]."""
    yaw: float = 0.0
    """Direction of its own x [rad]."""
    surface: str = "concrete"
    """Surface and material, a key of ``floor_surfaces.SURFACES``."""
    thickness: float | None = None
    """Thickness [m]; None extends a level slab down to the floor and gives a ramp 0.08 m."""

    def __post_init__(self) -> None:
        what = f"slab {self.name!r}"
        low, high = self.rise
        check_finite(what, x=self.x, y=self.y, yaw=self.yaw, low=low, high=high)
        check_positive(what, length=self.length, width=self.width)
        if self.thickness is not None:
            check_positive(what, thickness=self.thickness)
        elif self.level and low <= 0.0:
            raise WorldError(f"{what}: its top must be > 0 m unless it has a thickness, got {low}")

    @property
    def level(self) -> bool:
        """Whether both ends have the same height."""
        return self.rise[0] == self.rise[1]

    @property
    def grade(self) -> float:
        """Rise over run."""
        return (self.rise[1] - self.rise[0]) / self.length

    def block(self) -> Block:
        """Return the solid whose upper face has its ends at the heights ``rise``."""
        low, high = self.rise
        slope = math.atan(self.grade)
        thick = self.thickness or (low if self.level else 0.08)
        # The middle of the upper face, and from there half a thickness against its normal.
        along = 0.5 * thick * math.sin(slope)
        return Block(
            self.name,
            self.x + along * math.cos(self.yaw),
            self.y + along * math.sin(self.yaw),
            0.5 * (low + high) - 0.5 * thick * math.cos(slope),
            (0.5 * self.length / math.cos(slope), 0.5 * self.width, 0.5 * thick),
            yaw=self.yaw,
            pitch=-slope,
            material=self.surface,
        )

    def heights(self, points: FloatArray) -> FloatArray:
        """Return its height (N,) [m] below (N, 2) ``points`` [m]; -inf beside it."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = points[:, 0] - self.x, points[:, 1] - self.y
        along, across = c * dx + s * dy, c * dy - s * dx
        inside = (np.abs(along) <= 0.5 * self.length) & (np.abs(across) <= 0.5 * self.width)
        height = 0.5 * sum(self.rise) + self.grade * along
        result: FloatArray = np.where(inside, height, -np.inf)
        return result
