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
"""Light that has less than this share left one way, a thousandth both ways, is followed no more."""


@dataclass(frozen=True, slots=True, eq=False)
class LightRays:
    """Rays on their way; arrays of one length."""

    ray: npt.NDArray[np.intp]
    """Which of the rays that were sent out each one is a part of."""
    origins: FloatArray
    """(N, 3) [m]."""
    directions: FloatArray
    """(N, 3)."""
    times: IntArray
    """[ns]."""
    travelled: FloatArray
    """[m]."""
    share: FloatArray
    """Of the light, one way."""
    inside: GeomArray
    """The clear geom each one is in, unless that is a box: those are left as they are entered."""

    @classmethod
    def sent(cls, origins: FloatArray, directions: FloatArray, times: IntArray) -> LightRays:
        """Return all the light of rays that leave the scanner."""
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
    """Light that has come upon something clear; arrays of one length, but for ``light``."""

    light: LightRays
    """This and other."""
    rows: npt.NDArray[np.intp]
    """Of that light."""
    distances: FloatArray
    """[m]."""
    geoms: GeomArray
    mirrored: FloatArray
    """Share of it that this mirrors."""
    leaving: BoolArray
    """Whether it comes upon it from inside."""


class StrongestEchoes:
    """The strongest echo of each ray so far."""

    def __init__(self, echoes: Echoes, brightest: float, least: float) -> None:
        self.echoes = echoes
        self._brightest, self._least = brightest, least
        self._powers = received_power(echoes.remissions, echoes.distances)

    def add(
        self, light: LightRays, ways: FloatArray, remissions: FloatArray, cosines: FloatArray
    ) -> None:
        """Take echoes (N,) of ``light`` into account."""
        powers = received_power(remissions, ways)
        better = np.flatnonzero(powers > self._powers.take(light.ray))
        # Several may be of one ray; of those the last that is written stays, the strongest.
        better = better[np.argsort(powers[better], kind="stable")]
        rays = light.ray[better]
        self._powers[rays] = powers[better]
        self.echoes.distances[rays] = ways[better]
        self.echoes.remissions[rays] = remissions[better]
        self.echoes.cosines[rays] = cosines[better]

    def promising(self, met: ClearHits, share: FloatArray) -> npt.NDArray[np.intp]:
        """Return the rows of ``met`` that may yet bring back more than was found, off the brightest wall.

        Args:
            met: From where it goes on.
            share: (N,) that goes on, of all the light, one way.
        """
        ways = met.light.travelled.take(met.rows) + met.distances
        found = self._powers.take(met.light.ray.take(met.rows))
        needed = np.maximum(found, self._least) * ways * ways
        return np.flatnonzero((share > _FAINT) & (share * share * self._brightest > needed))
