"""Plans as TOML: metres and degrees in the text; every key must be a known one."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from robot_sim.errors import WorldError
from robot_sim.inhabitants import Cart, Leaf, Person, Stop
from robot_sim.plan import Bounds, Door, Piece, Placement, Plan, Wall, Waypoint, Window

T = TypeVar("T")

_REQUIRED: Final = object()


def plan_from_toml(text: str, *, name: str) -> Plan:
    """Read the text of a floor plan.

    Args:
        text: TOML; see ``docs/worlds.md`` for its tables and keys.
        name: Of the world, for the plan and for messages.

    Raises:
        WorldError: it is not TOML, lacks an entry, has an unknown one, or a value makes no sense;
            the message names the entry.
    """
    try:
        return _plan(Table(tomllib.loads(text)), name)
    except tomllib.TOMLDecodeError as error:
        raise WorldError(f"world {name!r} is not valid TOML: {error}") from None
    except WorldError as error:
        raise WorldError(f"world {name!r}: {error}") from None


class Table:
    """One table of the text, which knows what was asked of it and so what is unknown to us."""

    def __init__(self, entries: Mapping[str, Any], what: str = "") -> None:
        """Wrap a parsed table; ``what`` begins its messages, as in ``wall 'north'``."""
        self.what = what
        self._entries = entries
        self._known: list[str] = []

    def take(self, key: str, read: Callable[[Any], T], default: Any = _REQUIRED) -> T:
        """Return the entry ``key`` as ``read`` makes it, or the default.

        Raises:
            WorldError: it is missing and there is no default, or ``read`` cannot make sense of it.
        """
        self._known.append(key)
        if key not in self._entries:
            if default is _REQUIRED:
                raise WorldError(self._say(f"lacks the entry {key!r}"))
            value: T = default
            return value
        try:
            return read(self._entries[key])
        except (TypeError, ValueError) as error:
            raise WorldError(self._say(f"{key} {error}")) from None

    def tables(self, key: str) -> list[Table]:
        """Return the entry ``key``, an array of tables, as such; none if it is missing."""
        rows = self.take(key, _rows, [])
        return [Table(row, f"{key} {row.get('name', i)!r}") for i, row in enumerate(rows)]

    def close(self) -> None:
        """Raise a WorldError if an entry was never asked for."""
        for key in self._entries:
            if key not in self._known:
                known = ", ".join(self._known)
                raise WorldError(self._say(f"unknown entry {key!r}; there are: {known}"))

    def _say(self, text: str) -> str:
        return f"{self.what}: {text}" if self.what else text


def _plan(table: Table, name: str) -> Plan:
    bounds = table.take("bounds", _bounds)
    height = table.take("height", number, 2.8)
    thickness = table.take("wall_thickness", number, 0.14)
    tour = table.take("tour", _waypoints, ())
    plan = Plan(
        name=name,
        bounds=bounds,
        height=height,
        ceiling=table.take("ceiling", _flag, True),
        floor=table.take("floor", _text, "tile"),
        spawns={"spawn": table.take("spawn", placement), **table.take("spawns", _placements, {})},
        walls=tuple(_wall(t, i, height, thickness) for i, t in enumerate(table.tables("wall"))),
        furniture=tuple(_piece(t, i) for i, t in enumerate(table.tables("furniture"))),
        places=table.take("places", _placements, {}),
        tour=tour,
        survey=table.take("survey", _waypoints, tour),
        inhabitants=(
            *(_person(t, i) for i, t in enumerate(table.tables("person"))),
            *(_cart(t, i) for i, t in enumerate(table.tables("cart"))),
            *(_leaf(t, i) for i, t in enumerate(table.tables("leaf"))),
        ),
    )
    table.close()
    return plan


def _wall(table: Table, index: int, height: float, thickness: float) -> Wall:
    wall = Wall(
        name=table.take("name", _text, f"wall_{index}"),
        start=table.take("from", point),
        end=table.take("to", point),
        height=table.take("height", number, height),
        thickness=table.take("thickness", number, thickness),
        material=table.take("material", _text, "wall"),
        doors=tuple(_door(t) for t in table.tables("doors")),
        windows=tuple(_window(t) for t in table.tables("windows")),
    )
    table.close()
    return wall


def _door(table: Table) -> Door:
    door = Door(
        at=table.take("at", number),
        width=table.take("width", number),
        height=table.take("height", number, 2.05),
    )
    table.close()
    return door


def _window(table: Table) -> Window:
    window = Window(
        at=table.take("at", number),
        width=table.take("width", number),
        sill=table.take("sill", number, 0.9),
        height=table.take("height", number, 1.2),
    )
    table.close()
    return window


def _piece(table: Table, index: int) -> Piece:
    kind = table.take("type", _text)
    x, y = table.take("at", point)
    piece = Piece(
        name=table.take("name", _text, f"{kind}_{index}"),
        kind=kind,
        x=x,
        y=y,
        yaw=table.take("yaw", degrees, 0.0),
        size=table.take("size", _size, None),
        seed=table.take("seed", _count, 0),
    )
    table.close()
    return piece


def _person(table: Table, index: int) -> Person:
    person = Person(name=table.take("name", _text, f"person_{index}"), **_walk(table))
    table.close()
    return person


def _cart(table: Table, index: int) -> Cart:
    name = table.take("name", _text, f"cart_{index}")
    size = table.take("size", _size, None)
    own: dict[str, Any] = {} if size is None else {"size": size}
    cart = Cart(name=name, pushed=table.take("pushed", _flag, True), **_walk(table), **own)
    table.close()
    return cart


def _walk(table: Table) -> dict[str, Any]:
    """Return the entries that whatever follows a path has."""
    return {
        "path": table.take("path", _path),
        "speed": table.take("speed", number, None),
        "pause": table.take("pause", number, None),
        "loop": table.take("loop", _flag, False),
        "start": table.take("start", number, None),
    }


def _leaf(table: Table, index: int) -> Leaf:
    lengths = ("width", "height", "thickness", "open_time", "closed_time", "moving_time")
    own: dict[str, Any] = {key: table.take(key, number, None) for key in lengths}
    own["material"] = table.take("material", _text, None)
    leaf = Leaf(
        name=table.take("name", _text, f"leaf_{index}"),
        hinge=table.take("hinge", point),
        closed=table.take("closed", degrees),
        swing=table.take("swing", degrees),
        **{key: value for key, value in own.items() if value is not None},
    )
    table.close()
    return leaf


def number(value: Any) -> float:
    """Read a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"must be a number, got {value!r}")
    return float(value)


