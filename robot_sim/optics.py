"""Where the light of a ray goes: to walls, through panes, off mirrors, and back.

A pane passes part of the light and mirrors part of it; both parts are followed, with the share of light
that is left in them, until they meet something opaque or grow too faint. Of all the echoes that
come back along one ray the strongest is the ray's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from localization.types import IntArray
from robot_sim.arrays import BoolArray, FloatArray
from robot_sim.casting.caster import NO_GEOM, GeomArray, Hits, RayCaster
from robot_sim.effects import Echoes, Panes, received_power
from robot_sim.materials import DEFAULT, material_named

_STEP: Final = 1e-5
"""A ray goes on this far behind the surface it has passed [m]."""
_FAINT: Final = 0.03
"""Light that has less than this share left one way, a thousandth both ways, is followed no more."""


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """Which way the flat faces of geoms look: boxes and planes. Other shapes mirror nothing."""

    flat: BoolArray
    """(G + 1,)."""
    plane: BoolArray
    """(G + 1,)."""
    half: FloatArray
    """(G + 1, 3) of boxes [m]."""
    data: mujoco.MjData
    """Where they are."""

    def normals(self, geoms: GeomArray, points: FloatArray) -> FloatArray:
        """Return a unit normal (N, 3) of the face of each geom that a point (N, 3) [m] lies on."""
        axes = self.data.geom_xmat[geoms].reshape(-1, 3, 3)
        local = np.einsum("nji,nj->ni", axes, points - self.data.geom_xpos[geoms])
        face = np.abs(self.half[geoms] - np.abs(local)).argmin(axis=1)
        face[self.plane[geoms]] = 2
        return np.asarray(np.take_along_axis(axes, face[:, None, None], axis=2)[:, :, 0])


@dataclass(frozen=True, slots=True, eq=False)
class Optics:
    """What each geom does with light; arrays (G + 1,), the last for no geom at all."""

    reflectivity: FloatArray
    transmittance: FloatArray
    specular: FloatArray
    refractive_index: FloatArray
    clear: BoolArray
    faces: Faces

    def opaque(self) -> Optics:
        """Return the same with glass and mirrors as matt walls."""
        return replace(
            self,
            reflectivity=np.where(self.clear, DEFAULT.reflectivity, self.reflectivity),
            clear=np.zeros_like(self.clear),
        )

    def remissions(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return what comes straight back: Lambert's cosine law, but for retroreflectors."""
        rho = self.reflectivity[geoms]
        return np.where(rho > 1.5, rho, rho * cosines)

    def mirrored(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return the share of the light that is mirrored: Fresnel's, for panes."""
        index = self.refractive_index[geoms]
        steep = pane_reflectance(cosines, index)
        normal = pane_reflectance(np.ones_like(cosines), index)
        growth = np.divide(steep, normal, out=np.ones_like(steep), where=normal > 0.0)
        flat = self.faces.flat[geoms]
        return np.where(flat, np.minimum(self.specular[geoms] * growth, 1.0), 0.0)

    def transmitted(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return the share of the light that passes; what is mirrored more passes less."""
        return np.asarray(
            self.transmittance[geoms]
            * (1.0 - self.mirrored(geoms, cosines))
            / np.maximum(1.0 - self.specular[geoms] * self.faces.flat[geoms], 1e-9)
        )


def optics_of(model: mujoco.MjModel, data: mujoco.MjData) -> Optics:
    """Look up the materials of a model's geoms by the names of their MuJoCo materials.

    Args:
        model: Of the world.
        data: Its state, where geoms are looked for when light falls on them.
    """
    materials = [
        DEFAULT if material < 0 else material_named(model.material(material).name)
        for material in model.geom_matid
    ]
    materials.append(DEFAULT)
    reflectivity = np.array([m.reflectivity for m in materials])
    reflectivity[-1] = 0.0
    kind = model.geom_type
    plane = kind == mujoco.mjtGeom.mjGEOM_PLANE
    return Optics(
        reflectivity,
        np.array([m.transmittance for m in materials]),
        np.array([m.specular for m in materials]),
        np.array([m.refractive_index for m in materials]),
        np.array([m.clear for m in materials]),
        Faces(
            np.append((kind == mujoco.mjtGeom.mjGEOM_BOX) | plane, False),
            np.append(plane, False),
            np.vstack([model.geom_size, np.zeros(3)]),
            data,
        ),
    )


def pane_reflectance(cosines: FloatArray, index: FloatArray) -> FloatArray:
    """Return what a clear pane mirrors of unpolarised light, both faces and all their echoes counted.

    Fresnel's equations give r of one face; light that goes to and fro between two such faces adds
    up to 2 r / (1 + r).

    Args:
        cosines: (N,) of the angle of incidence.
        index: (N,) refractive index; 1 mirrors nothing.
    """
    c = np.clip(cosines, 0.0, 1.0)
    inner = np.sqrt(1.0 - (1.0 - c * c) / index**2)
    # At grazing incidence on nothing (index 1) both cosines vanish together; mind 0 / 0.
    across = (c - index * inner) / np.maximum(c + index * inner, 1e-12)
    along = (index * c - inner) / np.maximum(index * c + inner, 1e-12)
    face = 0.5 * (across**2 + along**2)
    return np.asarray(2.0 * face / (1.0 + face))


@dataclass(frozen=True, slots=True, eq=False)
class _Light:
    """Rays on their way; arrays of one length."""

    ray: npt.NDArray[np.intp]
    """Which of the rays that were sent out each one is a part of."""
    origins: FloatArray
    directions: FloatArray
    times: IntArray
    travelled: FloatArray
    share: FloatArray
    """Of the light, one way."""
    inside: GeomArray
    """The pane each one is in; -1 in the open."""


def look(
    caster: RayCaster,
    optics: Optics,
    panes: Panes | None,
    origins: FloatArray,
    directions: FloatArray,
    times: IntArray,
    max_range: float,
) -> Echoes:
    """Cast rays, through panes and off mirrors, and return the strongest echo of each.

    Args:
        caster: Of the world.
        optics: Of its geoms.
        panes: How far light is followed; None takes what a ray meets first.
        origins: (N, 3) in ``map`` [m].
        directions: (N, 3) unit vectors.
        times: (N,) of each ray [ns].
        max_range: [m], along the whole way.
    """
    n = len(origins)
    light = _Light(
        np.arange(n),
        origins,
        directions,
        times,
        np.zeros(n),
        np.ones(n),
        np.full(n, -1, dtype=np.int32),
    )
    first: Echoes | None = None
    later: list[_Found] = []
    # A pane is met twice, going in and coming out.
    for _ in range(1 if panes is None else 1 + 2 * panes.depth):
        hits = caster.hits(light.origins, light.directions, light.times, max_range)
        remissions = optics.remissions(hits.geoms, hits.cosines)
        clear = optics.clear[hits.geoms]
        ways = light.travelled + hits.distances
        beyond = ways > max_range
        leaving = (hits.geoms == light.inside) & clear
        if panes is not None and clear.any():
            remissions += np.where(clear, _glints(optics, panes, hits), 0.0)
        remissions *= light.share**2
        unseen = beyond | leaving
        ways[unseen], remissions[unseen] = np.inf, 0.0
        if first is None:
            first = Echoes(ways, remissions, hits.cosines)
        else:
            later.append(_Found(light.ray, ways, remissions, hits.cosines))
        clear &= ~beyond
        if panes is None or not clear.any():
            break
        light = _beyond(light, optics, hits, clear, leaving)
        if not len(light.ray):
            break
    assert first is not None
    return _strongest(first, later) if later else first


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """Echoes of light that has passed something clear; arrays of one length."""

    ray: npt.NDArray[np.intp]
    ways: FloatArray
    remissions: FloatArray
    cosines: FloatArray


def _glints(optics: Optics, panes: Panes, hits: Hits) -> FloatArray:
    """Return what panes and mirrors send straight back, near normal incidence."""
    slope2 = np.maximum(1.0 - hits.cosines**2, 0.0)
    mirrored = optics.mirrored(hits.geoms, hits.cosines)
    return np.asarray(panes.glint * mirrored * np.exp(-slope2 / panes.lobe**2))


def _beyond(
    light: _Light, optics: Optics, hits: Hits, clear: BoolArray, leaving: BoolArray
) -> _Light:
    """Return the light that goes on from what is clear: through, out of a pane, and mirrored."""
    through = np.where(leaving, 1.0, optics.transmitted(hits.geoms, hits.cosines)) * light.share
    off = np.where(leaving, 0.0, optics.mirrored(hits.geoms, hits.cosines)) * light.share
    on = np.flatnonzero(clear & (through > _FAINT))
    back = np.flatnonzero(clear & (off > _FAINT))
    goes = np.concatenate([on, back])
    points = light.origins[goes] + hits.distances[goes, None] * light.directions[goes]
    directions = light.directions[goes]
    turned, n = directions[len(on) :], optics.faces.normals(hits.geoms[back], points[len(on) :])
    directions[len(on) :] = turned - 2.0 * np.einsum("ni,ni->n", turned, n)[:, None] * n
    inside = np.where(leaving[goes], NO_GEOM, hits.geoms[goes])
    inside[len(on) :] = NO_GEOM
    return _Light(
        light.ray[goes],
        points + _STEP * directions,
        directions,
        light.times[goes],
        light.travelled[goes] + hits.distances[goes] + _STEP,
        np.concatenate([through[on], off[back]]),
        inside.astype(np.int32),
    )


def _strongest(first: Echoes, later: Sequence[_Found]) -> Echoes:
    """Return for each ray the echo of most power: the first surface's, or one from beyond it."""
    rays = np.concatenate([found.ray for found in later])
    again = np.unique(rays)
    rays = np.concatenate([again, rays])
    ways = np.concatenate([first.distances[again], *(found.ways for found in later)])
    remissions = np.concatenate([first.remissions[again], *(found.remissions for found in later)])
    cosines = np.concatenate([first.cosines[again], *(found.cosines for found in later)])
    order = np.lexsort((received_power(remissions, ways), rays))
    best = order[np.flatnonzero(np.diff(rays[order], append=-1))]
    first.distances[again] = ways[best]
    first.remissions[again] = remissions[best]
    first.cosines[again] = cosines[best]
    return first
