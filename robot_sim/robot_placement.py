"""Placement of the robot at a pose, and the obstacles that it touches there."""

from __future__ import annotations

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.arm.arm_touch import arm_parts, bodies_in_hand, pickable_bodies
from robot_sim.arm.body import fold_arm
from robot_sim.errors import WorldError
from robot_sim.robot.mujoco_body import FLOOR_BIT, OBSTACLE_BIT, ROBOT_GROUP


def place_robot(model: mujoco.MjModel, data: mujoco.MjData, map_from_base: Pose) -> None:
    """Place the robot at rest at ``map_from_base``.

    Raises:
        WorldError: it would stand inside an obstacle; the message names it.
    """
    mujoco.mj_resetData(model, data)
    fold_arm(model, data)
    # In a user's world other joints may come first.
    base = model.joint("base_link").qposadr[0]
    data.qpos[base : base + 3] = map_from_base.position
    data.qpos[base + 3 : base + 7] = map_from_base.quaternion_wxyz
    mujoco.mj_forward(model, data)
    refuse_contacts(model, data)


def carry_robot(model: mujoco.MjModel, data: mujoco.MjData, map_from_base: Pose) -> None:
    """Set the robot down at rest at ``map_from_base``; the rest of the world, its wheels and its arm stay as they are.

    What the arm has in its hand goes along.

    Raises:
        WorldError: it would stand inside an obstacle; the message names it, and the robot stays where it was.
    """
    before = data.qpos.copy(), data.qvel.copy()
    base = int(model.joint("base_link").id)
    moved = map_from_base @ _pose(model, data, base).inverse()
    for body in bodies_in_hand(model, data):
        joint = int(model.body_jntadr[body])
        _set_down(model, data, joint, moved @ _pose(model, data, joint))
    _set_down(model, data, base, map_from_base)
    mujoco.mj_forward(model, data)
    try:
        refuse_contacts(model, data)
    except WorldError:
        data.qpos[:], data.qvel[:] = before
        mujoco.mj_forward(model, data)
        raise


def _pose(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> Pose:
    """Return where a free joint has its body."""
    place = model.jnt_qposadr[joint]
    return Pose(data.qpos[place : place + 3], data.qpos[place + 3 : place + 7])


def _set_down(model: mujoco.MjModel, data: mujoco.MjData, joint: int, pose: Pose) -> None:
    """Put the body of a free joint somewhere, at rest."""
    place, rates = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
    data.qpos[place : place + 3] = pose.position
    data.qpos[place + 3 : place + 7] = pose.quaternion_wxyz
    data.qvel[rates : rates + 6] = 0.0


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
    """Return the sorted names of the obstacles that the robot's hull or arm touches now.

    People, carts and door leaves, which will be elsewhere in a moment, are left out unless ``movers`` is set; so is
    what an arm touches that can be picked up.
    """
    pairs = np.asarray(data.contact.geom).reshape(-1, 2)
    names: set[str] = set()
    is_arm, can_be_picked = arm_parts(model), pickable_bodies(model)
    for pair in pairs:
        is_floor = model.geom_contype[pair] == FLOOR_BIT
        is_robot = model.geom_group[pair] == ROBOT_GROUP
        if not is_robot.any():
            continue
        bodies = model.geom_bodyid[pair]
        if is_arm[bodies].any() and can_be_picked[bodies].any():
            continue
        is_mocap = model.body_mocapid[model.geom_bodyid[pair]] >= 0
        # Boxes and doors that come at their time collide as furniture does, and stay.
        is_mover = is_mocap & (model.geom_contype[pair] != OBSTACLE_BIT)
        counts = ~is_floor & ~is_robot & (movers | ~is_mover)
        names.update(model.geom(g).name for g in pair[counts])
    return tuple(sorted(names))


def robot_meets(model: mujoco.MjModel, data: mujoco.MjData, body: str) -> bool:
    """Return whether the robot touches a body of this name now."""
    bodies = model.geom_bodyid[np.asarray(data.contact.geom).reshape(-1, 2)]
    groups = model.geom_group[np.asarray(data.contact.geom).reshape(-1, 2)]
    with_it = (bodies == model.body(body).id).any(axis=1)
    return bool((with_it & (groups == ROBOT_GROUP).any(axis=1)).any())
