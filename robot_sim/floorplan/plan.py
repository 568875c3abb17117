"""Floor plan of a world as a value, between its TOML text and a MuJoCo model.

A plan is read from TOML (``toml_reader``), created by a program, or rearranged by a pure function from
plan to plan; ``from_floorplan.build_world`` builds a model of it. Lengths are in metres, angles in
radians, and everything is in ``map``: x and y along the floor, z up, z = 0 the floor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.floorplan.actors_in_plan import Actor
from robot_sim.number_checks import check_bounds, check_positive
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from robot_sim.scene_objects.glazing import Glazing, Roof
from robot_sim.scene_objects.parcels import Parcel
from robot_sim.scene_objects.plan_elements import (
    Bounds as Bounds,
    Door as Door,
    Piece as Piece,
    Placement as Placement,
    Wall as Wall,
    Waypoint as Waypoint,
    Window as Window,
)
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.scene_objects.terrain import Terrain

NO_FLOOR: Final = "none"
"""Value of a plan's floor for none: the robot then drives on slabs and terrains only."""


@dataclass(frozen=True, slots=True)
class CloudSpec:
    """Resolution and height of the world's point cloud, which limit the size of its file."""

    spacing: float = 0.08
    """Distance between points [m]."""
    highest: float | None = None
    """Height above which no points are kept [m]; None keeps all."""

    def __post_init__(self) -> None:
        check_positive("the cloud", spacing=self.spacing)
        if self.highest is not None:
            check_positive("the cloud", highest=self.highest)


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything about a world except the robot in it."""

    name: str
    """Name of the world."""
    bounds: Bounds
    """Smallest x, y and largest x, y of the floor [m]."""
    spawns: Mapping[str, Placement]
    """Start poses of the robot by name; the first is the default."""
    height: float = 2.8
    """Height of the walls and the ceiling [m]."""
    ceiling: bool = True
    """Whether there is a ceiling."""
    floor: str = "tile"
    """Surface of the plane z = 0 within the bounds; ``NO_FLOOR`` for none."""
    walls: tuple[Wall, ...] = ()
    """Walls with their doors and windows."""
    glazings: tuple[Glazing, ...] = ()
    """Glass walls."""
    roofs: tuple[Roof, ...] = ()
    """Gabled roofs."""
    slabs: tuple[Slab, ...] = ()
    """Drivable ramps, steps and platforms."""
    terrains: tuple[Terrain, ...] = ()
    """Heightfields."""
    patches: tuple[Patch, ...] = ()
    """Areas of another friction."""
    furniture: tuple[Piece, ...] = ()
    """Furniture and other objects."""
    places: Mapping[str, Placement] = field(default_factory=lambda: MappingProxyType({}))
    """Named poses at which the robot fits."""
    tour: tuple[Waypoint, ...] = ()
    """Way-points [m] of a drive through most of the world that ends near where it began."""
    survey: tuple[Waypoint, ...] = ()
    """Way-points [m] of a longer drive from which every corner is seen, for mapping."""
    cloud: CloudSpec = field(default_factory=CloudSpec)
    """Resolution and height of the world's point cloud."""
    parcels: tuple[Parcel, ...] = ()
    """Small boxes that lie loose, and are in no map."""
    actors: tuple[Actor, ...] = ()
    """People, carts and door leaves that move when the world is alive."""

    def __post_init__(self) -> None:
        check_bounds("the plan", self.bounds)
        check_positive("the plan", height=self.height)
        if not self.spawns:
            raise WorldError("there must be at least one spawn")
        used = [self.floor, *(s.surface for s in self.slabs), *(t.surface for t in self.terrains)]
        for surface in used:
            if surface != NO_FLOOR:
                surface_named(surface)
        for name in ("spawns", "places"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def spawn(self) -> Placement:
        """Default start pose of the robot."""
        return next(iter(self.spawns.values()))
