"""Movers: rigid bodies whose pose is a function of time alone, such as legs and door leaves.

A mover cannot react to the robot. Its pose can therefore be computed for the time of any single
beam, in any order, and is the same in the physics and in ray casting. Nobody steps aside: a person
who walks into the robot pushes it as ``bumper_geom`` says, and walks through it if it is stuck.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from localization.types import IntArray
from robot_sim.actors.walking import Walk, smooth
from robot_sim.array_types import FloatArray
from robot_sim.floorplan.actors_in_plan import DoorLeaf

_SCHEDULE: Final = 16
"""Number of openings of a door before its schedule repeats."""


class Mover(Protocol):
    """One rigid body that moves on its own: a mocap body of the model with the mover's name."""

    @property
    def name(self) -> str:
        """Name of the mocap body."""
        ...

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) in ``map`` [m] and yaws (N,) [rad] at ``times`` (N,) [ns].

        A pure function, defined for every time; the body stays upright.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class WalkingBody:
    """A body on a walk: a torso, a leg that swings beside it, or a cart ahead of it."""

    name: str
    """Name of the mocap body."""
    walk: Walk
    """The walk that the body follows."""
    offset: int
    """Time that is added before the walk is evaluated [ns]."""
    delayed: bool
    """Whether the body stands at the beginning of the walk while time plus offset is negative."""
    ahead: float = 0.0
    """Distance of the body ahead of the walking point [m]."""
    left: float = 0.0
    """Distance of the body to the left of the walking point [m]."""
    reach: float = 0.0
    """Amplitude with which the body swings forward and back with the gait [m]."""
    height: float = 0.0
    """Height of the ground that is walked on [m]."""

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """See ``Mover.pose_at``."""
        shifted = times + self.offset
        motion = self.walk.at(np.maximum(shifted, 0) if self.delayed else shifted)
        ahead = self.ahead + self.reach * np.sin(motion.strides)
        c, s = np.cos(motion.headings), np.sin(motion.headings)
        positions = np.zeros((len(times), 3))
        positions[:, 0] = motion.positions[:, 0] + c * ahead - s * self.left
        positions[:, 1] = motion.positions[:, 1] + s * ahead + c * self.left
        positions[:, 2] = self.height
        return positions, motion.headings


class SwingingDoor:
    """A door leaf that opens and closes on a random schedule of its own."""

    def __init__(self, leaf: DoorLeaf, rng: np.random.Generator) -> None:
        self.name = leaf.name
        self._hinge = np.array([*leaf.hinge, 0.0])
        share = rng.uniform(0.5, 1.5, (_SCHEDULE, 2)) * (leaf.closed_time, leaf.open_time)
        moving = np.full(_SCHEDULE, leaf.moving_time)
        # Closed, opening, open, closing; and over again.
        lengths = np.stack([share[:, 0], moving, share[:, 1], moving], axis=1).ravel()
        self._ends: IntArray = np.cumsum(np.rint(1e9 * lengths)).astype(np.int64)
        self._begins: IntArray = np.concatenate([[0], self._ends[:-1]])
        opened = leaf.closed + leaf.swing
        self._from = np.tile([leaf.closed, leaf.closed, opened, opened], _SCHEDULE)
        self._to = np.tile([leaf.closed, opened, opened, leaf.closed], _SCHEDULE)
        self._offset = int(rng.integers(self._ends[-1]))

    def pose_at(self, times: IntArray) -> tuple[FloatArray, FloatArray]:
        """See ``Mover.pose_at``; the body's x axis runs from the hinge along the leaf."""
        within = np.mod(times + self._offset, self._ends[-1])
        k = np.searchsorted(self._ends, within, "right")
        share = smooth((within - self._begins[k]) / (self._ends[k] - self._begins[k]))
        yaws = self._from[k] + (self._to[k] - self._from[k]) * share
        return np.broadcast_to(self._hinge, (len(times), 3)), yaws


def quaternions_of(yaws: FloatArray) -> FloatArray:
    """Return the attitudes (N, 4), wxyz, of upright bodies with ``yaws`` (N,) [rad]."""
    quaternions = np.zeros((len(yaws), 4))
    quaternions[:, 0], quaternions[:, 3] = np.cos(0.5 * yaws), np.sin(0.5 * yaws)
    return quaternions
