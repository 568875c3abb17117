"""Consistency of a sweep with the map: which beams the map does not explain, and of which kind they are.

A beam ends at a surface. If that is not mapped, the map along the beam classifies it: the first mapped surface
on the beam's line is behind its end (an unmapped object occludes it), before its end (the beam violates space
that is mapped as occupied: an object is gone, or the pose is wrong), or there is none, or it is met from
behind (the beam ran through unmapped space).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from localization.compiled.surfaces import first_surfaces
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import GRAZING
from localization.types import BoolArray, Pose, ScanConsistency, Sweep


@dataclass(frozen=True, slots=True)
class ScanConsistencyConfig:
    """How beams are classified."""

    horizon: float = 6.0
    """Distance beyond a beam's end within which a surface counts [m]; the size of a room."""
    nearest: float = 0.3
    """Surfaces nearer to the scanner than this are ignored [m]."""
    aside: float = 0.08
    """A beam meets a mapped surface if it cuts the plane of a point no farther from it [m]: a cloud's
    spacing."""


_STEP = 0.1
"""Places on a beam at which the map is looked at are so far apart [m]: two cells of its grid."""


class BeamClassifier:
    """Traces beams through a map."""

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

    def classify(
        self, sweep: Sweep, map_from_base: Pose, distances: FloatArray
    ) -> ScanConsistency | None:
        """Return how a sweep agrees with the map; None without any return below where the map was cut.

        Args:
            sweep: points in ``base_link``.
            map_from_base: the estimate.
            distances: (N,) distances of the points to the map there, as in ``Match`` [m].
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
        return first_surfaces(
            start, line, far, self._world.arrays, c.nearest, _STEP, c.aside, GRAZING
        )


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
