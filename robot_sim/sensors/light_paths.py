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
from robot_sim.raycasting.ray_caster import NO_GEOM, Hits, RayCaster
from robot_sim.sensors.echoes import Echoes
from robot_sim.sensors.lidar_effects import Panes
from robot_sim.sensors.light_rays import ClearHits, LightRays, StrongestEchoes
from robot_sim.sensors.surface_optics import SurfaceOptics

_STEP: Final = 1e-5
"""A ray goes on this far behind the surface it has passed [m]."""
_NOT_INSIDE: Final = np.int32(NO_GEOM)


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
        found = StrongestEchoes(echoes, self.optics.brightest, self.least)
        fresh: list[ClearHits] = [met]
        late: list[ClearHits] = []
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

    def _on(self, light: LightRays, found: StrongestEchoes) -> ClearHits:
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
    ) -> ClearHits:
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
        return ClearHits(light, clear, hits.distances.take(clear), geoms, mirrored, leaving)


def _passing(met: ClearHits, optics: SurfaceOptics, found: StrongestEchoes) -> LightRays:
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


def _mirrored(met: ClearHits, optics: SurfaceOptics, found: StrongestEchoes) -> LightRays:
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
