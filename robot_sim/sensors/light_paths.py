"""Light paths through panes and off mirrors, traced to the strongest echo of each ray.

A pane transmits a part of the light and reflects a part. Both are followed; the reflected light one
iteration later, and only where it may still return more than the transmitted light has returned. Of all
echoes that return along one ray the strongest is taken.
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
"""Distance behind a passed surface at which a ray continues [m]."""
_NOT_INSIDE: Final = np.int32(NO_GEOM)


@dataclass(frozen=True, slots=True, eq=False)
class LightTracer:
    """Traces the light of a scanner through a world and returns its echoes."""

    caster: RayCaster
    """Ray caster of the world."""
    optics: SurfaceOptics
    """Optical properties of its geoms."""
    panes: Panes | None
    """Limits to which light is followed; None takes the first surface of each ray."""
    max_range: float
    """Greatest length of the whole path [m]."""
    least: float = 0.0
    """Power that no receiver detects: light that cannot return as much is given up."""

    def traces_like(self, other: LightTracer) -> bool:
        """Whether ``other`` would give the same echoes for any rays."""
        return (
            self.caster is other.caster
            and self.optics is other.optics
            and (self.panes, self.max_range, self.least)
            == (other.panes, other.max_range, other.least)
        )

    def trace_beams(self, starts: FloatArray, directions: FloatArray, times: IntArray) -> Echoes:
        """Return the echoes (K, N) of the K sub-rays of N beams.

        Beyond clear surfaces a beam is reduced to its centre: where the centre and another sub-ray have
        both hit a clear surface, they share the echo.

        Args:
            starts: (3, K, N) origins of the sub-rays, a beam's centre first [m].
            directions: (3, K, N) unit vectors.
            times: (N,) times of the beams [ns].
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
        """Return the echo of the first surface of each ray, without glints, and the hits."""
        hits = self.caster.hits(light.origins, light.directions, light.times, self.max_range)
        remissions = self.optics.remissions(hits.geoms, hits.cosines)
        return Echoes(hits.distances.copy(), remissions, hits.cosines.copy()), hits

    def follow(self, light: LightRays, echoes: Echoes, hits: Hits, rows: BoolArray) -> None:
        """Follow rays beyond clear surfaces, and write stronger echoes to ``echoes``.

        Args:
            light: The emitted rays.
            echoes: Echoes of the first surface of each ray.
            hits: First hit of each ray.
            rows: Which rays to follow; all of them have hit a clear surface.
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
            # Reflected light is cast after transmitted light, whose echo it has to exceed; most of it
            # is never cast, so that its path is computed only then.
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
        """Cast light on, record its echoes, and return the rays that have hit a clear surface."""
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
        """Return the rays that have hit something ``clear``; add the glints to ``remissions``.

        Near normal incidence a pane or mirror reflects its share straight back. A surface that is hit
        from inside returns nothing: both faces of a pane were counted when it was entered.
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
    """Return the light that continues through clear surfaces, where it can still matter."""
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
    """Return the light that clear surfaces reflect, where it can still matter."""
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
