"""A robot without an arm is what it was before there were arms: its model by name, its drive by recorded numbers.

The numbers were recorded at commit 0c8b5ec. They hold to 1e-9 and not to the bit, because the last bits of sines differ
between machines; another solver, mass or order of bodies shows from the sixth digit on.
"""

from __future__ import annotations

import hashlib

import mujoco
import numpy as np

from localization.types import Scan, Twist
from robot_sim.simulation import Simulation
from robot_sim.worlds.world import World

NAMES = "0c9b2cdd9720589d"
QPOS = [
    *(4.136016670461206, 3.039589211230506, 0.00016353719976394473),
    *(0.9810554986946421, 9.023326897444274e-05, -0.0002846633945883403, 0.1937266613187637),
    *(0.26625206693045783, 2.195659654735314, 0.268975334605091, 2.1925543469960034),
]
QVEL = [
    *(0.3446702326717193, 0.1471656003532616, -2.2828619654665684e-06),
    *(0.0005185158363048443, 0.0001834394137019978, 0.606522933161879),
    *(1.7513998769598298, 4.886393310324471, 1.7492289842935596, 4.888913182380075),
]
RANGES = [
    *(3.389798402786255, 3.2573599815368652, 6.38548469543457, 6.153879642486572),
    *(5.383930206298828, 5.270150184631348, 4.634053707122803),
]


def test_a_model_without_an_arm_has_the_parts_it_had(room: World) -> None:
    model = room.model
    assert hashlib.sha256(bytes(model.names)).hexdigest()[:16] == NAMES
    counts = (model.nbody, model.njnt, model.ngeom, model.nu, model.nsensor)
    assert counts == (6, 5, 21, 4, 10)
    assert (model.neq, model.ntendon, model.nnumeric) == (0, 0, 0)
    assert model.opt.solver == mujoco.mjtSolver.mjSOL_CG


def test_a_drive_without_an_arm_has_the_numbers_it_had(room: World) -> None:
    simulation = Simulation(room, seed=4)
    simulation.command(Twist.planar(0.4, 0.6))
    readings = [reading for _ in range(40) for reading in simulation.step()]
    scans = [r for r in readings if isinstance(r, Scan) and r.scanner == "laser_horizontal"]
    assert simulation.arm is None
    np.testing.assert_allclose(simulation._data.qpos, QPOS, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(simulation._data.qvel, QVEL, rtol=0.0, atol=1e-9)
    assert scans[-1].stamp == 700_000_000
    np.testing.assert_allclose(scans[-1].ranges[::90], RANGES, rtol=0.0, atol=1e-6)
