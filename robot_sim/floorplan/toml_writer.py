"""Writer of floor plans as readable TOML that reads back as the same plan."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any, Final

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import CloudSpec, Piece, Placement, Plan, Waypoint
from robot_sim.floorplan.toml_elements import entry

_WRITTEN: Final = {
    "name", "bounds", "spawns", "height", "ceiling", "floor", "walls", "furniture", "places",
    "tour", "survey", "cloud",
}  # fmt: skip
_POINTS_A_LINE: Final = 6


def plan_to_toml(
    plan: Plan,
    *,
    heading: Sequence[str] = (),
    notes: Mapping[str, str] | None = None,
    tables: bool = True,
) -> str:
    """Return a plan's text, from which ``plan_from_toml`` reads an equal plan.

    Args:
        plan: Plan of walls and furniture; its yaws must be multiples of a millionth of a degree.
        heading: Comment lines at the top.
        notes: Comments by the name of the furniture above which they are written.
        tables: Whether each wall and piece of furniture is a table of its own; otherwise a line.

    Raises:
        WorldError: the plan has elements that this writer does not support.
    """
    for part in fields(plan):
        if part.name not in _WRITTEN and getattr(plan, part.name):
            raise WorldError(f"plan {plan.name!r} has {part.name}, which cannot be written")
    return "\n".join(_lines(plan, heading, notes or {}, tables)) + "\n"


def _lines(
    plan: Plan, heading: Sequence[str], notes: Mapping[str, str], tables: bool
) -> Iterator[str]:
    yield from (f"# {line}".rstrip() for line in heading)
    yield ""
    yield f"bounds = {_numbers(plan.bounds)}"
    yield f"height = {_number(plan.height)}"
    if not plan.ceiling:
        yield "ceiling = false"
    if plan.floor != "tile":
        yield f"floor = {_text(plan.floor)}"
    yield ""
    yield f"spawn = {_placement(plan.spawn)}"
    yield from _route("tour", plan.tour)
    if plan.survey != plan.tour:
        yield from _route("survey", plan.survey)
    if not tables:
        yield ""
        yield "furniture = ["
        yield from (f"  {{ {', '.join(_piece(p, i))} }}," for i, p in enumerate(plan.furniture))
        yield "]"
        yield ""
        yield "wall = ["
        yield from (f"  {{ {', '.join(_wall(plan, i))} }}," for i in range(len(plan.walls)))
        yield "]"
    others = list(plan.spawns.items())[1:]
    for title, placements in (("spawns", others), ("places", list(plan.places.items()))):
        if placements:
            yield ""
            yield f"[{title}]"
            yield from (f"{_key(k)} = {_placement(v)}" for k, v in placements)
    if plan.cloud != CloudSpec():
        yield ""
        yield "[cloud]"
        yield from _entries(plan.cloud)
    if tables and plan.walls:
        yield ""
        yield "# ---- walls"
        for i in range(len(plan.walls)):
            yield ""
            yield "[[wall]]"
            yield from _wall(plan, i)
    if tables:
        for i, piece in enumerate(plan.furniture):
            if piece.name in notes:
                yield ""
                yield f"# ---- {notes[piece.name]}"
            yield ""
            yield "[[furniture]]"
            yield from _piece(piece, i)


def _route(name: str, line: Sequence[Waypoint]) -> Iterator[str]:
    if not line:
        return
    yield ""
    yield f"{name} = ["
    for i in range(0, len(line), _POINTS_A_LINE):
        yield f"  {', '.join(_numbers(p) for p in line[i : i + _POINTS_A_LINE])},"
    yield "]"


def _wall(plan: Plan, index: int) -> Iterator[str]:
    return _entries(plan.walls[index], name=f"wall_{index}", height=plan.height)


def _piece(piece: Piece, index: int) -> Iterator[str]:
    return _entries(piece, name=f"{piece.kind}_{index}")


def _entries(element: Any, **usual: Any) -> Iterator[str]:
    """Yield the entries of an element that differ from its defaults; the kind of a piece is the first."""
    for part in sorted(fields(element), key=lambda part: part.name != "kind"):
        value = getattr(element, part.name)
        key, read = entry(element.__class__, part.name)
        if value == usual.get(part.name, part.default) or part.name == "y":
            continue
        if isinstance(read, type):
            rows = [f"  {{ {', '.join(_entries(inner))} }}," for inner in value]
            yield "\n".join([f"{key} = [", *rows, "]"])
        elif part.name == "x":
            yield f"{key} = {_numbers((element.x, element.y))}"
        elif isinstance(value, str):
            yield f"{key} = {_text(value)}"
        elif isinstance(value, tuple):
            yield f"{key} = {_numbers(value)}"
        elif isinstance(value, int):
            yield f"{key} = {value}"
        else:
            yield f"{key} = {_degrees(value) if part.name == 'yaw' else _number(value)}"


def _placement(placement: Placement) -> str:
    x, y = _number(placement.x), _number(placement.y)
    return f"[{x}, {y}, {_degrees(placement.yaw)}]"


def _numbers(values: Sequence[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    return repr(float(value))


def _degrees(angle: float) -> str:
    return _number(round(math.degrees(angle), 6))


def _text(value: str) -> str:
    # A JSON string of printable characters is a basic string of TOML.
    return json.dumps(value, ensure_ascii=False)


def _key(value: str) -> str:
    bare = value and all(c.isascii() and (c.isalnum() or c in "_-") for c in value)
    return value if bare else _text(value)
