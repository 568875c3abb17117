"""Blocks: the boxes, cylinders and ellipsoids of which walls, furniture and trees are made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Final

import mujoco

from robot_sim.robot.mujoco_body import HEADROOM, OBSTACLE_BIT

Color = tuple[float, float, float]

COLORS: Final[Mapping[str, Color]] = MappingProxyType(
    {
        "wall": (0.85, 0.84, 0.80),
        "wood": (0.62, 0.45, 0.28),
        "metal": (0.55, 0.57, 0.60),
        "fabric": (0.25, 0.35, 0.50),
        "dark_fabric": (0.12, 0.12, 0.14),
        "rubber": (0.08, 0.08, 0.08),
        "leaves": (0.25, 0.50, 0.25),
        "bark": (0.35, 0.27, 0.20),
        "concrete": (0.66, 0.66, 0.64),
        "brick": (0.62, 0.33, 0.25),
        "asphalt": (0.25, 0.25, 0.27),
        "grass": (0.36, 0.55, 0.25),
        "gravel": (0.60, 0.56, 0.50),
        "tile": (0.78, 0.77, 0.74),
        "carpet": (0.45, 0.42, 0.48),
        "cardboard": (0.72, 0.57, 0.38),
        "plastic": (0.30, 0.45, 0.60),
        "glass": (0.70, 0.85, 0.90),
        "mirror": (0.80, 0.85, 0.90),
        "skin": (0.85, 0.65, 0.52),
        "retroreflector": (0.95, 0.95, 0.30),
    }
)
"""Colours of materials in pictures; scanners use the material's name."""

_CLEAR: Final = 0.35
"""Opacity with which glass is drawn."""


class Shape(StrEnum):
    """Shape of a block; see ``Block.half``."""

    BOX = "box"
    CYLINDER = "cylinder"
    ELLIPSOID = "ellipsoid"


_GEOMS: Final = {
    Shape.BOX: mujoco.mjtGeom.mjGEOM_BOX,
    Shape.CYLINDER: mujoco.mjtGeom.mjGEOM_CYLINDER,
    Shape.ELLIPSOID: mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}


@dataclass(frozen=True, slots=True)
class Block:
    """One solid."""

    name: str
    """Name of the geom."""
    x: float
    """x of the centre [m]."""
    y: float
    """y of the centre [m]."""
    z: float
    """z of the centre [m]."""
    half: tuple[float, float, float]
    """Half extents along its own axes [m]; a cylinder stands along z, its radius is the first."""
    yaw: float = 0.0
    """Yaw [rad]."""
    pitch: float = 0.0
    """Pitch about its own y after the yaw [rad]; positive lowers its +x end."""
    shape: Shape = Shape.BOX
    """Shape of the solid."""
    material: str = "wall"
    """Name of its material."""
    ground: float = 0.0
    """Height of the ground it stands on [m]."""

    def moved(self, x: float, y: float, yaw: float, z: float = 0.0) -> Block:
        """Return the block moved from a piece's own frame to ``x, y, z`` [m] and ``yaw`` [rad]."""
        c, s = math.cos(yaw), math.sin(yaw)
        return replace(
            self,
            x=x + c * self.x - s * self.y,
            y=y + s * self.x + c * self.y,
            z=self.z + z,
            yaw=self.yaw + yaw,
            ground=self.ground + z,
        )

    @property
    def bottom(self) -> float:
        """Height of its lowest point [m]; for tilted blocks a lower bound."""
        a, _, c = self.half
        return self.z - abs(math.sin(self.pitch)) * a - math.cos(self.pitch) * c

    @property
    def solid(self) -> bool:
        """Whether the robot can collide with it; blocks that hang higher can be seen only."""
        return self.hangs_below(HEADROOM)

    def hangs_below(self, height: float) -> bool:
        """Return whether a part of it is lower than a height above the ground [m]."""
        return self.bottom - self.ground < height

    @property
    def quaternion_wxyz(self) -> tuple[float, float, float, float]:
        """Attitude of the block."""
        cy, sy = math.cos(0.5 * self.yaw), math.sin(0.5 * self.yaw)
        cp, sp = math.cos(0.5 * self.pitch), math.sin(0.5 * self.pitch)
        return cy * cp, 0.0 - sy * sp, cy * sp, sy * cp

    def add_to(
        self,
        spec: mujoco.MjSpec,
        body: mujoco.MjsBody | None = None,
        *,
        headroom: float = HEADROOM,
    ) -> mujoco.MjsGeom:
        """Add the block as an obstacle, or as visible only if it hangs higher than ``headroom`` above the ground [m].

        It is static unless it is part of a ``body``; its pose is then in the frame of that body.
        """
        # Ceilings, lintels and table tops would cost a quarter of the physics for nothing.
        bits = OBSTACLE_BIT if self.hangs_below(headroom) else 0
        a, b, c = self.half
        geom = (body or spec.worldbody).add_geom(
            name=self.name,
            type=_GEOMS[self.shape],
            pos=(self.x, self.y, self.z),
            quat=self.quaternion_wxyz,
            size=(a, c, 0.0) if self.shape is Shape.CYLINDER else (a, b, c),
            contype=bits,
            conaffinity=bits,
            friction=(0.3, 0.005, 0.0001),
        )
        paint(spec, geom, self.material)
        return geom


def paint(spec: mujoco.MjSpec, geom: mujoco.MjsGeom, material: str) -> None:
    """Give a geom the material of that name and its colour; the model gets one of each name."""
    alpha = _CLEAR if material == "glass" else 1.0
    rgba = (*COLORS.get(material, COLORS["wall"]), alpha)
    if spec.material(material) is None:
        spec.add_material(name=material, rgba=rgba)
    geom.material = material
    geom.rgba = rgba


def box(
    name: str,
    x: float,
    y: float,
    low: float,
    high: float,
    size: tuple[float, float],
    material: str = "wall",
) -> Block:
    """Return a box at ``x, y`` from height ``low`` to ``high`` with full ``size`` in x and y [m]."""
    half = (0.5 * size[0], 0.5 * size[1], 0.5 * (high - low))
    return Block(name, x, y, 0.5 * (low + high), half, material=material)


def post(
    name: str, x: float, y: float, low: float, high: float, radius: float, material: str = "wall"
) -> Block:
    """Return an upright cylinder from height ``low`` to ``high`` [m]."""
    half = (radius, radius, 0.5 * (high - low))
    return Block(name, x, y, 0.5 * (low + high), half, shape=Shape.CYLINDER, material=material)


def ellipsoid(
    name: str,
    x: float,
    y: float,
    low: float,
    high: float,
    size: tuple[float, float],
    material: str = "wall",
) -> Block:
    """Return an ellipsoid at ``x, y`` from height ``low`` to ``high``, ``size`` wide in x and y [m]."""
    half = (0.5 * size[0], 0.5 * size[1], 0.5 * (high - low))
    return Block(name, x, y, 0.5 * (low + high), half, shape=Shape.ELLIPSOID, material=material)
