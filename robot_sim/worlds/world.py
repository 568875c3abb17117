"""A world: a compiled MuJoCo model with the robot in it, its start poses, places and routes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import mujoco
import numpy as np

from localization.types import Pose
from robot_sim.actors.extras import Extra, Spare
from robot_sim.actors.movers import Mover
from robot_sim.arm.arm_table import ArmTable, load_arm
from robot_sim.array_types import FloatArray
from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import Plan, Waypoint
from robot_sim.floorplan.plan_ground import Heights
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.robot_placement import place_robot
from robot_sim.scene_objects.floor_surfaces import Patch
from robot_sim.scene_objects.parcels import Parcel

TIMESTEP_NS: Final = 4_000_000
"""One physics step [ns]. The contact recipe holds up to 5 ms; chi, creep and kerbs are as at 1 ms."""


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """Options by which a world can differ from the one that was mapped."""

    alive: bool = False
    """Whether people walk about, doors swing and carts are pushed."""
    rearranged: int | None = None
    """Seed by which furniture is moved since the world was mapped; None leaves it in place."""
    timing: int = 0
    """Seed of the actors' timing, as far as the plan leaves it open."""
    extras: tuple[Extra, ...] = ()
    """Boxes, closed doors and people that come at their time, whether the world is alive or not."""
    spare_boxes: tuple[tuple[float, float, float], ...] = ()
    """Sizes of boxes [m] that a running simulation can put somewhere."""
    spare_people: int = 0
    """Number of people that it can put somewhere."""
    parcels: tuple[Parcel, ...] = ()
    """Small boxes that lie loose, beside those of the plan."""
    arm: str | None = None
    """Name of the arm that the robot carries, or path of its table; None for none."""
    arm_mount: str = "bracket"
    """Where it is mounted, a key of the table's ``mounts``."""

    def __post_init__(self) -> None:
        if self.spare_people < 0:
            raise WorldError(f"spare_people must be >= 0, got {self.spare_people}")
        for key in ("rearranged", "timing"):
            seed = getattr(self, key)
            if seed is not None and seed < 0:
                raise WorldError(f"{key} is a seed and must be >= 0, got {seed}")

    @property
    def arm_table(self) -> ArmTable | None:
        """The arm's table, if there is an arm.

        Raises:
            ArmError: There is no such arm, or its table is invalid.
        """
        return None if self.arm is None else load_arm(self.arm)


AS_MAPPED: Final = WorldOptions()
"""Nothing moves, and all furniture stands where it was when the world was mapped."""


def level_ground(points: FloatArray) -> FloatArray:
    """Return the heights (N,) [m] of points (N, 2) on a floor at zero."""
    return np.zeros(len(points))


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A place with the robot in it. Its model is shared by simulations and never modified."""

    name: str
    """Name of the scene or file."""
    model: mujoco.MjModel
    """The compiled MuJoCo model, with the robot."""
    spawn: Pose
    """``map_from_base`` at which the robot starts."""
    places: Mapping[str, Pose]
    """``map_from_base`` at each named place."""
    tour: tuple[Waypoint, ...]
    """Way-points [m] of a drive through most rooms that ends near where it began."""
    survey: tuple[Waypoint, ...]
    """Way-points [m] of a longer drive from which every corner is seen, for mapping."""
    bounds: tuple[float, float, float, float]
    """Smallest x, y and largest x, y of the floor [m]."""
    spawns: Mapping[str, Pose] = field(default_factory=lambda: MappingProxyType({}))
    """``map_from_base`` at each start pose, ``spawn`` among them."""
    robot: SkidSteer = field(default_factory=P3AT)
    """Parameters of the robot in the model."""
    plan: Plan | None = None
    """The floor plan that the world was built from; None for an MJCF file."""
    arm: ArmTable | None = None
    """The arm that the robot carries, if it does."""
    arm_mount: str = "bracket"
    """Where it is mounted."""
    patches: tuple[Patch, ...] = ()
    """Areas on which the ground has another friction than the surface they lie on."""
    movers: tuple[Mover, ...] = ()
    """Bodies that move on their own, or come at their time."""
    spares: tuple[Spare, ...] = ()
    """Bodies that are parked until a simulation puts them somewhere."""
    ground: Heights = field(default=level_ground, repr=False)
    """Height of the ground."""
    notes: tuple[str, ...] = ()
    """What differs from what was asked for, one line each: settings of a user's MJCF file that were overridden
    or ignored, and options for which the world has nothing to move."""

    @property
    def area(self) -> float:
        """Floor area within the bounds [m^2]."""
        x0, y0, x1, y1 = self.bounds
        return (x1 - x0) * (y1 - y0)


def check_places(world: World) -> None:
    """Raise a WorldError if the robot cannot stand at a spawn or a named place."""
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
