"""What the surfaces of a world do with light, geom by geom."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from robot_sim.arrays import BoolArray, FloatArray
from robot_sim.casting.caster import GeomArray
from robot_sim.materials import DEFAULT, material_named


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
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
        axes = self.data.geom_xmat[geoms].reshape(-1, 3, 3)
        local = np.einsum("nji,nj->ni", axes, points - self.data.geom_xpos[geoms])
        face = np.abs(self.half[geoms] - np.abs(local)).argmin(axis=1)
        face[self.is_plane[geoms]] = 2
        return np.asarray(np.take_along_axis(axes, face[:, None, None], axis=2)[:, :, 0])

    def depths(self, geoms: GeomArray, points: FloatArray, directions: FloatArray) -> FloatArray:
        """Return how far rays go inside boxes (N,) [m] from where they enter; 0 in other shapes."""
        axes = self.data.geom_xmat[geoms].reshape(-1, 3, 3)
        local = np.einsum("nji,nj->ni", axes, points - self.data.geom_xpos[geoms])
        along = np.einsum("nji,nj->ni", axes, directions)
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        leave = ((np.copysign(self.half[geoms], along) - local) / along).min(axis=1)
        return np.where(self.is_box[geoms], np.maximum(leave, 0.0), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Optics:
    """What each geom does with light; arrays (G + 1,), the last for no geom at all."""

    reflectivity: FloatArray
    transmittance: FloatArray
    specular: FloatArray
    refractive_index: FloatArray
    at_normal: FloatArray
    """What a pane of that index mirrors at normal incidence; 1 for opaque mirrors."""
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
        """Return the share of the light (N,) that clear geoms mirror: Fresnel's, for panes."""
        index = self.refractive_index[geoms]
        growth = (
            np.where(index > 1.0, pane_reflectance(cosines, index), 1.0) / self.at_normal[geoms]
        )
        flat = self.faces.is_box[geoms] | self.faces.is_plane[geoms]
        return np.where(flat, np.minimum(self.specular[geoms] * growth, 1.0), 0.0)

    def transmitted(self, geoms: GeomArray, mirrored: FloatArray) -> FloatArray:
        """Return the share of the light that passes: what is mirrored more passes less."""
        passing = self.transmittance[geoms] / np.maximum(1.0 - self.specular[geoms], 1e-9)
        return np.minimum(passing * (1.0 - mirrored), 1.0)


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
    index = np.array([m.refractive_index for m in materials])
    kind = model.geom_type
    return Optics(
        reflectivity,
        np.array([m.transmittance for m in materials]),
        np.array([m.specular for m in materials]),
        index,
        np.where(index > 1.0, pane_reflectance(np.ones(len(index)), index), 1.0),
        np.array([m.clear for m in materials]),
        Faces(
            np.append(kind == mujoco.mjtGeom.mjGEOM_BOX, False),
            np.append(kind == mujoco.mjtGeom.mjGEOM_PLANE, False),
            np.vstack([model.geom_size, np.zeros(3)]),
            data,
        ),
    )


def pane_reflectance(cosines: FloatArray, index: FloatArray) -> FloatArray:
    """Return what a clear pane mirrors of unpolarised light, both faces and all their echoes counted.

    Fresnel's equations give r of one face; light that goes to and fro between two such faces adds
    up to 2 r / (1 + r).

    Args:
        cosines: (N,) of the angle of incidence, in [0, 1].
        index: (N,) refractive index; 1 mirrors nothing.
    """
    inner = np.sqrt(1.0 - (1.0 - cosines * cosines) / (index * index))
    # At grazing incidence on nothing (index 1) both cosines vanish together; mind 0 / 0.
    across = (cosines - index * inner) / np.maximum(cosines + index * inner, 1e-12)
    along = (index * cosines - inner) / np.maximum(index * cosines + inner, 1e-12)
    face = 0.5 * (across * across + along * along)
    return np.asarray(2.0 * face / (1.0 + face))
