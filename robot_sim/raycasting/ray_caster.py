"""What a ray caster answers, whatever it casts with."""

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

NO_GEOM: Final = -1
"""In the place of a geom where a ray met none."""


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What rays met first."""

    distances: FloatArray
    """(N,) [m], ``inf`` where nothing was within range."""
    geoms: GeomArray
    """(N,) geom of the model, -1 where nothing was within range."""
    cosines: FloatArray
    """(N,) absolute cosine of the angle of incidence: 1 head-on, 0 grazing; 0 where nothing was."""


class RayCaster(Protocol):
    """Whatever can tell how far it is to the nearest surface.

    A ray that starts inside something meets that thing's surface from inside. The robot itself is
    never met, nor what is fully transparent.
    """

    def distances(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> FloatArray:
        """Return distances (N,) [m], ``inf`` where nothing is within ``max_range``.

        Args:
            origins: (N, 3) in ``map`` [m].
            directions: (N, 3) unit vectors in ``map``.
            times: (N,) when each ray is cast [ns]: movers are where they were then.
            max_range: [m].
        """
        ...

    def hits(
        self, origins: FloatArray, directions: FloatArray, times: IntArray, max_range: float
    ) -> Hits:
        """Return what the rays meet; arguments as for ``distances``."""
        ...


def no_hits(rays: int) -> Hits:
    """Return that ``rays`` rays met nothing."""
    geoms = np.full(rays, NO_GEOM, dtype=np.int32)
    return Hits(np.full(rays, np.inf), geoms, np.zeros(rays))


def visible_geoms(model: mujoco.MjModel) -> BoolArray:
    """Return which geoms (G,) a scanner can see: not fully transparent, and not the robot's own.

    As for MuJoCo's own rays, a material's alpha counts, and the geom's only where it has none.
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
