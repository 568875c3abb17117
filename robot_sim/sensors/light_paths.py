"""Where the light of a ray goes: to walls, through panes, off mirrors, and back.

A pane passes part of the light and mirrors part of it. Both are followed, the mirrored light one turn later:
only where it may still bring back more than what passed has brought. Of all the echoes that come
back along one ray the strongest is the ray's.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final

import numpy as np
import numpy.typing as npt

from localization.types import IntArray
from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting.ray_caster import NO_GEOM, GeomArray, Hits, RayCaster
from robot_sim.sensors.beam_effects import Echoes, Panes, received_power
from robot_sim.sensors.surface_optics import SurfaceOptics

_STEP: Final = 1e-5
"""A ray goes on this far behind the surface it has passed [m]."""
_NOT_INSIDE: Final = np.int32(NO_GEOM)
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
class _Met:
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


@dataclass(frozen=True, slots=True, eq=False)
class LightTracer:
    """Sends out light in a world, and tells what comes back."""

    caster: RayCaster
    optics: SurfaceOptics
    panes: Panes | None
    """How far light is followed; None takes what a ray meets first."""
    max_range: float
    """[m], along the whole way."""
    least: float = 0.0
    """Power that no receiver takes notice of: light that cannot bring it back is given up."""

    def traces_like(self, other: LightTracer) -> bool:
        """Whether ``other`` would tell the same of any light."""
        return (
            self.caster is other.caster
            and self.optics is other.optics
            and (self.panes, self.max_range, self.least)
            == (other.panes, other.max_range, other.least)
        )

    def trace(self, light: LightRays) -> Echoes:
        """Return the strongest echo of each ray, through panes and off mirrors."""
        echoes, hits = self.first(light)
        self.follow(light, echoes, hits, self.optics.clear.take(hits.geoms))
        return echoes

    def trace_beams(self, starts: FloatArray, directions: FloatArray, times: IntArray) -> Echoes:
        """Return the echoes (K, N) of the K sub-rays of N beams.

        Beyond clear things a beam is as thin as its centre: where that and another sub-ray have both
        hit something clear, they see the same.

        Args:
            starts: (3, K, N) of the sub-rays, a beam's centre first [m].
            directions: (3, K, N), unit vectors.
            times: (N,) of the beams [ns].
        """
        _, rays, beams = shape = starts.shape
        light = LightRays.sent(
            starts.reshape(3, -1).T, directions.reshape(3, -1).T, np.tile(times, rays)
        )
        echoes, hits = self.first(light)
        grid = Echoes(*(getattr(echoes, f.name).reshape(rays, beams) for f in fields(Echoes)))
        clear = self.optics.clear.take(hits.geoms).reshape(shape[1:])
        same = clear & clear[0]
        same[0] = False
        self.follow(light, echoes, hits, (clear & ~same).ravel())
        sub_rays, of = same.nonzero()
        for values in (grid.distances, grid.remissions, grid.cosines):
            values[sub_rays, of] = values[0, of]
        return grid

    def first(self, light: LightRays) -> tuple[Echoes, Hits]:
        """Return the echo of the first surface of each ray, and what was hit; glints come later."""
        hits = self.caster.hits(light.origins, light.directions, light.times, self.max_range)
        remissions = self.optics.remissions(hits.geoms, hits.cosines)
        return Echoes(hits.distances.copy(), remissions, hits.cosines.copy()), hits

    def follow(self, light: LightRays, echoes: Echoes, hits: Hits, rows: BoolArray) -> None:
        """Follow rays beyond the clear surfaces they have hit, and write what is stronger to ``echoes``.

        Args:
            light: What was sent out.
            echoes: Of the first surface of each ray.
            hits: What each ray has hit first.
            rows: Which rays to follow; they have all hit something clear.
        """
        chosen = np.flatnonzero(rows)
        if self.panes is None or not len(chosen):
            return
        met = self._met(light, hits, echoes.remissions, chosen)
        found = _Strongest(echoes, self.optics.brightest, self.least)
        fresh: list[_Met] = [met]
        late: list[_Met] = []
        for _ in range(self.panes.depth):
            going = [_passing(met, self.optics, found) for met in fresh]
            # Mirrored light lets what passes go first, and then has its echo to outdo; most of it
            # never goes, hence its way is not worked out before.
            if any(len(light) for light in going):
                turned, late = late, fresh
            else:
                turned, late = late + fresh, []
            going += [_mirrored(met, self.optics, found) for met in turned]
            going = [light for light in going if len(light)]
            fresh = [self._on(_joined(going), found)] if going else []
            if not fresh and not late:
                break

    def _on(self, light: LightRays, found: _Strongest) -> _Met:
        """Cast light on, note its echoes, and return what has come upon something clear."""
        hits = self.caster.hits(light.origins, light.directions, light.times, self.max_range)
        ways = light.travelled + hits.distances
        beyond = ways > self.max_range
        clear = np.flatnonzero(self.optics.clear.take(hits.geoms) & ~beyond)
        remissions = self.optics.remissions(hits.geoms, hits.cosines)
        met = self._met(light, hits, remissions, clear)
        remissions *= light.share * light.share
        remissions[beyond] = 0.0
        found.add(light, ways, remissions, hits.cosines)
        return met

    def _met(
        self, light: LightRays, hits: Hits, remissions: FloatArray, clear: npt.NDArray[np.intp]
    ) -> _Met:
        """Return the light that has come upon something ``clear``; add the glints to ``remissions``.

        Near normal incidence a pane or mirror sends its share straight back. A surface that is met
        from inside sends nothing: both faces of a pane were counted as it was entered.
        """
        assert self.panes is not None
        geoms, cosines = hits.geoms.take(clear), hits.cosines.take(clear)
        leaving = geoms == light.inside.take(clear)
        mirrored = self.optics.mirrored(geoms, cosines)
        straight_back = np.exp((cosines * cosines - 1.0) / self.panes.lobe**2)
        glints = self.panes.glint * mirrored * straight_back
        remissions[clear] = np.where(leaving, 0.0, remissions.take(clear) + glints)
        return _Met(light, clear, hits.distances.take(clear), geoms, mirrored, leaving)


class _Strongest:
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

    def promising(self, met: _Met, share: FloatArray) -> npt.NDArray[np.intp]:
        """Return the rows of ``met`` that may yet bring back more than was found, off the brightest wall.

        Args:
            met: From where it goes on.
            share: (N,) that goes on, of all the light, one way.
        """
        ways = met.light.travelled.take(met.rows) + met.distances
        found = self._powers.take(met.light.ray.take(met.rows))
        needed = np.maximum(found, self._least) * ways * ways
        return np.flatnonzero((share > _FAINT) & (share * share * self._brightest > needed))


def _passing(met: _Met, optics: SurfaceOptics, found: _Strongest) -> LightRays:
    """Return the light that goes on through what it has come upon, where that is worth while."""
    share = np.where(met.leaving, 1.0, optics.transmitted(met.geoms, met.mirrored))
    share *= met.light.share.take(met.rows)
    on = found.promising(met, share)
    light, geoms, distances = met.light.only(met.rows[on]), met.geoms[on], met.distances[on]
    points = light.origins + distances[:, None] * light.directions
    steps = optics.faces.depths(geoms, points, light.directions) + _STEP
    done = optics.faces.is_box.take(geoms) | met.leaving[on]
    return LightRays(
        light.ray,
        points + steps[:, None] * light.directions,
        light.directions,
        light.times,
        light.travelled + distances + steps,
        share[on],
        np.where(done, _NOT_INSIDE, geoms),
    )


def _mirrored(met: _Met, optics: SurfaceOptics, found: _Strongest) -> LightRays:
    """Return the light that is thrown back by what it has come upon, where that is worth while."""
    share = np.where(met.leaving, 0.0, met.mirrored) * met.light.share.take(met.rows)
    back = found.promising(met, share)
    light, distances = met.light.only(met.rows[back]), met.distances[back]
    d = light.directions
    points = light.origins + distances[:, None] * d
    n = optics.faces.normals(met.geoms[back], points)
    d = d - 2.0 * np.einsum("ni,ni->n", d, n)[:, None] * n
    return LightRays(
        light.ray,
        points + _STEP * d,
        d,
        light.times,
        light.travelled + distances + _STEP,
        share[back],
        np.full(len(d), _NOT_INSIDE),
    )


def _joined(parts: list[LightRays]) -> LightRays:
    if len(parts) == 1:
        return parts[0]
    columns = ([getattr(part, f.name) for part in parts] for f in fields(LightRays))
    return LightRays(*(np.concatenate(column) for column in columns))
