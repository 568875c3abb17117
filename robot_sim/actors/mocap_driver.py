"""Placement of a model's mocap bodies where their movers are at a given time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from robot_sim.actors.movers import Mover, quaternions_of

_CHUNK: Final = 64
"""Number of ticks for which poses are computed at once; one call costs the same for one as for many."""


class MocapDriver:
    """Writes the poses of movers to the mocap bodies of a model."""

    def __init__(self, model: mujoco.MjModel, movers: Sequence[Mover], tick: int) -> None:
        """Take the movers of a model and the time [ns] between two calls of ``place``."""
        self._movers = tuple(movers)
        self._tick = tick
        bodies = [model.body(m.name).id for m in self._movers]
        self._slots = model.body_mocapid[bodies].astype(int)
        self._first = 0
        self._positions = np.empty((0, len(self._movers), 3))
        self._quaternions = np.empty((0, len(self._movers), 4))

    def place(self, data: mujoco.MjData, stamp: int) -> None:
        """Write the pose of every mover at ``stamp`` [ns]."""
        if not self._movers:
            return
        row, odd = divmod(stamp - self._first, self._tick)
        if odd or not 0 <= row < len(self._positions):
            self._compute(stamp)
            row = 0
        data.mocap_pos[self._slots] = self._positions[row]
        data.mocap_quat[self._slots] = self._quaternions[row]

    def forget(self) -> None:
        """Compute the coming poses anew, because a schedule has changed."""
        self._positions = self._positions[:0]

    def _compute(self, first: int) -> None:
        times = first + self._tick * np.arange(_CHUNK, dtype=np.int64)
        poses = [m.pose_at(times) for m in self._movers]
        self._first = first
        self._positions = np.stack([p for p, _ in poses], axis=1)
        self._quaternions = np.stack([quaternions_of(y) for _, y in poses], axis=1)
