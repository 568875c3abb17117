"""Reader of floor plans in TOML, with metres and degrees; unknown keys are errors."""

from __future__ import annotations

import tomllib
from typing import Any

from robot_sim.errors import SimulationError, WorldError
from robot_sim.floorplan import toml_table as toml
from robot_sim.floorplan.actors_in_plan import Cart, DoorLeaf, Person
from robot_sim.floorplan.plan import CloudSpec, Plan
from robot_sim.floorplan.toml_elements import element
from robot_sim.scene_objects.floor_surfaces import Patch
from robot_sim.scene_objects.glazing import Glazing, Roof
from robot_sim.scene_objects.parcels import Parcel
from robot_sim.scene_objects.plan_elements import Piece, Wall
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.scene_objects.terrain import Terrain


def plan_from_toml(text: str, *, name: str) -> Plan:
    """Read the text of a floor plan.

    Args:
        text: TOML; see ``docs/worlds.md`` for its tables and keys.
        name: Name of the world, for the plan and for messages.

    Raises:
        WorldError: the text is not TOML, lacks an entry, has an unknown one, or a value is invalid;
            the message names the entry.
    """
    try:
        return _plan(toml.Table(tomllib.loads(text)), name)
    except tomllib.TOMLDecodeError as error:
        raise WorldError(f"world {name!r} is not valid TOML: {error}") from None
    except (SimulationError, ValueError) as error:
        raise WorldError(f"world {name!r}: {error}") from None


def _plan(table: toml.Table, name: str) -> Plan:
    def every(kind: type[Any], key: str, **usual: Any) -> tuple[Any, ...]:
        tables = enumerate(table.tables(key))
        return tuple(element(kind, each, name=f"{key}_{i}", **usual) for i, each in tables)

    bounds = table.take("bounds", toml.bounds)
    height = table.take("height", toml.number, 2.8)
    thickness = table.take("wall_thickness", toml.number, 0.14)
    tour = table.take("tour", toml.waypoints, ())
    plan = Plan(
        name=name,
        bounds=bounds,
        height=height,
        ceiling=table.take("ceiling", toml.flag, True),
        floor=table.take("floor", toml.text, "tile"),
        spawns={
            "spawn": table.take("spawn", toml.placement),
            **table.take("spawns", toml.placements, {}),
        },
        walls=every(Wall, "wall", height=height, thickness=thickness),
        glazings=every(Glazing, "glazing", height=height),
        roofs=every(Roof, "roof"),
        slabs=every(Slab, "slab"),
        terrains=every(Terrain, "terrain"),
        patches=every(Patch, "patch"),
        furniture=tuple(
            element(Piece, each, name=f"{each.take('type', toml.text)}_{i}")
            for i, each in enumerate(table.tables("furniture"))
        ),
        parcels=every(Parcel, "parcel"),
        places=table.take("places", toml.placements, {}),
        tour=tour,
        survey=table.take("survey", toml.waypoints, tour),
        cloud=element(CloudSpec, table.table("cloud")),
        actors=(*every(Person, "person"), *every(Cart, "cart"), *every(DoorLeaf, "leaf")),
    )
    table.close()
    return plan
