"""Obstacles of an arm, as MuJoCo describes geoms: of a simulation's model, or a plain list of boxes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import mujoco
import numpy as np

from localization.types import IntArray, Pose
from robot_sim.array_types import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class Box:
    """A box that stands still against the vehicle."""

    name: str
    """What messages call it."""
    pose: Pose
    """``base_from_box``; its centre."""
    half: tuple[float, float, float]
    """Half its length, width and height [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """Geoms and where they are, in columns."""

    names: tuple[str, ...]
    """What messages call them."""
    kinds: IntArray
    """(N,) numbers of ``mjtGeom``."""
    sizes: FloatArray
    """(N, 3) as MuJoCo has them for each kind [m]."""
    assets: IntArray
    """(N,) number of the mesh or height field; -1 without."""
    radii: FloatArray
    """(N,) of bounding spheres [m]; 0 for planes."""
    bounds: FloatArray
    """(N, 6) centre and half sizes of bounding boxes in the geoms' frames [m]."""
    positions: FloatArray
    """(N, 3) of the geoms [m]."""
    rotations: FloatArray
    """(N, 3, 3) of their axes."""
    pickable: BoolArray
    """(N,) whether the gripper may touch them."""

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, rows: IntArray | BoolArray) -> Obstacles:
        """Return some of them."""
        names = tuple(np.array(self.names, dtype=object)[rows])
        columns = (getattr(self, f.name)[rows] for f in fields(self)[1:])
        return Obstacles(names, *columns)

    def __add__(self, other: Obstacles) -> Obstacles:
        """Return these and others."""
        pairs = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self)[1:])
        return Obstacles(self.names + other.names, *(np.concatenate(pair) for pair in pairs))

    def seen_from(self, position: FloatArray, rotation: FloatArray) -> Obstacles:
        """Return them in a frame that is at ``position`` (3,) with axes ``rotation`` (3, 3)."""
        positions = (self.positions - position) @ rotation
        return self.at(positions, rotation.T @ self.rotations)

    def at(self, positions: FloatArray, rotations: FloatArray) -> Obstacles:
        """Return them elsewhere."""
        others = (self.names, self.kinds, self.sizes, self.assets, self.radii, self.bounds)
        return Obstacles(*others, positions, rotations, self.pickable)

    def stands_like(self, other: Obstacles, tolerance: float) -> bool:
        """Return whether another list has the same geoms in the same places but for a tolerance [m, rad]."""
        return self.names == other.names and bool(
            np.abs(self.positions - other.positions).max(initial=0.0) <= tolerance
            and np.abs(self.rotations - other.rotations).max(initial=0.0) <= tolerance
        )

    def distances(self, point: FloatArray) -> FloatArray:
        """Return lower bounds (N,) of the distances of a point (3,) from them [m]: those of their bounding boxes."""
        local = np.einsum("nij,ni->nj", self.rotations, point - self.positions) - self.bounds[:, :3]
        outside = np.maximum(np.abs(local) - self.bounds[:, 3:], 0.0)
        apart: FloatArray = np.sqrt(np.einsum("nj,nj->n", outside, outside))
        return apart


def of_model(model: mujoco.MjModel, geoms: IntArray, pickable: BoolArray) -> Obstacles:
    """Return geoms of a model, all at the origin; ``pickable`` (B,) is whether the gripper may touch each body."""
    bodies = model.geom_bodyid[geoms]
    return Obstacles(
        tuple(_name(model, int(g), pickable) for g in geoms),
        model.geom_type[geoms].astype(np.int64),
        model.geom_size[geoms],
        model.geom_dataid[geoms].astype(np.int64),
        model.geom_rbound[geoms],
        model.geom_aabb[geoms],
        np.zeros((len(geoms), 3)),
        np.tile(np.eye(3), (len(geoms), 1, 1)),
        pickable[bodies],
    )


def of_boxes(boxes: Sequence[Box]) -> Obstacles:
    """Return boxes as obstacles."""
    count = len(boxes)
    half = np.array([box.half for box in boxes]).reshape(count, 3)
    return Obstacles(
        tuple(box.name for box in boxes),
        np.full(count, int(mujoco.mjtGeom.mjGEOM_BOX), dtype=np.int64),
        half,
        np.full(count, -1, dtype=np.int64),
        np.linalg.norm(half, axis=1),
        np.hstack((np.zeros((count, 3)), half)),
        np.array([box.pose.position for box in boxes]).reshape(count, 3),
        np.array([box.pose.rotation for box in boxes]).reshape(count, 3, 3),
        np.zeros(count, dtype=bool),
    )


def _name(model: mujoco.MjModel, geom: int, pickable: BoolArray) -> str:
    """Return a geom's own name, or of what can be picked up, as of what has none, the body's."""
    body = int(model.geom_bodyid[geom])
    name: str = model.body(body).name
    return name if pickable[body] else model.geom(geom).name or name
