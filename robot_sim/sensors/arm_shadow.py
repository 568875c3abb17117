"""Shadow of an arm: beams that it blocks are invalid, as if a filter of the robot's own body had cleared them.

A scanner does not see the robot, and so not its arm. What a beam would meet behind the arm is not measured though: such
a beam is ``NaN``, neither a wall nor free space. What the gripper holds counts as arm.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Final

import mujoco
import numpy as np

from localization.types import IntArray, Pose
from robot_sim.arm.arm_touch import arm_parts
from robot_sim.array_types import FloatArray
from robot_sim.raycasting.shape_intersection import TypeArray, shape_distances, to_frames
from robot_sim.worlds.world import TIMESTEP_NS

SPOT: Final = 0.01
"""Width by which the arm is taken to be thicker [m]: half the spot of a beam that is dimmed by it."""
BEHIND: Final = 0.1
"""Distance behind a measured range up to which the arm still counts as before it [m]: noise, and what is held itself."""
_LONG: Final = 1_000_000_000
"""Time that is longer than a tick [ns]."""
_STILL: Final = 1e-3
"""Change of an angle or of the opening that moves no shadow by more than half a millimetre [rad, m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Solids:
    """Solids near a scanner's plane, in its frame; arrays (K, ...)."""

    kinds: TypeArray
    sizes: FloatArray
    positions: FloatArray
    matrices: FloatArray
    reach: FloatArray

    def distances(self, angles: FloatArray) -> FloatArray:
        """Return the distances (N,) [m] at which beams meet a solid, ``inf`` for none."""
        x, y = self.positions[:, 0], self.positions[:, 1]
        away = np.hypot(x, y)
        width = np.where(away > self.reach, np.arcsin(np.minimum(self.reach / away, 1.0)), np.pi)
        off = np.abs(np.angle(np.exp(1j * (angles[:, None] - np.arctan2(y, x)))))
        beams, solids = np.nonzero(off <= width)
        d = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))[beams]
        where, turned = self.positions[solids], self.matrices[solids]
        origins, directions = to_frames(where, turned, np.zeros_like(d), d)
        met = shape_distances(self.kinds[solids], self.sizes[solids], origins, directions)
        nearest = np.full(len(angles), np.inf)
        np.minimum.at(nearest, beams, met)
        return nearest


class ArmShadow:
    """Owns where the arm was in the last ticks, as seen from each scanner."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, mounts: Mapping[str, Pose]
    ) -> None:
        """Begin with the arm where it is; ``mounts`` are ``base_from_scanner``."""
        self._model, self._data, self._mounts = model, data, dict(mounts)
        self._base = int(model.body("base_link").id)
        bodies = np.flatnonzero(arm_parts(model))
        self._geoms = np.flatnonzero(np.isin(model.geom_bodyid, bodies))
        joints = np.flatnonzero(np.isin(model.jnt_bodyid, bodies))
        self._places = slice(
            int(model.jnt_qposadr[joints[0]]), int(model.jnt_qposadr[joints[-1]]) + 1
        )
        self._seen = (data.qpos[self._places].copy(), "")
        self._track = deque([(0, self._near_planes(""))])

    def record(self, stamp: int, held: str) -> None:
        """Take where the arm is after a tick that ends at ``stamp`` [ns], and the name of the body that it holds."""
        angles, before = self._seen
        now = self._data.qpos[self._places]
        if held == before and float(np.abs(now - angles).max()) < _STILL:
            near = self._track[-1][1]
        else:
            self._seen = (now.copy(), held)
            near = self._near_planes(held)
        # The shapes are where they were at the beginning of the tick's last step.
        self._track.append((stamp - TIMESTEP_NS, near))

    def forget(self, before: int) -> None:
        """Drop what is older than the last one at or before a time [ns]."""
        while len(self._track) > 1 and self._track[1][0] <= before:
            self._track.popleft()

    def cover(
        self,
        scanner: str,
        angles: FloatArray,
        times: IntArray,
        ranges: FloatArray,
        remissions: FloatArray,
    ) -> None:
        """Make those beams of a sweep ``NaN`` that the arm blocked at an end of the tick in which they were sent.

        Args:
            scanner: Name of the scanner.
            angles: (N,) angles of the beams [rad].
            times: (N,) their times [ns], which do not decrease.
            ranges: (N,) measured ranges [m]; written.
            remissions: (N,) or (0,) intensities; written.
        """
        for begin, end, solids in self._spells(scanner):
            sent = slice(*np.searchsorted(times, (begin, end)).tolist())
            met = np.flatnonzero(solids.distances(angles[sent]) < ranges[sent] + BEHIND)
            ranges[sent][met] = np.nan
            if len(remissions):
                remissions[sent][met] = 0.0

    def _spells(self, scanner: str) -> Iterator[tuple[int, int, _Solids]]:
        """Yield when there were solids near a scanner's plane, and which, to the next ticks on both sides [ns]."""
        stamps = [stamp for stamp, _ in self._track]
        stamps = [stamps[0] - 1, *stamps, stamps[-1] + _LONG]
        number = 0
        # While the arm rests, all ticks have the same solids.
        for _, alike in groupby((near for _, near in self._track), key=id):
            first, number = number, number + len(list(alike))
            solids = self._track[first][1].get(scanner)
            if solids is not None:
                yield stamps[first], stamps[number + 1], solids

    def _near_planes(self, held: str) -> dict[str, _Solids]:
        """Return the solids that may be in each scanner's plane; nothing for a scanner without any."""
        model, data, geoms = self._model, self._data, self._geoms
        if held:
            body = int(model.body(held).id)
            geoms = np.append(geoms, np.flatnonzero(model.geom_bodyid == body))
        axes = data.xmat[self._base].reshape(3, 3)
        places = (data.geom_xpos[geoms] - data.xpos[self._base]) @ axes
        matrices = data.geom_xmat[geoms].reshape(-1, 3, 3)
        half = model.geom_aabb[geoms, 3:] + SPOT
        found = {}
        for name, mount in self._mounts.items():
            scanner = axes @ mount.rotation
            heights = (places - mount.position) @ mount.rotation[:, 2]
            thick = (np.abs(scanner[:, 2] @ matrices) * half).sum(axis=1)
            near = np.flatnonzero(np.abs(heights) <= thick)
            if len(near):
                found[name] = _Solids(
                    model.geom_type[geoms[near]],
                    model.geom_size[geoms[near]] + SPOT,
                    (places[near] - mount.position) @ mount.rotation,
                    scanner.T @ matrices[near],
                    model.geom_rbound[geoms[near]] + 2.0 * SPOT,
                )
        return found
