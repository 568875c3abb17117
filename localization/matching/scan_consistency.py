"""Consistency of a sweep with the map: which beams the map does not explain, and of which kind they are.

A beam ends at a surface. If that is not mapped, the map along the beam classifies it: the first mapped surface
on the beam's line is behind its end (an unmapped object occludes it), before its end (the beam violates space
that is mapped as occupied: an object is gone, or the pose is wrong), or there is none, or it is met from
behind (the beam ran through unmapped space).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import GRAZING
from localization.types import BoolArray, Pose, ScanConsistency, Sweep


@dataclass(frozen=True, slots=True)
class ScanConsistencyConfig:
    """How beams are classified."""

    beams: int = 40
    """Number of unexplained beams that are traced through the map, evenly chosen as a sample of all. The size of
    a kind that is half of the unexplained beams is estimated to 8 %, one sigma."""
    horizon: float = 6.0
    """Distance beyond a beam's end within which a surface counts [m]; the size of a room."""
    edge: float = 0.2
    """Edge of the voxels by which empty space is skipped [m]."""
    nearest: float = 0.3
    """Surfaces nearer to the scanner than this are ignored [m]."""
    aside: float = 0.12
    """A beam meets a mapped surface if it cuts the plane of a point no farther from it [m]: a cloud's
    spacing."""


class BeamClassifier:
    """Traces beams through a map; owns a coarse table of the voxels that have surfaces at all."""

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
            config: how beams are classified.
            inlier: a point nearer than this to a surface that faces the scanner is explained [m]; as in
                ``RegistrationConfig``.
        """
        self.config, self._inlier = config, inlier
        self._world = world
        points = world.cloud.points
        self._origin: FloatArray = points.min(axis=0) - 2.0 * config.edge
        cells = ((points - self._origin) / config.edge).astype(np.int64)
        # A margin of one voxel, to which points outside are clipped.
        self._shape = cells.max(axis=0) + 3
        self._stride = np.array([self._shape[1] * self._shape[2], self._shape[2], 1])
        self._solid = np.zeros(int(self._shape.prod()), dtype=bool)
        self._solid[cells @ self._stride] = True
        self._thin = _thin_walls(world)

    def classify(
        self, sweep: Sweep, map_from_base: Pose, distances: FloatArray, *, every: bool = False
    ) -> ScanConsistency | None:
        """Return how a sweep agrees with the map; None without any return below where the map was cut.

        Args:
            sweep: points in ``base_link``.
            map_from_base: the estimate.
            distances: (N,) distances of the points to the map there, as in ``Match`` [m].
            every: whether each unexplained beam is traced, not a sample of them: a sample's error is as large as what
                two places a decimetre apart differ by.
        """
        cut = self._world.cut_below(map_from_base.apply(sweep.points))
        count = int((~cut).sum())
        if not count:
            return None
        inlier = np.abs(np.nan_to_num(distances, nan=np.inf)) < self._inlier
        odd = np.flatnonzero(~inlier & ~cut)
        share = len(odd) / count
        if not len(odd):
            return ScanConsistency(share, 0.0, 0.0, 0.0)
        if not every:
            most = min(self.config.beams, len(odd))
            odd = odd[np.linspace(0, len(odd) - 1, most).astype(np.int64)]
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
        """Return the first mapped surface on each beam.

        Args:
            start: (B, 3) in ``map`` [m].
            line: (B, 3) unit directions.
            far: (B,) largest distance [m].

        Returns:
            Distances (B,) [m], infinite where no surface is met; and whether (B,) the surface faces the beam.
        """
        c = self.config
        steps = np.arange(c.nearest, float(far.max()) + c.edge, c.edge)
        beam, step = np.nonzero(self._occupied(start, line, steps) & (steps < far[:, None]))
        at = steps[step]
        # The nearest point of the cloud is examined twice in a voxel's length.
        beam = np.repeat(beam, 2)
        at = np.repeat(at, 2)
        at[1::2] += 0.5 * c.edge
        direction = line.take(beam, axis=0)
        place = start.take(beam, axis=0) + at[:, None] * direction
        index = self._world.grid.nearest(place)
        normal = self._world.cloud.normals.take(index, axis=0)
        offset = self._world.cloud.points.take(index, axis=0) - place
        slope = np.einsum("ij,ij->i", normal, direction)
        meets = (index >= 0) & (np.abs(slope) > GRAZING)
        # A beam may run along a surface for metres; it meets it where its line cuts the surface's plane.
        with np.errstate(divide="ignore", invalid="ignore"):
            along = np.einsum("ij,ij->i", normal, offset) / slope
            aside = offset - along[:, None] * direction
        meets &= (np.einsum("ij,ij->i", aside, aside) < c.aside**2) & (np.abs(along) < c.edge)
        faces = (slope < 0.0) | self._thin.take(index)
        beam, at, faces = beam[meets], at[meets] + along[meets], faces[meets]
        met, facing = np.full(len(start), np.inf), np.zeros(len(start), dtype=bool)
        order = np.lexsort((at, beam))
        hit, first = np.unique(beam[order], return_index=True)
        met[hit] = at[order][first]
        facing[hit] = faces[order][first]
        return met, facing

    def _occupied(self, start: FloatArray, line: FloatArray, steps: FloatArray) -> BoolArray:
        """Return whether (B, S) voxels along beams have mapped points."""
        flat = np.zeros((len(start), len(steps)), dtype=np.int64)
        for axis in range(3):
            first = (start[:, axis] - self._origin[axis]) / self.config.edge
            cell = first[:, None] + (line[:, axis] / self.config.edge)[:, None] * steps
            np.clip(cell, 0.0, self._shape[axis] - 1.0, out=cell)
            flat += cell.astype(np.int64) * self._stride[axis]
        solid: BoolArray = self._solid.take(flat)
        return solid


def _thin_walls(world: PreparedMap) -> BoolArray:
    """Return which points (N,) are of thin walls: whichever face is the nearest to a beam, the wall faces it."""
    if len(world.behind):
        return world.behind >= 0
    return np.zeros(len(world.cloud.points), dtype=bool)


def explanation(inlier_ratio: float, consistency: ScanConsistency | None) -> str:
    """Return how far the map explains a sweep, in words for an operator.

    Args:
        inlier_ratio: share of the sweep that the map explains.
        consistency: the kinds of beams that it does not explain, if they were examined.
    """
    parts = [
        f"the map explains {'only ' if inlier_ratio < 0.5 else ''}{inlier_ratio:.0%} of the sweep"
    ]
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
            if share >= _NOTABLE:
                parts.append(f"{share:.0%} {what}")
    return "; ".join(parts)


_NOTABLE = 0.05
"""Noise and edges leave a smaller share of any sweep unexplained."""
