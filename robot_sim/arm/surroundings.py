"""What of a simulation's world is near an arm: the vehicle's parts, still and moving obstacles, and what is held."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray
from robot_sim.arm.arm_touch import arm_parts, pickable_bodies
from robot_sim.arm.obstacles import Obstacles, of_model
from robot_sim.arm.parts import JAWS, TOOL
from robot_sim.array_types import BoolArray, FloatArray

_AROUND: Final = 1.0
"""Way of the vehicle after which still geoms are sought anew [m]."""
_MESH: Final = int(mujoco.mjtGeom.mjGEOM_MESH)


class Surroundings:
    """The geoms of a model that an arm can hit, in ``base_link``."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, reach: float) -> None:
        """Look up the vehicle and what is no part of it; ``reach`` is of all that matters from the shoulder [m]."""
        self.model, self._reach = model, reach
        bodies = model.geom_bodyid
        base = self._base = int(model.body("base_link").id)
        own = model.body_rootid[bodies] == base
        self._pickable = pickable_bodies(model)
        solid = _solid(model)
        arm = arm_parts(model)[bodies] if _has_body(model, TOOL) else np.zeros(model.ngeom, bool)
        collides = (model.geom_contype | model.geom_conaffinity) != 0
        vehicle = np.flatnonzero(own & ~arm & collides & (model.geom_rgba[:, 3] > 0.0))
        self._tool = int(model.body(TOOL).id) if arm.any() else -1
        self._jaws = [int(model.joint(jaw).qposadr[0]) for jaw in JAWS] if arm.any() else []
        there = _placed(self._table(vehicle), data, vehicle)
        self.vehicle = there.seen_from(*_frame(data, self._base))
        """Parts of the vehicle."""
        others = ~own & solid
        moves = (model.body_weldid[bodies] != 0) | (model.body_mocapid[bodies] >= 0)
        self._geoms = np.concatenate(
            (np.flatnonzero(others & ~moves), np.flatnonzero(others & moves))
        )
        self._moving = np.arange(np.count_nonzero(others & ~moves), len(self._geoms))
        self._known = self._table(self._geoms)
        self._sought_at = np.full(3, np.inf)
        self._candidates = self._moving
        self._obstacles = self._known[self._moving]

    def near(self, data: mujoco.MjData, shoulder: FloatArray, held: str = "") -> Obstacles:
        """Return what is within reach of the shoulder (3,), a point of ``base_link``, except for a body that is held."""
        position, rotation = _frame(data, self._base)
        place = position + rotation @ shoulder
        if not np.linalg.norm(place - self._sought_at) <= _AROUND:
            self._seek(data, place)
        geoms = self._geoms[self._candidates]
        there = _placed(self._obstacles, data, geoms)
        close = there.distances(place) <= self._reach
        if held:
            close &= self.model.geom_bodyid[geoms] != int(self.model.body(held).id)
        return there[close].seen_from(position, rotation)

    def held(self, data: mujoco.MjData, name: str) -> Obstacles:
        """Return the geoms of a body in ``tool0``."""
        geoms = np.flatnonzero(self.model.geom_bodyid == int(self.model.body(name).id))
        return _placed(self._table(geoms), data, geoms).seen_from(*_frame(data, self._tool))

    def jaws(self, data: mujoco.MjData) -> FloatArray | None:
        """Return how far the jaws are from the middle (2,) [m]; None without an arm in the model."""
        return data.qpos[self._jaws] if self._jaws else None

    def _seek(self, data: mujoco.MjData, place: FloatArray) -> None:
        """Keep the still geoms that can come within reach before they are sought again, and all that move."""
        still = self._geoms[: self._moving[0]] if len(self._moving) else self._geoms
        rows = np.arange(len(still))
        there = _placed(self._known[rows], data, still)
        rows = rows[there.distances(place) <= self._reach + _AROUND]
        self._sought_at = place
        self._candidates = np.concatenate((rows, self._moving))
        self._obstacles = self._known[self._candidates]

    def _table(self, geoms: IntArray) -> Obstacles:
        """Return what does not change of some geoms; their places are those of the world's origin."""
        return of_model(self.model, geoms, self._pickable)


def _frame(data: mujoco.MjData, body: int) -> tuple[FloatArray, FloatArray]:
    """Return where a body is (3,) and its axes (3, 3)."""
    return data.xpos[body], data.xmat[body].reshape(3, 3)


def _placed(known: Obstacles, data: mujoco.MjData, geoms: IntArray) -> Obstacles:
    """Return geoms where they are now."""
    return known.at(data.geom_xpos[geoms], data.geom_xmat[geoms].reshape(-1, 3, 3))


def _solid(model: mujoco.MjModel) -> BoolArray:
    """Return which geoms (G,) an arm can hit: what collides, and shapes above the robot, which physics leaves out."""
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    shown = (model.geom_rgba[:, 3] > 0.0) & (model.geom_type != _MESH)
    solid: BoolArray = collides | shown
    return solid


def _has_body(model: mujoco.MjModel, name: str) -> bool:
    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) >= 0)
