"""The interface of ray casters, their hits, and which geoms are visible or static."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.robot.mujoco_body import ROBOT_GROUP

GeomArray = npt.NDArray[np.int32]
"""Array of geom indices."""

NO_GEOM: Final = -1
"""Geom index of a ray without a hit."""


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """First hits of rays."""

    distances: FloatArray
    """Distances (N,) [m], ``inf`` where nothing is within range."""
    geoms: GeomArray
    """Geoms (N,) of the model, -1 where nothing is within range."""
    cosines: FloatArray
    """Absolute cosines of incidence (N,): 1 head-on, 0 grazing; 0 without a hit."""


class RayCaster(Protocol):
    """Computes distances along rays to the nearest surface.

    A ray that starts inside an object hits its surface from inside. The robot itself and fully
    transparent geoms are never hit.
    """

    def distances(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> FloatArray:
        """Return distances (N,) [m], ``inf`` where nothing is within ``max_range``.

        Args:
            origins: (N, 3) in ``map`` [m].
            directions: (N, 3) unit vectors in ``map``.
            times: (N,) time of each ray [ns], at which movers are placed.
            max_range: Greatest distance [m].
        """
        ...

    def hits(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> Hits:
        """Return the hits of the rays; arguments as for ``distances``."""
        ...


def no_hits(rays: int) -> Hits:
    """Return that ``rays`` rays hit nothing."""
    geoms = np.full(rays, NO_GEOM, dtype=np.int32)
    return Hits(np.full(rays, np.inf), geoms, np.zeros(rays))


def visible_geoms(model: mujoco.MjModel) -> BoolArray:
    """Return which geoms (G,) a scanner can see: not fully transparent, and not the robot's own.

    As for MuJoCo's own rays, a material's alpha is used, and the geom's only where it has no material.
    """
    alpha = model.geom_rgba[:, 3].copy()
    if model.nmat:
        painted = model.geom_matid >= 0
        alpha[painted] = model.mat_rgba[model.geom_matid[painted], 3]
    seen: BoolArray = (alpha > 0.0) & (model.geom_group != ROBOT_GROUP)
    return seen


def static_geoms(model: mujoco.MjModel) -> BoolArray:
    """Return which geoms (G,) never move: those of bodies that are welded to the world."""
    bodies = model.geom_bodyid
    still: BoolArray = (model.body_weldid[bodies] == 0) & (model.body_mocapid[bodies] < 0)
    return still
