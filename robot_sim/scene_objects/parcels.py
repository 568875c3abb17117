"""Parcels: small boxes that lie loose in a world, and that an arm can pick up."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import mujoco

from robot_sim.collision_bits import FLOOR_BIT, OBSTACLE_BIT
from robot_sim.errors import WorldError
from robot_sim.number_checks import check_finite
from robot_sim.scene_objects.blocks import paint

SIDES: Final = (0.005, 0.2)
"""Least and greatest side of a parcel [m]."""
MASSES: Final = (0.001, 0.2)
"""Least and greatest mass of a parcel [kg]."""
FRICTION: Final = (0.5, 0.005, 0.0001)
"""Friction of card and wood on each other, sliding (handbooks: 0.3 to 0.6); spinning and rolling [m]."""
_GAP: Final = 1e-4
"""Height from which it settles [m]: of two faces in one plane a ray that passes one misses the other."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """A loose box."""

    name: str
    """Name of its body."""
    x: float
    """x of its centre [m]."""
    y: float
    """y of its centre [m]."""
    z: float = 0.0
    """Height of its underside above the ground [m]."""
    yaw: float = 0.0
    """Yaw [rad]."""
    size: tuple[float, float, float] = (0.03, 0.03, 0.03)
    """Length, width and height [m]."""
    mass: float = 0.02
    """Mass [kg]."""
    material: str = "cardboard"
    """Name of its material."""

    def __post_init__(self) -> None:
        what = f"parcel {self.name!r}"
        check_finite(what, x=self.x, y=self.y, z=self.z, yaw=self.yaw)
        if not all(SIDES[0] <= side <= SIDES[1] for side in self.size):
            sides = " x ".join(f"{side:g}" for side in self.size)
            raise WorldError(
                f"{what}: each side must be {SIDES[0]:g} to {SIDES[1]:g} m, got {sides} m"
            )
        if not MASSES[0] <= self.mass <= MASSES[1]:
            raise WorldError(
                f"{what}: mass must be {MASSES[0]:g} to {MASSES[1]:g} kg, got {self.mass:g}"
            )

    def add_to(self, spec: mujoco.MjSpec, ground: float) -> None:
        """Add it as a free body, at rest above ground of that height [m]."""
        body = spec.worldbody.add_body(
            name=self.name,
            pos=(self.x, self.y, ground + self.z + _GAP + 0.5 * self.size[2]),
            quat=(math.cos(0.5 * self.yaw), 0.0, 0.0, math.sin(0.5 * self.yaw)),
        )
        body.add_freejoint(name=self.name)
        bits = OBSTACLE_BIT | FLOOR_BIT
        geom = body.add_geom(
            name=f"{self.name}_side",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[0.5 * side for side in self.size],
            mass=self.mass,
            contype=bits,
            conaffinity=bits,
            friction=FRICTION,
        )
        paint(spec, geom, self.material)
