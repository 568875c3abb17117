"""Light rays on their way through a world, and the strongest echo of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting.ray_caster import NO_GEOM, GeomArray
from robot_sim.sensors.echoes import Echoes, received_power

_FAINT: Final = 0.03
"""Share of the light, one way, below which it is followed no more (a thousandth both ways)."""


@dataclass(frozen=True, slots=True, eq=False)
class LightRays:
    """Rays on their way; arrays of one length."""

    ray: npt.NDArray[np.intp]
    """Index of the emitted ray that each one is a part of, (N,)."""
    origins: FloatArray
    """Origins (N, 3) [m]."""
    directions: FloatArray
    """Unit directions (N, 3)."""
    times: IntArray
    """Times of the beams (N,) [ns]."""
    travelled: FloatArray
    """Length of the path so far (N,) [m]."""
    share: FloatArray
    """Share of the light that is left, one way, (N,)."""
    inside: GeomArray
    """Clear geom that each ray is in, (N,); none in a box, which is crossed at once."""

    @classmethod
    def sent(cls, origins: FloatArray, directions: FloatArray, times: IntArray) -> LightRays:
        """Return the rays that leave the scanner, with all their light."""
        n = len(origins)
        inside = np.full(n, NO_GEOM, dtype=np.int32)
        return cls(np.arange(n), origins, directions, times, np.zeros(n), np.ones(n), inside)

    def __len__(self) -> int:
        return len(self.ray)

    def only(self, rows: npt.NDArray[np.intp]) -> LightRays:
        """Return the rays ``rows`` (M,)."""
        return LightRays(
            self.ray.take(rows),
            self.origins.take(rows, axis=0),
            self.directions.take(rows, axis=0),
            self.times.take(rows),
            self.travelled.take(rows),
            self.share.take(rows),
            self.inside.take(rows),
        )


@dataclass(frozen=True, slots=True, eq=False)
class ClearHits:
    """Rays that have hit a clear surface; arrays of one length, except for ``light``."""

    light: LightRays
    """These and other rays."""
    rows: npt.NDArray[np.intp]
    """Rows of these rays in ``light``."""
    distances: FloatArray
    """Distances of the hits [m]."""
    geoms: GeomArray
    """Geoms that were hit."""
    mirrored: FloatArray
    """Share of the light that the surface reflects."""
    leaving: BoolArray
    """Whether the surface is hit from inside."""


class StrongestEchoes:
    """The strongest echo of each ray so far."""

    def __init__(self, echoes: Echoes, brightest: float, least: float) -> None:
        self.echoes = echoes
        self._brightest, self._least = brightest, least
        self._powers = received_power(echoes.remissions, echoes.distances)

    def add(
        self, light: LightRays, ways: FloatArray, remissions: FloatArray, cosines: FloatArray
    ) -> None:
        """Update with echoes (N,) of ``light``."""
        powers = received_power(remissions, ways)
        better = np.flatnonzero(powers > self._powers.take(light.ray))
        # Several may belong to one ray; the last one written, the strongest, stays.
        better = better[np.argsort(powers[better], kind="stable")]
        rays = light.ray[better]
        self._powers[rays] = powers[better]
        self.echoes.distances[rays] = ways[better]
        self.echoes.remissions[rays] = remissions[better]
        self.echoes.cosines[rays] = cosines[better]

    def promising(self, met: ClearHits, share: FloatArray) -> npt.NDArray[np.intp]:
        """Return the rows of ``met`` that may still return more than the strongest echo so far.

        Args:
            met: Hits from which the light continues.
            share: (N,) share of all the light that continues, one way.
        """
        ways = met.light.travelled.take(met.rows) + met.distances
        found = self._powers.take(met.light.ray.take(met.rows))
        needed = np.maximum(found, self._least) * ways * ways
        return np.flatnonzero((share > _FAINT) & (share * share * self._brightest > needed))
