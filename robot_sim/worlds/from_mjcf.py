"""Build a world from a user's MJCF file: start pose, places and routes from its sites.

The sites are ``spawn``, ``place_<name>``, ``tour_0``, ``tour_1`` ... and ``survey_0`` ... Their x, y and
yaw are used; their height only selects the storey: the robot is placed on the ground below.
"""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.actors.extras import extra_bodies, spare_body, spares
from robot_sim.array_types import FloatArray
from robot_sim.errors import ArmError, WorldError
from robot_sim.floorplan.plan_ground import Heights, stand_on
from robot_sim.robot.drivable_surfaces import drivable_heights
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.scene_objects.plan_elements import Bounds, Placement, Waypoint
from robot_sim.worlds.mjcf_preparation import compile_mjcf
from robot_sim.worlds.world import (
    AS_MAPPED,
    TIMESTEP_NS,
    World,
    WorldOptions,
    check_places,
    level_ground,
)

SPAWN: Final = "spawn"
"""Name of the site or body where the robot starts."""
_ABOVE: Final = 0.5
"""Height above a site from which the ground is searched [m]; a site may lie a little too low."""
_SKY: Final = 1000.0
"""Height from which the ground is searched where no site selects a storey [m]."""


def load_mjcf(
    path: str | Path,
    *,
    spawn: Placement | None = None,
    robot: SkidSteer | None = None,
    options: WorldOptions = AS_MAPPED,
) -> World:
    """Build the world of a user's own MJCF.

    Args:
        path: Path of the file; meshes and heightfields are resolved relative to it by MuJoCo.
        spawn: Where the robot starts, instead of at the file's site or body named ``spawn``.
        robot: Robot that is compiled into the world; a P3-AT by default.
        options: Extras and spares; the other differences from the mapped world are those of floor plans.

    Returns:
        A world named after the file; ``World.notes`` lists settings of the file that were overridden.

    Raises:
        WorldError: the file cannot be read or compiled, nothing in it is drivable, it has no spawn, or
            the robot does not fit at a pose; the message names the file and the element.
    """
    path, robot = Path(path), robot or P3AT()
    try:
        parked = tuple(spares(options.spare_boxes, options.spare_people))
        # The ground on which they stand is not known yet.
        bodies = tuple(extra_bodies(options.extras, {}, level_ground))
        added = (*bodies, *map(spare_body, parked))
        arm = options.arm_table
        compiled = compile_mjcf(
            path,
            robot,
            timestep=TIMESTEP_NS * 1e-9,
            bodies=added,
            arm=arm,
            mount=options.arm_mount,
        )
        sites = _Sites(compiled.model, robot)
        if spawn is not None:
            start = sites.stand(SPAWN, spawn, _SKY)
        elif SPAWN in sites.poses:
            start = sites.stand_at(SPAWN)
        else:
            raise WorldError(
                "there is no spawn: add <site name=\"spawn\" pos=\"x y z\"/> where the robot is to"
                " start, or pass spawn"
            )  # fmt: skip
        named = (n for n in sites.poses if n.startswith("place_"))
        world = World(
            name=path.stem,
            model=compiled.model,
            spawn=start,
            places=MappingProxyType({n.removeprefix("place_"): sites.stand_at(n) for n in named}),
            tour=sites.line("tour_"),
            survey=sites.line("survey_") or sites.line("tour_"),
            bounds=_bounds(
                compiled.model, compiled.surfaces, start, {body.mover.name for body in added}
            ),
            spawns=MappingProxyType({SPAWN: start}),
            robot=robot,
            arm=arm,
            arm_mount=options.arm_mount,
            movers=tuple(body.mover for body in extra_bodies(options.extras, {}, sites.heights)),
            spares=parked,
            ground=sites.heights,
            notes=compiled.notes,
        )
        check_places(world)
    except (WorldError, ArmError) as error:
        raise WorldError(f"{path.name}: {error}") from None
    except UnicodeDecodeError as error:  # MuJoCo reads any bytes, and cannot say such a name
        raise WorldError(
            f"{path.name}: the name {error.object!r} is not UTF-8: save the file as UTF-8"
        ) from None
    return world


class _Sites:
    """The sites of a file, and the ground below them."""

    def __init__(self, model: mujoco.MjModel, robot: SkidSteer) -> None:
        self._model, self._robot = model, robot
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        self.poses: Mapping[str, tuple[FloatArray, FloatArray]] = {
            **{
                model.body(i).name: (data.xpos[i], data.xmat[i])
                for i in range(model.nbody)
                if model.body(i).name == SPAWN
            },
            **{
                model.site(i).name: (data.site_xpos[i], data.site_xmat[i])
                for i in range(model.nsite)
            },
        }
        """Position and rotation of each."""

    def stand_at(self, name: str) -> Pose:
        """Return ``map_from_base`` of the robot on the ground below a site."""
        (x, y, z), rotation = self.poses[name]
        yaw = math.atan2(rotation[3], rotation[0])
        return self.stand(name, Placement(float(x), float(y), yaw), float(z) + _ABOVE)

    def stand(self, name: str, placement: Placement, top: float) -> Pose:
        """Return ``map_from_base`` of the robot on the first ground below height ``top`` [m]."""
        robot = self._robot
        try:
            heights = drivable_heights(self._model, top)
            return stand_on(heights, placement, robot.wheelbase, robot.track)
        except WorldError as error:
            raise WorldError(f"{name!r} is not above anything drivable: {error}") from None

    @property
    def heights(self) -> Heights:
        """Height of the ground on the storey of the spawn."""
        top = float(self.poses[SPAWN][0][2]) + _ABOVE if SPAWN in self.poses else _SKY
        return drivable_heights(self._model, top)

    def line(self, prefix: str) -> tuple[Waypoint, ...]:
        """Return the way-points of the sites ``<prefix>0``, ``<prefix>1`` ..., in order."""
        numbered = sorted(
            (int(n.removeprefix(prefix)), n)
            for n in self.poses
            if n.startswith(prefix) and n.removeprefix(prefix).isdecimal()
        )
        points = (self.poses[n][0] for _, n in numbered)
        return tuple((float(p[0]), float(p[1])) for p in points)


def _bounds(
    model: mujoco.MjModel, surfaces: Sequence[str], spawn: Pose, added: Container[str]
) -> Bounds:
    """Return the rectangle around all drivable geoms; infinite planes are cut to the other geoms of the file."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    robot = model.body("base_link").id
    ids = [model.geom(s).id for s in surfaces]
    endless = [g for g in ids if _half(model, g) is None]
    if endless:
        ids = [
            g
            for g, body in enumerate(model.geom_bodyid)
            if model.body_rootid[body] != robot and model.body(body).name not in added
        ]
    low, high = spawn.position[:2] - 1.0, spawn.position[:2] + 1.0
    for g in ids:
        half = _half(model, g)
        if half is None:
            continue
        rotation = data.geom_xmat[g].reshape(3, 3)
        centre = data.geom_xpos[g] + rotation @ model.geom_aabb[g, :3]
        reach = (np.abs(rotation) @ half)[:2]
        low, high = np.minimum(low, centre[:2] - reach), np.maximum(high, centre[:2] + reach)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _half(model: mujoco.MjModel, geom: int) -> FloatArray | None:
    """Return half extents (3,) of a geom in its own frame [m]; None for an infinite plane."""
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE:
        half: FloatArray = model.geom_aabb[geom, 3:]
        return half
    x, y, _ = model.geom_size[geom]
    return None if x <= 0.0 or y <= 0.0 else np.array([x, y, 0.0])
