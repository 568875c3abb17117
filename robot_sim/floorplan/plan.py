"""Plans: what a world is made of, as values between the text of a floor plan and a MuJoCo model.

A plan can be read from TOML (``plan_file``), made by a program, or rearranged by a pure function from
plan to plan; ``worlds.build_world`` turns it into a model. Lengths are metres, angles radians,
everything is in ``map``: x and y along the floor, z up, z = 0 the floor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.floorplan.actors_in_plan import Actor
from robot_sim.number_checks import check_finite, check_positive
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from robot_sim.scene_objects.glazing import Glazing, Roof
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
"""As a plan's floor: only what else is drivable carries the robot."""


@dataclass(frozen=True, slots=True)
class CloudSpec:
    """How fine and how high the world's cloud is to be, so that a large one stays a file one can send."""

    spacing: float = 0.08
    """Between its points [m]."""
    highest: float | None = None
    """Nothing above this is kept [m]; None keeps everything."""

    def __post_init__(self) -> None:
        check_positive("the cloud", spacing=self.spacing)
        if self.highest is not None:
            check_positive("the cloud", highest=self.highest)


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything there is to say about a world, but for the robot in it."""

    name: str
    bounds: Bounds
    """Of the floor [m]."""
    spawns: Mapping[str, Placement]
    """Where the robot may start; the first is where it does unless told otherwise."""
    height: float = 2.8
    """Of the walls and the ceiling [m]."""
    ceiling: bool = True
    floor: str = "tile"
    """Surface of the plane z = 0 within the bounds; ``NO_FLOOR`` for none."""
    walls: tuple[Wall, ...] = ()
    glazings: tuple[Glazing, ...] = ()
    roofs: tuple[Roof, ...] = ()
    slabs: tuple[Slab, ...] = ()
    terrains: tuple[Terrain, ...] = ()
    patches: tuple[Patch, ...] = ()
    furniture: tuple[Piece, ...] = ()
    places: Mapping[str, Placement] = field(default_factory=lambda: MappingProxyType({}))
    tour: tuple[Waypoint, ...] = ()
    """A drive through most of the world, ending near where it began."""
    survey: tuple[Waypoint, ...] = ()
    """A longer drive that sees every corner, for building a map."""
    cloud: CloudSpec = field(default_factory=CloudSpec)
    actors: tuple[Actor, ...] = ()
    """Who and what moves when the world is alive."""

    def __post_init__(self) -> None:
        x0, y0, x1, y1 = self.bounds
        check_finite("bounds", x0=x0, y0=y0, x1=x1, y1=y1)
        if not (x1 > x0 and y1 > y0):
            raise WorldError(
                f"bounds must be [x0, y0, x1, y1] with x1 > x0 and y1 > y0, got {list(self.bounds)}"
            )
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
        """Where the robot starts unless told otherwise."""
        return next(iter(self.spawns.values()))
