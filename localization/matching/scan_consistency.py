"""What the map does not explain of a sweep, and of which kind it is.

A beam ends where something is. If that is not on a mapped surface, the map itself says what to think of
it, along the beam's own line: the first surface that the beam meets there is behind its end (something
new stands before it), before its end (something mapped is gone, or the pose is wrong), or is missing, or
is met from behind (the beam ran where nothing was mapped).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.types import Pose, ScanConsistency, Sweep

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class ScanConsistencyConfig:
    """How beams are told apart."""

    beams: int = 40
    """Unexplained beams that are followed through the map, evenly chosen; their kinds stand for all.
    Of a kind that is half of what is unexplained they tell the size to 8 %, one sigma."""
    horizon: float = 6.0
    """How far beyond a beam's end a surface is looked for [m]; the size of a room."""
    edge: float = 0.2
    """Of the voxels by which empty space is passed over [m]."""
    nearest: float = 0.3
    """Surfaces nearer to the scanner than this are not looked for [m]."""
    aside: float = 0.12
    """A beam meets a mapped surface if it cuts the plane of a point no farther from it [m]: a cloud's
    spacing."""


class BeamClassifier:
    """Follows beams through a map; owns a coarse table of where it has surfaces at all."""

    def __init__(
        self,
        world: PreparedMap,
        config: ScanConsistencyConfig = ScanConsistencyConfig(),
        *,
        inlier: float = 0.10,
    ) -> None:
        """Build.

        Args:
            world: the prepared map.
            config: how beams are told apart.
            inlier: a point this near to a surface that faces the scanner is explained [m]; as in
                ``RegistrationConfig``.
        """
        self.config, self._inlier = config, inlier
        self._world = world
        points = world.cloud.points
        self._origin: FloatArray = points.min(axis=0) - 2.0 * config.edge
        cells = ((points - self._origin) / config.edge).astype(np.int64)
        # A margin of one voxel, to which whatever lies outside is clipped.
        self._shape = cells.max(axis=0) + 3
        self._stride = np.array([self._shape[1] * self._shape[2], self._shape[2], 1])
        self._solid = np.zeros(int(self._shape.prod()), dtype=bool)
        self._solid[cells @ self._stride] = True

    def classify(
        self, sweep: Sweep, map_from_base: Pose, distances: FloatArray
    ) -> ScanConsistency | None:
        """Return what the map does not explain of a sweep; None if nothing came back.

        Args:
            sweep: points in ``base_link``.
            map_from_base: where the robot is believed to be.
            distances: (N,) of the points to the map there, as in ``Match``.
        """
        count = len(distances)
        if not count:
            return None
        inlier = np.abs(np.nan_to_num(distances, nan=np.inf)) < self._inlier
        odd = np.flatnonzero(~inlier)
        share = len(odd) / count
        if not len(odd):
            return ScanConsistency(share, 0.0, 0.0, 0.0)
        odd = odd[np.linspace(0, len(odd) - 1, min(self.config.beams, len(odd))).astype(np.int64)]
        start = map_from_base.apply(sweep.origins[odd])
        line = map_from_base.apply(sweep.points[odd]) - start
        length = np.sqrt(np.einsum("ij,ij->i", line, line))
        line /= np.maximum(length, 1e-9)[:, None]
        met, facing = self.first_surface(start, line, length + self.config.horizon)
        before = facing & (met > length)
        through = facing & (met <= length)
        scale = share / len(odd)
        first, second = float(before.sum()) * scale, float(through.sum()) * scale
        return ScanConsistency(share, first, second, max(0.0, share - first - second))

    def first_surface(
        self, start: FloatArray, line: FloatArray, far: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """Return where beams meet the map for the first time.

        Args:
            start: (B, 3) in ``map`` [m].
            line: (B, 3) unit directions.
            far: (B,) how far to look [m].

        Returns:
            Distances (B,) [m], infinite where nothing is met; and whether (B,) what is met faces the
            beam.
        """
        c = self.config
        steps = np.arange(c.nearest, float(far.max()) + c.edge, c.edge)
        beam, step = np.nonzero(self._occupied(start, line, steps) & (steps < far[:, None]))
        at = steps[step]
        # Twice in a voxel's length, the nearest point of the cloud is looked at.
        beam = np.repeat(beam, 2)
        at = np.repeat(at, 2)
        at[1::2] += 0.5 * c.edge
        place, direction = start[beam] + at[:, None] * line[beam], line[beam]
        index = self._world.grid.nearest(place)
        normal = self._world.cloud.normals[index]
        offset = self._world.cloud.points[index] - place
        slope = np.einsum("ij,ij->i", normal, direction)
        meets = (index >= 0) & (np.abs(slope) > _GRAZING)
        # Along a surface a beam may run for metres; it is met where the line cuts its plane.
        with np.errstate(divide="ignore", invalid="ignore"):
            along = np.einsum("ij,ij->i", normal, offset) / slope
        aside = offset - along[:, None] * direction
        meets &= (np.einsum("ij,ij->i", aside, aside) < c.aside**2) & (np.abs(along) < c.edge)
        beam, at, slope = beam[meets], at[meets] + along[meets], slope[meets]
        met, facing = np.full(len(start), np.inf), np.zeros(len(start), dtype=bool)
        order = np.lexsort((at, beam))
        hit, first = np.unique(beam[order], return_index=True)
        met[hit] = at[order][first]
        facing[hit] = slope[order][first] < 0.0
        return met, facing

    def _occupied(self, start: FloatArray, line: FloatArray, steps: FloatArray) -> BoolArray:
        """Return whether (B, S) voxels along beams have mapped points."""
        flat = np.zeros((len(start), len(steps)), dtype=np.int64)
        for axis in range(3):
            first = (start[:, axis] - self._origin[axis]) / self.config.edge
            cell = first[:, None] + (line[:, axis] / self.config.edge)[:, None] * steps
            np.clip(cell, 0.0, self._shape[axis] - 1.0, out=cell)
            flat += cell.astype(np.int64) * self._stride[axis]
        solid: BoolArray = self._solid[flat]
        return solid


_GRAZING = 0.1
"""A surface met at less than this (sine of 6 degrees) is passed along, not met."""


def explanation(fit: float, consistency: ScanConsistency | None) -> str:
    """Return what the map explains of a sweep, and what not, in words for an operator."""
    parts = [f"the map explains {'only ' if fit < 0.5 else ''}{fit:.0%} of the sweep"]
    if consistency is not None:
        for share, what in (
            (
                consistency.occluded,
                "ends before mapped surfaces: people, or things put there since",
            ),
            (
                consistency.free_space_violation,
                "passes through mapped surfaces: things gone, or a wrong pose",
            ),
            (consistency.unmapped, "ends where nothing is mapped"),
        ):
            if share >= _WORTH_TELLING:
                parts.append(f"{share:.0%} {what}")
    return "; ".join(parts)


_WORTH_TELLING = 0.05
"""Noise and edges leave less than this share of a sweep unexplained anywhere."""
