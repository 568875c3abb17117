"""The bound of how far the points of an arm move."""

from __future__ import annotations

import mujoco
import numpy as np

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.clearance_model import ClearanceModel
from robot_sim.arm.levers import levers
from robot_sim.array_types import FloatArray


def test_no_point_of_the_arm_moves_further_than_the_levers_arcs() -> None:
    table = load_arm()
    small = ClearanceModel(table, "bracket", slots=1)
    small.jaws[:] = 0.5 * table.gripper.opening
    model, data = small.model, small.data
    chance = np.random.default_rng(0)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])

    def points() -> FloatArray:
        mujoco.mj_kinematics(model, data)
        own = np.flatnonzero((model.geom_contype | model.geom_conaffinity) != 0)
        local = model.geom_aabb[own, None, :3] + corners * model.geom_aabb[own, None, 3:]
        turned = np.einsum("gij,gcj->gci", data.geom_xmat[own].reshape(-1, 3, 3), local)
        found: FloatArray = (data.geom_xpos[own, None] + turned).reshape(-1, 3)
        return found

    tightest = np.inf
    for _ in range(300):
        small.angles[:] = chance.uniform(table.lower, table.upper)
        before = points()
        turn = chance.normal(scale=0.3, size=5) * chance.integers(0, 2, 5)
        small.angles[:] += turn
        moved = float(np.linalg.norm(points() - before, axis=1).max())
        bound = float(levers(table) @ np.abs(turn))
        assert moved <= bound + 1e-12
        if moved > 1e-3:
            tightest = min(tightest, bound / moved)
    assert tightest < 1.1


def test_what_is_held_makes_them_longer() -> None:
    table = load_arm()
    longer = levers(table, beyond=0.3)
    assert longer[4] == 0.3
    assert (longer > levers(table)).all()
