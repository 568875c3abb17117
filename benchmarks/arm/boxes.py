"""An arm on its vehicle among random boxes, and poses that are free there."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.obstacles import Box
from robot_sim.collision_bits import FLOOR_BIT
from robot_sim.robot.mujoco_body import add_robot

TABLE = load_arm()
LIMITS = np.array(TABLE.lower), np.array(TABLE.upper)


def on_a_floor(mount: str = "bracket") -> Clearance:
    """Return the clearance of an arm on a P3-AT that stands on a floor."""
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),
        contype=FLOOR_BIT,
        conaffinity=FLOOR_BIT,
    )
    add_robot(spec, ("floor",))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    clearance = Clearance(TABLE, mount)
    clearance.follow(model, data)
    return clearance


def boxes(chance: np.random.Generator, count: int = 12) -> list[Box]:
    """Return boxes of 4 to 12 cm in front of a bumper, in reach of the arm; its folded pose is free of them."""
    clearance, found = Clearance(TABLE), list[Box]()
    while len(found) < count:
        place = chance.uniform((0.36, -0.40, 0.03), (0.80, 0.40, 0.60))
        pose = Pose.from_euler(place, yaw=chance.uniform(-np.pi, np.pi))
        box = Box(f"box_{len(found)}", pose, tuple(chance.uniform(0.02, 0.06, 3)))
        clearance.surround([box])
        if clearance.distance(np.array(TABLE.poses["stow"])) > 0.01:
            found.append(box)
    return found


def free_poses(clearance: Clearance, chance: np.random.Generator) -> Iterator[FloatArray]:
    """Yield random poses (5,) that are 3 mm and more from everything."""
    while True:
        angles = chance.uniform(*LIMITS)
        if clearance.distance(angles, 0.003) >= 0.003:
            yield angles
