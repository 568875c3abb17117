"""A world: a compiled MuJoCo model with the robot in it, its start poses, places and routes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import mujoco

from localization.types import Pose
from robot_sim.actors.movers import Mover
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Plan, Waypoint
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.robot_placement import place_robot
from robot_sim.scene_objects.floor_surfaces import Patch

TIMESTEP_NS: Final = 4_000_000
"""One physics step [ns]. The contact recipe holds up to 5 ms; chi, creep and kerbs are as at 1 ms."""


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """What can be different about a world from one day to the next."""

    alive: bool = False
    """Whether people walk about, doors swing and carts are pushed."""
    rearranged: int | None = None
    """Seed by which furniture was moved since the world was mapped; None leaves it in its place."""
    timing: int = 0
    """Seed of when those who live there are where, as far as the plan leaves it open."""

    def __post_init__(self) -> None:
        for key in ("rearranged", "timing"):
            seed = getattr(self, key)
            if seed is not None and seed < 0:
                raise WorldError(f"{key} is a seed and must be >= 0, got {seed}")


AS_MAPPED: Final = WorldOptions()
"""Nothing moves, and all furniture stands where it was when the world was mapped."""


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
    spawns: Mapping[str, Pose] = field(default_factory=lambda: MappingProxyType({}))
    """``map_from_base`` of each start pose, ``spawn`` among them."""
    robot: SkidSteer = field(default_factory=P3AT)
    """Compiled into the model."""
    plan: Plan | None = None
    """What it was built from; None for a world that was not built from a plan."""
    patches: tuple[Patch, ...] = ()
    """Where the ground grips otherwise than what it belongs to."""
    movers: tuple[Mover, ...] = ()
    """What moves on its own; none unless the world is alive."""
    notes: tuple[str, ...] = ()
    """What in a user's file is not done as it says, one line each."""

    @property
    def area(self) -> float:
        """Floor area within the bounds [m^2]."""
        x0, y0, x1, y1 = self.bounds
        return (x1 - x0) * (y1 - y0)


def check_places(world: World) -> None:
    """Raise a WorldError if the robot cannot stand at one of the named poses."""
    data = mujoco.MjData(world.model)
    x0, y0, x1, y1 = world.bounds
    for kind, poses in (("spawn", world.spawns), ("place", world.places)):
        for name, pose in poses.items():
            x, y = pose.position[:2]
            if not (x0 <= x <= x1 and y0 <= y <= y1):
                raise WorldError(
                    f"{kind} {name!r} at x {x:.2f}, y {y:.2f} is off the floor, which reaches from"
                    f" {x0:g}, {y0:g} to {x1:g}, {y1:g}"
                )
            try:
                place_robot(world.model, data, pose)
            except WorldError as error:
                raise WorldError(f"{kind} {name!r}: {error}") from None
