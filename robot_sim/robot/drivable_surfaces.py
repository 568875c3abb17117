"""Drivable surfaces: geoms whose ``user`` attribute begins with a friction coefficient.

That attribute, ``user="MU_LONG MU_LAT ROLLING"``, is all that a world declares of a surface, be it built
from a plan or read from a user's MJCF file: the wheels get contact pairs with it. The last two are
optional: friction is then the same in both directions, and there is no rolling resistance.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from robot_sim.array_types import FloatArray
from robot_sim.robot.mujoco_body import FLOOR_BIT


@dataclass(frozen=True, slots=True)
class DrivableGeom:
    """A geom that wheels roll on."""

    name: str
    """Name of the geom."""
    mu_long: float
    """Coulomb friction coefficient along the wheel."""
    mu_lat: float
    """Coulomb friction coefficient across the wheel."""


def mark_drivable(
    geom: mujoco.MjsGeom, mu_long: float, mu_lat: float, rolling_resistance: float = 0.0
) -> None:
    """Make a geom drivable: the wheels' contact pairs touch it, the robot's hull does not.

    ``rolling_resistance`` is the force that opposes rolling over the wheel's load.
    """
    geom.userdata = [mu_long, mu_lat, rolling_resistance]
    geom.contype = FLOOR_BIT
    geom.conaffinity = FLOOR_BIT


def drivable_geoms(spec: mujoco.MjSpec) -> Iterator[DrivableGeom]:
    """Yield every geom of the specification that is declared drivable."""
    for geom in spec.geoms:
        user = list(geom.userdata)
        if user and user[0] > 0.0:
            yield DrivableGeom(geom.name, user[0], user[1] if len(user) > 1 else user[0])


def drivable_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return the names of a compiled model's drivable geoms."""
    if not model.nuser_geom:
        return ()
    return tuple(model.geom(i).name for i in range(model.ngeom) if model.geom_user[i, 0] > 0.0)


def drivable_heights(model: mujoco.MjModel, top: float) -> Callable[[FloatArray], FloatArray]:
    """Return a function from points (N, 2) [m] to the height (N,) of the first drivable geom below ``top`` [m].

    Geoms are where they are at time zero; the height is -inf where there is none.
    """
    # A copy, whose groups separate drivable geoms from others.
    model = copy.copy(model)
    model.geom_group[:] = 1
    model.geom_group[[model.geom(name).id for name in drivable_names(model)]] = 0
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    groups, geom = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8), np.zeros(1, dtype=np.int32)
    down = np.array([0.0, 0.0, -1.0])

    def heights(points: FloatArray) -> FloatArray:
        eyes = [np.array([x, y, top]) for x, y in points]
        falls = np.array(
            [mujoco.mj_ray(model, data, eye, down, groups, True, -1, geom) for eye in eyes]
        )
        ground: FloatArray = np.where(falls < 0.0, -np.inf, top - falls)
        return ground

    return heights
