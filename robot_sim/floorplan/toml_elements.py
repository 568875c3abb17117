"""Elements of a floor plan as TOML tables: each field of its class is an entry."""

from __future__ import annotations

from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Any, Final, get_args, get_type_hints

from robot_sim.floorplan import toml_table as toml
from robot_sim.floorplan.actors_in_plan import PathPoint
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from robot_sim.scene_objects.glazing import Glazing
from robot_sim.scene_objects.materials import MATERIALS
from robot_sim.scene_objects.plan_elements import Bounds, Wall, Waypoint
from robot_sim.scene_objects.ramps_and_steps import Slab


def _material(value: Any) -> str:
    name = toml.text(value)
    if name not in MATERIALS:
        raise ValueError(f"must be one of {', '.join(MATERIALS)}, got {name!r}")
    return name


_Size = tuple[float, float, float]
_READERS: Final[dict[Any, toml.Reader[Any]]] = {
    float: toml.number,
    float | None: toml.number,
    int: toml.count,
    str: toml.text,
    bool: toml.flag,
    Waypoint: toml.point,
    Bounds: toml.bounds,
    _Size: toml.size,
    _Size | None: toml.size,
    tuple[Waypoint, ...]: toml.waypoints,
    tuple[PathPoint, ...]: toml.path,
}
"""Reader of each type of a field."""

_SPECIAL: Final[dict[tuple[type, str] | str, tuple[str, toml.Reader[Any]]]] = {
    "kind": ("type", toml.text),
    "rise": ("top", toml.rise),
    "x": ("at", lambda value: toml.point(value)[0]),
    "y": ("at", lambda value: toml.point(value)[1]),
    "material": ("material", _material),
    "yaw": ("yaw", toml.degrees),
    "closed": ("closed", toml.degrees),
    "swing": ("swing", toml.degrees),
    (Wall, "start"): ("from", toml.point),
    (Wall, "end"): ("to", toml.point),
    (Glazing, "start"): ("from", toml.point),
    (Glazing, "end"): ("to", toml.point),
    (Slab, "length"): ("size", lambda value: toml.area(value)[0]),
    (Slab, "width"): ("size", lambda value: toml.area(value)[1]),
    (Patch, "half"): ("size", lambda value: tuple(0.5 * v for v in toml.area(value))),
    (Patch, "surface"): ("surface", lambda value: surface_named(toml.text(value))),
}
"""Entry and reader of the fields that are written otherwise, in any class or in one."""


def element(kind: Any, table: toml.Table, **usual: Any) -> Any:
    """Read an element, and those within it, from its table.

    Args:
        kind: Its class.
        table: The table, all of whose entries must be known.
        usual: Defaults that take precedence over those of the class.
    """
    values: dict[str, Any] = {}
    for part in fields(kind):
        default = toml.REQUIRED if part.default is MISSING else part.default
        key, read = entry(kind, part.name)
        if isinstance(read, type):
            values[part.name] = tuple(element(read, inner) for inner in table.tables(key))
        else:
            values[part.name] = table.take(key, read, usual.get(part.name, default))
    table.close()
    return kind(**values)


@cache
def entry(kind: Any, field: str) -> tuple[str, Any]:
    """Return the key of a field and its reader, which is the class of elements within this one."""
    special = _SPECIAL.get((kind, field)) or _SPECIAL.get(field)
    if special is not None:
        return special
    hint = get_type_hints(kind)[field]
    inner = get_args(hint)[:1]
    return field, inner[0] if inner and is_dataclass(inner[0]) else _READERS[hint]
