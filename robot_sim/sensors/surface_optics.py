"""What the surfaces of a world do with light, geom by geom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting.ray_caster import GeomArray
from robot_sim.scene_objects.materials import DEFAULT, material_named

_RETROREFLECTING: Final = 1.5
"""Reflectivity above which a surface sends light back to where it came from, however it is met: between
the brightest matt surface and the dimmest foil."""


@dataclass(frozen=True, slots=True, eq=False)
class FlatFaces:
    """The flat faces of geoms: boxes and planes. Other shapes mirror nothing."""

    is_box: BoolArray
    """(G + 1,)."""
    is_plane: BoolArray
    """(G + 1,)."""
    half: FloatArray
    """(G + 1, 3) of boxes [m]."""
    data: mujoco.MjData
    """Where they are."""

    def normals(self, geoms: GeomArray, points: FloatArray) -> FloatArray:
        """Return a unit normal (N, 3) of the face of each geom that a point (N, 3) [m] lies on."""
        axes = self.data.geom_xmat.take(geoms, axis=0).reshape(-1, 3, 3)
        offsets = points - self.data.geom_xpos.take(geoms, axis=0)
        local = np.einsum("nji,nj->ni", axes, offsets)
        x, y, z = np.abs(self.half.take(geoms, axis=0) - np.abs(local)).T
        face = np.where(z < np.minimum(x, y), 2, y < x)
        face[self.is_plane.take(geoms)] = 2
        return np.asarray(axes[np.arange(len(face)), :, face])

    def depths(self, geoms: GeomArray, points: FloatArray, directions: FloatArray) -> FloatArray:
        """Return how far rays go inside boxes (N,) [m] from where they enter; 0 in other shapes."""
        axes = self.data.geom_xmat.take(geoms, axis=0).reshape(-1, 3, 3)
        offsets = points - self.data.geom_xpos.take(geoms, axis=0)
        local = np.einsum("nji,nj->ni", axes, offsets)
        along = np.einsum("nji,nj->ni", axes, directions)
        along[np.abs(along) < 1e-12] = 1e-12
        leave = (np.copysign(self.half.take(geoms, axis=0), along) - local) / along
        nearest = np.minimum(np.minimum(leave[:, 0], leave[:, 1]), leave[:, 2])
        return np.where(self.is_box.take(geoms), np.maximum(nearest, 0.0), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceOptics:
    """What each geom does with light; arrays (G + 1,), the last for no geom at all."""

    reflectivity: FloatArray
    brightest: float
    """Greatest reflectivity of all."""
    unmirrored: FloatArray
    """Share that passes of what is not mirrored."""
    refractive_index: FloatArray
    over_normal: FloatArray
    """Share that is mirrored at normal incidence, over what a clear pane of that index mirrors there (1
    for opaque mirrors); 0 where there is no flat face to mirror it."""
    clear: BoolArray
    faces: FlatFaces

    def opaque(self) -> SurfaceOptics:
        """Return the same with glass and mirrors as matt walls."""
        reflectivity = np.where(self.clear, DEFAULT.reflectivity, self.reflectivity)
        return replace(
            self,
            reflectivity=reflectivity,
            brightest=float(reflectivity.max()),
            clear=np.zeros_like(self.clear),
        )

    def remissions(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return what comes straight back: Lambert's cosine law, but for retroreflectors."""
        rho = self.reflectivity.take(geoms)
        if self.brightest <= _RETROREFLECTING:
            return rho * cosines
        return np.where(rho > _RETROREFLECTING, rho, rho * cosines)

    def mirrored(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return the share of the light (N,) that clear geoms mirror: Fresnel's, for panes."""
        index = self.refractive_index.take(geoms)
        growth = np.where(index > 1.0, pane_reflectance(cosines, index), 1.0)
        return np.minimum(self.over_normal.take(geoms) * growth, 1.0)

    def transmitted(self, geoms: GeomArray, mirrored: FloatArray) -> FloatArray:
        """Return the share of the light that passes: what is mirrored more passes less."""
        return np.minimum(self.unmirrored.take(geoms) * (1.0 - mirrored), 1.0)


def optics_of(model: mujoco.MjModel, data: mujoco.MjData) -> SurfaceOptics:
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
    index = np.array([m.refractive_index for m in materials])
    specular = np.array([m.specular for m in materials])
    at_normal = np.where(index > 1.0, pane_reflectance(np.ones(len(index)), index), 1.0)
    kind = model.geom_type
    faces = FlatFaces(
        np.append(kind == mujoco.mjtGeom.mjGEOM_BOX, False),
        np.append(kind == mujoco.mjtGeom.mjGEOM_PLANE, False),
        np.vstack([model.geom_size, np.zeros(3)]),
        data,
    )
    return SurfaceOptics(
        reflectivity,
        float(reflectivity.max()),
        np.array([m.transmittance for m in materials]) / np.maximum(1.0 - specular, 1e-9),
        index,
        np.where(faces.is_box | faces.is_plane, specular / at_normal, 0.0),
        np.array([m.clear for m in materials]),
        faces,
    )


def pane_reflectance(cosines: FloatArray, index: FloatArray) -> FloatArray:
    """Return what a clear pane mirrors of unpolarised light, both faces and all their echoes counted.

    Fresnel's equations give r of one face; light that goes to and fro between two such faces adds
    up to 2 r / (1 + r).

    Args:
        cosines: (N,) of the angle of incidence, in [0, 1].
        index: (N,) refractive index; 1 mirrors nothing.
    """
    square = index * index
    # Index times the cosine inside, for Snell's law: with it, one root does for both polarisations.
    inner = np.sqrt(cosines * cosines + (square - 1.0))
    outer = square * cosines
    # At grazing incidence on nothing (index 1) both cosines vanish together; mind 0 / 0.
    across = (cosines - inner) / np.maximum(cosines + inner, 1e-12)
    along = (outer - inner) / np.maximum(outer + inner, 1e-12)
    face = 0.5 * (across * across + along * along)
    return np.asarray(2.0 * face / (1.0 + face))
