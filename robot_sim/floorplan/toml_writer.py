"""Writer of floor plans as readable TOML that reads back as the same plan."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Final

from robot_sim.errors import WorldError
from robot_sim.floorplan.plan import CloudSpec, Door, Piece, Placement, Plan, Wall, Waypoint, Window

_WRITTEN: Final = {
    "name", "bounds", "spawns", "height", "ceiling", "floor", "walls", "furniture", "places",
    "tour", "survey", "cloud",
}  # fmt: skip
_THICKNESS: Final = 0.14
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
        for i, piece in enumerate(plan.furniture):
            yield f"  {{ {', '.join(_piece(piece, i))} }},"
        yield "]"
        yield ""
        yield "wall = ["
        for i, wall in enumerate(plan.walls):
            yield f"  {{ {', '.join(_wall(wall, i, plan.height))} }},"
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
        yield f"spacing = {_number(plan.cloud.spacing)}"
        if plan.cloud.highest is not None:
            yield f"highest = {_number(plan.cloud.highest)}"
    if tables:
        yield from _wall_tables(plan)
        for i, piece in enumerate(plan.furniture):
            if piece.name in notes:
                yield ""
                yield f"# ---- {notes[piece.name]}"
            yield ""
            yield "[[furniture]]"
            yield from _piece(piece, i)


def _wall_tables(plan: Plan) -> Iterator[str]:
    if plan.walls:
        yield ""
        yield "# ---- walls"
    for i, wall in enumerate(plan.walls):
        yield ""
        yield "[[wall]]"
        yield from _wall(wall, i, plan.height)


def _route(name: str, line: Sequence[Waypoint]) -> Iterator[str]:
    if not line:
        return
    yield ""
    yield f"{name} = ["
    for i in range(0, len(line), _POINTS_A_LINE):
        yield f"  {', '.join(_numbers(p) for p in line[i : i + _POINTS_A_LINE])},"
    yield "]"


def _wall(wall: Wall, index: int, height: float) -> Iterator[str]:
    if wall.name != f"wall_{index}":
        yield f"name = {_text(wall.name)}"
    yield f"from = {_numbers(wall.start)}"
    yield f"to = {_numbers(wall.end)}"
    if wall.height != height:
        yield f"height = {_number(wall.height)}"
    if wall.thickness != _THICKNESS:
        yield f"thickness = {_number(wall.thickness)}"
    if wall.material != "wall":
        yield f"material = {_text(wall.material)}"
    if wall.doors:
        yield _rows("doors", [", ".join(_door(d)) for d in wall.doors])
    if wall.windows:
        yield _rows("windows", [", ".join(_window(w)) for w in wall.windows])


def _rows(name: str, rows: Sequence[str]) -> str:
    return "\n".join([f"{name} = [", *(f"  {{ {row} }}," for row in rows), "]"])


def _door(door: Door) -> Iterator[str]:
    yield f"at = {_number(door.at)}"
    yield f"width = {_number(door.width)}"
    if door.height != Door(0.0, 1.0).height:
        yield f"height = {_number(door.height)}"


def _window(window: Window) -> Iterator[str]:
    usual = Window(0.0, 1.0)
    yield f"at = {_number(window.at)}"
    yield f"width = {_number(window.width)}"
    if window.sill != usual.sill:
        yield f"sill = {_number(window.sill)}"
    if window.height != usual.height:
        yield f"height = {_number(window.height)}"


def _piece(piece: Piece, index: int) -> Iterator[str]:
    yield f"type = {_text(piece.kind)}"
    if piece.name != f"{piece.kind}_{index}":
        yield f"name = {_text(piece.name)}"
    yield f"at = {_numbers((piece.x, piece.y))}"
    if piece.yaw:
        yield f"yaw = {_degrees(piece.yaw)}"
    if piece.size is not None:
        yield f"size = {_numbers(piece.size)}"
    if piece.seed:
        yield f"seed = {piece.seed}"


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
