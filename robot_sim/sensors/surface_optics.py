"""Optical properties of the surfaces of a world, geom by geom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import BoolArray, FloatArray
from robot_sim.raycasting.ray_caster import GeomArray
from robot_sim.scene_objects.materials import DEFAULT, material_named

_RETROREFLECTING: Final = 1.5
"""Reflectivity above which a surface returns light to its source at any incidence: between the
brightest matt surface and the dimmest foil."""


@dataclass(frozen=True, slots=True, eq=False)
class FlatFaces:
    """Flat faces of geoms: boxes and planes. Other shapes do not reflect specularly."""

    is_box: BoolArray
    """Whether each geom is a box, (G + 1,)."""
    is_plane: BoolArray
    """Whether each geom is a plane, (G + 1,)."""
    half: FloatArray
    """Half extents of boxes [m], (G + 1, 3)."""
    data: mujoco.MjData
    """State of the model, with the poses of the geoms."""

    def normals(self, geoms: GeomArray, points: FloatArray) -> FloatArray:
        """Return unit normals (N, 3) of the faces of geoms that points (N, 3) [m] lie on."""
        axes = self.data.geom_xmat.take(geoms, axis=0).reshape(-1, 3, 3)
        offsets = points - self.data.geom_xpos.take(geoms, axis=0)
        local = np.einsum("nji,nj->ni", axes, offsets)
        x, y, z = np.abs(self.half.take(geoms, axis=0) - np.abs(local)).T
        face = np.where(z < np.minimum(x, y), 2, y < x)
        face[self.is_plane.take(geoms)] = 2
        return np.asarray(axes[np.arange(len(face)), :, face])

    def depths(self, geoms: GeomArray, points: FloatArray, directions: FloatArray) -> FloatArray:
        """Return the lengths (N,) [m] of rays inside boxes from where they enter; 0 in other shapes."""
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
    """Optical properties of each geom; arrays (G + 1,), the last entry for no geom at all."""

    reflectivity: FloatArray
    """Diffuse reflectivity at normal incidence, relative to a white surface."""
    brightest: float
    """Greatest reflectivity of all geoms."""
    unmirrored: FloatArray
    """Share of the light that is transmitted of what is not reflected."""
    refractive_index: FloatArray
    """Refractive index; 1 for opaque surfaces."""
    over_normal: FloatArray
    """Specular share at normal incidence over that of a clear pane of that index (1 for opaque
    mirrors); 0 without a flat face."""
    clear: BoolArray
    """Whether light is followed through the geom or off it."""
    faces: FlatFaces
    """Flat faces of the geoms."""

    def opaque(self) -> SurfaceOptics:
        """Return the same properties with glass and mirrors as matt walls."""
        reflectivity = np.where(self.clear, DEFAULT.reflectivity, self.reflectivity)
        return replace(
            self,
            reflectivity=reflectivity,
            brightest=float(reflectivity.max()),
            clear=np.zeros_like(self.clear),
        )

    def remissions(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return the remissions: Lambert's cosine law, except for retroreflectors."""
        rho = self.reflectivity.take(geoms)
        if self.brightest <= _RETROREFLECTING:
            return rho * cosines
        return np.where(rho > _RETROREFLECTING, rho, rho * cosines)

    def mirrored(self, geoms: GeomArray, cosines: FloatArray) -> FloatArray:
        """Return the share of the light (N,) that clear geoms reflect: Fresnel's, for panes."""
        index = self.refractive_index.take(geoms)
        growth = np.where(index > 1.0, pane_reflectance(cosines, index), 1.0)
        return np.minimum(self.over_normal.take(geoms) * growth, 1.0)

    def transmitted(self, geoms: GeomArray, mirrored: FloatArray) -> FloatArray:
        """Return the share of the light that is transmitted: less where more is reflected."""
        return np.minimum(self.unmirrored.take(geoms) * (1.0 - mirrored), 1.0)


def optics_of(model: mujoco.MjModel, data: mujoco.MjData) -> SurfaceOptics:
    """Look up the materials of a model's geoms by the names of their MuJoCo materials.

    Args:
        model: Model of the world.
        data: Its state, from which the poses of geoms are read.
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
    """Return the reflectance of a clear pane for unpolarised light, with all internal reflections.

    Fresnel's equations give r of one face; with the reflections between two such faces the sum is
    2 r / (1 + r).

    Args:
        cosines: (N,) cosines of the angle of incidence, in [0, 1].
        index: (N,) refractive index; 1 reflects nothing.
    """
    square = index * index
    # Index times the cosine inside, by Snell's law: one root serves both polarisations.
    inner = np.sqrt(cosines * cosines + (square - 1.0))
    outer = square * cosines
    # At grazing incidence with index 1 both cosines vanish; this avoids 0 / 0.
    across = (cosines - inner) / np.maximum(cosines + inner, 1e-12)
    along = (outer - inner) / np.maximum(outer + inner, 1e-12)
    face = 0.5 * (across * across + along * along)
    return np.asarray(2.0 * face / (1.0 + face))
