"""Digest of a model's surroundings, by which worlds that differ only in what comes later share costly preparations."""

from __future__ import annotations

import hashlib

import mujoco
import numpy as np


def static_digest(model: mujoco.MjModel) -> bytes:
    """Return a digest of all geoms but the robot's and those of mocap bodies: place, shape, looks, collisions."""
    robot = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "base_link")
    here = (model.body_mocapid < 0) & (model.body_rootid != robot)
    geoms = np.flatnonzero(here[model.geom_bodyid])
    bodies = np.flatnonzero(here)
    alpha = model.geom_rgba[geoms, 3].copy()
    painted = model.geom_matid[geoms] >= 0
    if model.nmat:
        alpha[painted] = model.mat_rgba[model.geom_matid[geoms][painted], 3]
    digest = hashlib.sha256()
    for values in (
        geoms,
        model.geom_bodyid[geoms],
        *(
            getattr(model, f"geom_{field}")[geoms]
            for field in ("type", "size", "pos", "quat", "dataid", "group", "user")
        ),
        *(getattr(model, f"geom_{bits}")[geoms] for bits in ("contype", "conaffinity")),
        alpha,
        *(
            getattr(model, f"body_{field}")[bodies]
            for field in ("pos", "quat", "parentid", "weldid")
        ),
        model.qpos0,
        *(model.mesh_vert, model.mesh_face, model.mesh_vertadr, model.mesh_faceadr),
        *(model.hfield_data, model.hfield_size, model.hfield_nrow, model.hfield_ncol),
    ):
        array = np.ascontiguousarray(values)
        digest.update(f"{array.shape}{array.dtype}".encode())
        digest.update(array.tobytes())
    return digest.digest()
