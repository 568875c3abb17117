"""Reader of floor plans in TOML, with metres and degrees; unknown keys are errors."""

from __future__ import annotations

import tomllib
from typing import Any

from robot_sim.errors import SimulationError, WorldError
from robot_sim.floorplan import toml_element_readers as read, toml_table as toml
from robot_sim.floorplan.actors_in_plan import Cart, DoorLeaf, Person
from robot_sim.floorplan.plan import Plan


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
        walls=tuple(read.wall(t, i, height, thickness) for i, t in enumerate(table.tables("wall"))),
        glazings=tuple(read.glazing(t, i, height) for i, t in enumerate(table.tables("glazing"))),
        roofs=tuple(read.roof(t, i) for i, t in enumerate(table.tables("roof"))),
        slabs=tuple(read.slab(t, i) for i, t in enumerate(table.tables("slab"))),
        terrains=tuple(read.terrain(t, i) for i, t in enumerate(table.tables("terrain"))),
        patches=tuple(read.patch(t) for t in table.tables("patch")),
        furniture=tuple(read.piece(t, i) for i, t in enumerate(table.tables("furniture"))),
        parcels=tuple(read.parcel(t, i) for i, t in enumerate(table.tables("parcel"))),
        places=table.take("places", toml.placements, {}),
        tour=tour,
        survey=table.take("survey", toml.waypoints, tour),
        cloud=read.cloud(table.table("cloud")),
        actors=(
            *(_person(t, i) for i, t in enumerate(table.tables("person"))),
            *(_cart(t, i) for i, t in enumerate(table.tables("cart"))),
            *(_leaf(t, i) for i, t in enumerate(table.tables("leaf"))),
        ),
    )
    table.close()
    return plan


def _person(table: toml.Table, index: int) -> Person:
    person = Person(name=table.take("name", toml.text, f"person_{index}"), **_walk(table))
    table.close()
    return person


def _cart(table: toml.Table, index: int) -> Cart:
    name = table.take("name", toml.text, f"cart_{index}")
    size = table.take("size", toml.size, None)
    own: dict[str, Any] = {} if size is None else {"size": size}
    cart = Cart(name=name, pushed=table.take("pushed", toml.flag, True), **_walk(table), **own)
    table.close()
    return cart


def _walk(table: toml.Table) -> dict[str, Any]:
    """Return the entries that all actors on a path have."""
    return {
        "path": table.take("path", toml.path),
        "speed": table.take("speed", toml.number, None),
        "pause": table.take("pause", toml.number, None),
        "loop": table.take("loop", toml.flag, False),
        "start": table.take("start", toml.number, None),
    }


def _leaf(table: toml.Table, index: int) -> DoorLeaf:
    lengths = ("width", "height", "thickness", "open_time", "closed_time", "moving_time")
    own: dict[str, Any] = {key: table.take(key, toml.number, None) for key in lengths}
    own["material"] = table.take("material", toml.text, None)
    leaf = DoorLeaf(
        name=table.take("name", toml.text, f"leaf_{index}"),
        hinge=table.take("hinge", toml.point),
        closed=table.take("closed", toml.degrees),
        swing=table.take("swing", toml.degrees),
        **{key: value for key, value in own.items() if value is not None},
    )
    table.close()
    return leaf
