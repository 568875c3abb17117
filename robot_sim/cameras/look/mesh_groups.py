"""Solids of one look that stand near each other, drawn as one mesh: fewer things to draw, and to leave out of view."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Final, TypeAlias

import mujoco
import numpy as np

from robot_sim.cameras.look.surface_looks import LOOKS, Look, texture
from robot_sim.cameras.look.textured_shapes import TexturedMesh, joined
from robot_sim.cameras.look.world_looks import BARE

_CELL: Final = 6.0
"""Side of the squares within which static solids become one mesh [m]."""

FILMS: Final = 5
"""Geom group of films on the ground, which are drawn near the camera only."""

Colour: TypeAlias = tuple[float, ...]
"""Red, green, blue and opacity of a plain colour; opacity alone for a film of a look; empty for the look as it is."""
_Key: TypeAlias = tuple[int, str, Colour, int, int]
"""Body, look, colour and cell."""


class MeshGroups:
    """Collects meshes by body, look and place, and adds each group to a specification."""

    def __init__(self) -> None:
        """Begin with none."""
        self._groups: dict[_Key, list[TexturedMesh]] = defaultdict(list)

    def add(self, body: int, look: str, mesh: TexturedMesh, colour: Colour = ()) -> None:
        """Add a mesh of a body (0 for what does not move) in the frame of that body."""
        cell_x = cell_y = 0
        if body == 0:
            middle = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
            cell_x, cell_y = np.floor(middle[:2] / _CELL).astype(int).tolist()
        self._groups[body, look, colour, cell_x, cell_y].append(mesh)

    def write(self, spec: mujoco.MjSpec, bodies: Mapping[int, mujoco.MjsBody]) -> None:
        """Add the groups, their materials and textures to a specification, always in the same order."""
        for number, (key, meshes) in enumerate(sorted(self._groups.items(), key=lambda e: e[0])):
            body, look, colour, _, _ = key
            material = _material(spec, look, colour)
            film = bool(colour) and colour[-1] < 1.0
            group = FILMS if film else 0
            _add_mesh(spec, bodies[body], f"mesh_{number}", material, joined(meshes), group)


def _material(spec: mujoco.MjSpec, name: str, rgba: Colour) -> str:
    """Return the name of a look's material, which is added if it is not there."""
    label = "_".join([name, *(f"{v:.3f}" for v in rgba)])
    if spec.material(label) is not None:
        return label
    look = LOOKS[name] if name != BARE else Look("")
    alpha = look.alpha if not rgba else rgba[-1]
    material = spec.add_material(
        name=label,
        rgba=(1.0, 1.0, 1.0, alpha) if name != BARE else rgba,
        specular=look.specular,
        shininess=look.shininess,
        emission=look.emission,
        reflectance=0.0,
    )
    if look.texture:
        if spec.texture(look.texture) is None:
            image = texture(look.texture)
            added = spec.add_texture(
                name=look.texture,
                type=mujoco.mjtTexture.mjTEXTURE_2D,
                width=image.shape[1],
                height=image.shape[0],
                nchannel=3,
            )
            added.data = image.tobytes()
        material.textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = look.texture
    return label


def _add_mesh(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    name: str,
    material: str,
    mesh: TexturedMesh,
    group: int,
) -> None:
    faces = mesh.faces.astype(np.int32).ravel()
    added = spec.add_mesh(
        name=name,
        uservert=mesh.vertices.astype(np.float32).ravel(),
        usernormal=mesh.normals.astype(np.float32).ravel(),
        usertexcoord=mesh.texcoords.astype(np.float32).ravel(),
        userface=faces,
        userfacenormal=faces,
        userfacetexcoord=faces,
    )
    # Open surfaces have no volume.
    added.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=material,
        contype=0,
        conaffinity=0,
        mass=0.0,
        group=group,
    )
