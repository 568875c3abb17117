"""Worlds: a scene's floor plan, read from TOML, as a compiled MuJoCo model with the robot in it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.blocks import Block, Door, furniture, wall
from robot_sim.errors import UnknownSceneError, WorldError
from robot_sim.p3at import FLOOR_BIT, P3AT, ROBOT_GROUP, add_robot, set_physics

TIMESTEP_NS: Final = 2_000_000
"""One physics step [ns]."""

Waypoint = tuple[float, float]
"""x, y in ``map`` [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A place with the robot in it. Its model is shared by simulations and never changed."""

    name: str
    model: mujoco.MjModel
    spawn: Pose
    """``map_from_base`` where the robot starts."""
    places: Mapping[str, Pose]
    """``map_from_base`` of each named place."""
    tour: tuple[Waypoint, ...]
    """A drive through most rooms, ending near where it began."""
    survey: tuple[Waypoint, ...]
    """A longer drive that sees every corner, for building a map."""
    bounds: tuple[float, float, float, float]
    """Smallest x, y and largest x, y of the floor [m]."""

    @property
    def area(self) -> float:
        """Floor area within the bounds [m^2]."""
        x0, y0, x1, y1 = self.bounds
        return (x1 - x0) * (y1 - y0)


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that come with the project, sorted."""
    folders = files("scenes").iterdir()
    return tuple(sorted(f.name for f in folders if (f / "world.toml").is_file()))


def load_world(name: str) -> World:
    """Build the world of ``scenes/<name>/world.toml``.

    Raises:
        UnknownSceneError: there is no such scene; the message lists those there are.
        WorldError: its floor plan cannot be built.
    """
    if name not in scene_names():
        raise UnknownSceneError(name, scene_names())
    text = (files("scenes") / name / "world.toml").read_text(encoding="utf-8")
    return parse_world(text, name=name)


def parse_world(text: str, *, name: str) -> World:
    """Build a world from the text of a floor plan; its lengths are metres, its angles degrees."""
    try:
        plan = tomllib.loads(text)
        return _build(plan, name)
    except tomllib.TOMLDecodeError as error:
        raise WorldError(f"world {name!r} is not valid TOML: {error}") from None
    except KeyError as error:
        raise WorldError(f"world {name!r} lacks the entry {error}") from None


def _build(plan: Mapping[str, Any], name: str) -> World:
    x0, y0, x1, y1 = (float(v) for v in plan["bounds"])
    spec = mujoco.MjSpec()
    set_physics(spec, timestep=TIMESTEP_NS * 1e-9)
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0),
        size=(0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.1),
        contype=FLOOR_BIT,
        conaffinity=FLOOR_BIT,
    )
    try:
        for block in _blocks(plan, (x0, y0, x1, y1)):
            block.add_to(spec)
        add_robot(spec, surfaces=("floor",), robot=P3AT())
        model = spec.compile()
    except ValueError as error:
        raise WorldError(f"world {name!r}: {' '.join(str(error).split())}") from None
    world = World(
        name=name,
        model=model,
        spawn=_pose(plan["spawn"]),
        places=MappingProxyType({k: _pose(v) for k, v in plan.get("places", {}).items()}),
        tour=_waypoints(plan.get("tour", ())),
        survey=_waypoints(plan.get("survey", plan.get("tour", ()))),
        bounds=(x0, y0, x1, y1),
    )
    data = mujoco.MjData(model)
    place_robot(model, data, world.spawn)
    return world


def _blocks(plan: Mapping[str, Any], bounds: tuple[float, float, float, float]) -> Iterator[Block]:
    height = float(plan.get("height", 2.8))
    thickness = float(plan.get("wall_thickness", 0.14))
    for i, entry in enumerate(plan.get("wall", ())):
        yield from wall(
            entry.get("name", f"wall_{i}"),
            entry["from"],
            entry["to"],
            height=entry.get("height", height),
            thickness=entry.get("thickness", thickness),
            doors=[Door(**door) for door in entry.get("doors", ())],
        )
    for i, entry in enumerate(plan.get("furniture", ())):
        kind = entry["type"]
        yield from furniture(
            entry.get("name", f"{kind}_{i}"),
            kind,
            entry["at"],
            yaw=math.radians(entry.get("yaw", 0.0)),
            size=entry.get("size"),
        )
    if plan.get("ceiling", True):
        x0, y0, x1, y1 = bounds
        half = (0.5 * (x1 - x0), 0.5 * (y1 - y0), 0.05)
        yield Block("ceiling", 0.5 * (x0 + x1), 0.5 * (y0 + y1), height + 0.05, half)


def _pose(entry: Sequence[float]) -> Pose:
    x, y, yaw = entry
    return Pose.planar(float(x), float(y), math.radians(yaw))


def _waypoints(entries: Sequence[Sequence[float]]) -> tuple[Waypoint, ...]:
    return tuple((float(x), float(y)) for x, y in entries)


def place_robot(model: mujoco.MjModel, data: mujoco.MjData, map_from_base: Pose) -> None:
    """Put the robot at rest where ``map_from_base`` says.

    Raises:
        WorldError: it would stand inside an obstacle; the message names that.
    """
    mujoco.mj_resetData(model, data)
    data.qpos[:3] = map_from_base.position
    data.qpos[3:7] = map_from_base.quaternion_wxyz
    mujoco.mj_forward(model, data)
    touched = obstacles_touched(model, data)
    if touched:
        x, y = map_from_base.position[:2]
        raise WorldError(
            f"the robot at x {x:.2f}, y {y:.2f} would stand inside {', '.join(touched)}"
        )


def obstacles_touched(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[str, ...]:
    """Return the names of the obstacles that the robot's hull touches now, sorted."""
    pairs = np.asarray(data.contact.geom).reshape(-1, 2)
    names: set[str] = set()
    for pair in pairs:
        is_floor = model.geom_contype[pair] == FLOOR_BIT
        is_robot = model.geom_group[pair] == ROBOT_GROUP
        names.update(model.geom(g).name for g in pair[~is_floor & ~is_robot])
    return tuple(sorted(names))