def degrees(value: Any) -> float:
    """Read an angle in degrees as radians."""
    return math.radians(number(value))


def point(value: Any) -> Waypoint:
    """Read x and y."""
    x, y = _numbers(value, 2, "[x, y]")
    return x, y


def placement(value: Any) -> Placement:
    """Read x, y and a yaw in degrees."""
    x, y, yaw = _numbers(value, 3, "[x, y, yaw]")
    return Placement(x, y, math.radians(yaw))


def _bounds(value: Any) -> Bounds:
    x0, y0, x1, y1 = _numbers(value, 4, "[x0, y0, x1, y1]")
    return x0, y0, x1, y1


def _size(value: Any) -> tuple[float, float, float]:
    width, depth, height = _numbers(value, 3, "[width, depth, height]")
    return width, depth, height


def _numbers(value: Any, count: int, form: str) -> list[float]:
    if not isinstance(value, list) or len(value) != count:
        raise ValueError(f"must be {form}, got {value!r}")
    return [number(v) for v in value]


def _count(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"must be a whole number, got {value!r}")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"must be a text, got {value!r}")
    return value


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"must be true or false, got {value!r}")
    return value


def _waypoints(value: Any) -> tuple[Waypoint, ...]:
    if not isinstance(value, list):
        raise TypeError(f"must be a list of [x, y], got {value!r}")
    return tuple(point(v) for v in value)


def _path(value: Any) -> tuple[Stop, ...]:
    if not isinstance(value, list):
        raise TypeError(f"must be a list of [x, y] or [x, y, stop], got {value!r}")
    if not all(isinstance(v, list) and len(v) in (2, 3) for v in value):
        raise ValueError(f"must be a list of [x, y] or [x, y, stop], got {value!r}")
    return tuple(tuple(number(n) for n in v) for v in value)


def _placements(value: Any) -> dict[str, Placement]:
    if not isinstance(value, dict):
        raise TypeError(f"must be a table of name = [x, y, yaw], got {value!r}")
    placements = {}
    for key, entry in value.items():
        try:
            placements[key] = placement(entry)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{key} {error}") from None
    return placements


def _rows(value: Any) -> list[dict[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
        raise TypeError(f"must be an array of tables, got {value!r}")
    return value
