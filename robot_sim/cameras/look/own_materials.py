"""Solids of a user's MJCF file as they are: shapes, materials, textures, lights and sky of the file itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import mujoco
import numpy as np

from robot_sim.array_types import FloatArray

_GEOM: Final = mujoco.mjtGeom
_DRAWN: Final = (
    _GEOM.mjGEOM_PLANE, _GEOM.mjGEOM_HFIELD, _GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_CAPSULE,
    _GEOM.mjGEOM_ELLIPSOID, _GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_BOX, _GEOM.mjGEOM_MESH,
)  # fmt: skip


class OwnMaterials:
    """Copies what is drawn from a compiled model to a specification, each mesh and texture once."""

    def __init__(self, spec: mujoco.MjSpec, world: mujoco.MjModel) -> None:
        """Copy from ``world`` to ``spec``."""
        self._spec, self._world = spec, world

    @property
    def lights(self) -> int:
        """Number of lights of the file."""
        return int(self._world.nlight)

    def add_sky(self) -> bool:
        """Copy the file's sky; return whether it has one."""
        kinds = self._world.tex_type
        skies = [
            i for i in range(self._world.ntex) if kinds[i] == mujoco.mjtTexture.mjTEXTURE_SKYBOX
        ]
        for sky in skies[:1]:
            self._texture(sky)
        return bool(skies)

    def add_lights(self, bodies: Mapping[int, mujoco.MjsBody]) -> None:
        """Copy the file's lights and headlight; lights on what moves move with it, and none casts shadows."""
        world = self._world
        if not world.nlight:
            return
        data = mujoco.MjData(world)
        mujoco.mj_kinematics(world, data)
        mujoco.mj_comPos(world, data)
        mujoco.mj_camlight(world, data)
        for key in ("ambient", "diffuse", "specular"):
            getattr(self._spec.visual.headlight, key)[:] = getattr(world.vis.headlight, key)
        for light in range(world.nlight):
            body = int(world.light_bodyid[light])
            on_it = body in bodies and body != 0
            bodies[body if on_it else 0].add_light(
                type=world.light_type[light],
                pos=world.light_pos[light] if on_it else data.light_xpos[light],
                dir=world.light_dir[light] if on_it else data.light_xdir[light],
                ambient=world.light_ambient[light],
                diffuse=world.light_diffuse[light],
                specular=world.light_specular[light],
                attenuation=world.light_attenuation[light],
                cutoff=world.light_cutoff[light],
                exponent=world.light_exponent[light],
                active=bool(world.light_active[light]),
                castshadow=False,
            )

    def add_geom(
        self, body: mujoco.MjsBody, geom: int, position: FloatArray, quaternion: FloatArray
    ) -> None:
        """Copy a geom to a body, at its pose there; shapes that MuJoCo does not draw are left out."""
        world = self._world
        kind = int(world.geom_type[geom])
        if kind not in _DRAWN:
            return
        material, data = int(world.geom_matid[geom]), int(world.geom_dataid[geom])
        copy = body.add_geom(
            type=kind,
            pos=position,
            quat=quaternion,
            size=world.geom_size[geom],
            rgba=world.geom_rgba[geom],
            contype=0,
            conaffinity=0,
            mass=0.0,
        )
        if material >= 0:
            copy.material = self._material(material)
        if kind == _GEOM.mjGEOM_MESH:
            copy.meshname = self._mesh(data)
        elif kind == _GEOM.mjGEOM_HFIELD:
            copy.hfieldname = self._hfield(data)

    def _material(self, index: int) -> str:
        name, world = f"own_{index}", self._world
        if self._spec.material(name) is None:
            material = self._spec.add_material(
                name=name,
                rgba=world.mat_rgba[index],
                emission=world.mat_emission[index],
                specular=world.mat_specular[index],
                shininess=world.mat_shininess[index],
                texrepeat=world.mat_texrepeat[index],
                texuniform=bool(world.mat_texuniform[index]),
                reflectance=0.0,
            )
            for role, texture in enumerate(world.mat_texid[index]):
                if texture >= 0:
                    material.textures[role] = self._texture(int(texture))
        return name

    def _texture(self, index: int) -> str:
        name, world = f"own_{index}", self._world
        if self._spec.texture(name) is None:
            width, height = int(world.tex_width[index]), int(world.tex_height[index])
            channels = int(world.tex_nchannel[index])
            start = int(world.tex_adr[index])
            data = world.tex_data[start : start + width * height * channels]
            added = self._spec.add_texture(
                name=name,
                type=world.tex_type[index],
                width=width,
                height=height,
                nchannel=channels,
            )
            added.data = np.asarray(data, dtype=np.uint8).tobytes()
        return name

    def _mesh(self, index: int) -> str:
        name, world = f"own_{index}", self._world
        if self._spec.mesh(name) is None:
            vertices = _part(world.mesh_vert, world.mesh_vertadr, world.mesh_vertnum, index)
            faces = slice(
                int(world.mesh_faceadr[index]),
                int(world.mesh_faceadr[index] + world.mesh_facenum[index]),
            )
            mesh = self._spec.add_mesh(
                name=name,
                uservert=vertices.ravel(),
                userface=world.mesh_face[faces].ravel(),
                usernormal=_part(
                    world.mesh_normal, world.mesh_normaladr, world.mesh_normalnum, index
                ).ravel(),
                userfacenormal=world.mesh_facenormal[faces].ravel(),
            )
            if world.mesh_texcoordadr[index] >= 0:
                mesh.usertexcoord = _part(
                    world.mesh_texcoord, world.mesh_texcoordadr, world.mesh_texcoordnum, index
                ).ravel()
                mesh.userfacetexcoord = world.mesh_facetexcoord[faces].ravel()
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        return name

    def _hfield(self, index: int) -> str:
        name, world = f"own_{index}", self._world
        if self._spec.hfield(name) is None:
            rows, columns = int(world.hfield_nrow[index]), int(world.hfield_ncol[index])
            start = int(world.hfield_adr[index])
            self._spec.add_hfield(
                name=name,
                nrow=rows,
                ncol=columns,
                size=world.hfield_size[index],
                userdata=world.hfield_data[start : start + rows * columns],
            )
        return name


def _part(values: FloatArray, starts: FloatArray, counts: FloatArray, index: int) -> FloatArray:
    part: FloatArray = values[int(starts[index]) : int(starts[index] + counts[index])]
    return part
