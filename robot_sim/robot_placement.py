"""Placement of the robot at a pose, and the obstacles that it touches there."""

from __future__ import annotations

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.errors import WorldError
from robot_sim.robot.mujoco_body import FLOOR_BIT, OBSTACLE_BIT, ROBOT_GROUP


def place_robot(model: mujoco.MjModel, data: mujoco.MjData, map_from_base: Pose) -> None:
    """Place the robot at rest at ``map_from_base``.

    Raises:
        WorldError: it would stand inside an obstacle; the message names it.
    """
    mujoco.mj_resetData(model, data)
    # In a user's world other joints may come first.
    base = model.joint("base_link").qposadr[0]
    data.qpos[base : base + 3] = map_from_base.position
    data.qpos[base + 3 : base + 7] = map_from_base.quaternion_wxyz
    mujoco.mj_forward(model, data)
    refuse_contacts(model, data)


def carry_robot(model: mujoco.MjModel, data: mujoco.MjData, map_from_base: Pose) -> None:
    """Set the robot down at rest at ``map_from_base``; the rest of the world, and its wheels, stay as they are.

    Raises:
        WorldError: it would stand inside an obstacle; the message names it, and the robot stays where it was.
    """
    joint = model.joint("base_link")
    place, rates = joint.qposadr[0], joint.dofadr[0]
    before = data.qpos[place : place + 7].copy(), data.qvel[rates : rates + 6].copy()
    data.qpos[place : place + 3] = map_from_base.position
    data.qpos[place + 3 : place + 7] = map_from_base.quaternion_wxyz
    data.qvel[rates : rates + 6] = 0.0
    mujoco.mj_forward(model, data)
    try:
        refuse_contacts(model, data)
    except WorldError:
        data.qpos[place : place + 7], data.qvel[rates : rates + 6] = before
        mujoco.mj_forward(model, data)
        raise


def refuse_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Raise a WorldError if the robot touches an obstacle now; the message names it.

    A person who passes is no reason to reject a pose: a moment later there is room.
    """
    touched = obstacles_touched(model, data, movers=False)
    if touched:
        base = model.joint("base_link").qposadr[0]
        x, y = data.qpos[base : base + 2]
        raise WorldError(
            f"the robot at x {x:.2f}, y {y:.2f} would stand inside {', '.join(touched)}"
        )


def obstacles_touched(
    model: mujoco.MjModel, data: mujoco.MjData, *, movers: bool = True
) -> tuple[str, ...]:
    """Return the sorted names of the obstacles that the robot's hull touches now.

    People, carts and door leaves, which will be elsewhere in a moment, are left out unless ``movers`` is set.
    """
    pairs = np.asarray(data.contact.geom).reshape(-1, 2)
    names: set[str] = set()
    for pair in pairs:
        is_floor = model.geom_contype[pair] == FLOOR_BIT
        is_robot = model.geom_group[pair] == ROBOT_GROUP
        if not is_robot.any():
            continue
        is_mocap = model.body_mocapid[model.geom_bodyid[pair]] >= 0
        # Boxes and doors that come at their time collide as furniture does, and stay.
        is_mover = is_mocap & (model.geom_contype[pair] != OBSTACLE_BIT)
        counts = ~is_floor & ~is_robot & (movers | ~is_mover)
        names.update(model.geom(g).name for g in pair[counts])
    return tuple(sorted(names))
