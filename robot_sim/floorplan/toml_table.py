"""TOML tables read key by key, with errors that name a missing, invalid or unknown entry."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from robot_sim.errors import WorldError
from robot_sim.floorplan.actors_in_plan import PathPoint
from robot_sim.scene_objects.plan_elements import Bounds, Placement, Waypoint

T = TypeVar("T")

_REQUIRED: Final = object()


class Table:
    """One table of the text, which records the requested keys to detect unknown entries."""

    def __init__(self, entries: Mapping[str, Any], what: str = "") -> None:
        """Wrap a parsed table; its messages begin with ``what``, such as ``wall 'north'``."""
        self.what = what
        self._entries = entries
        self._known: list[str] = []

    def take(self, key: str, read: Callable[[Any], T], default: Any = _REQUIRED) -> T:
        """Return the entry ``key`` as converted by ``read``, or the default.

        Raises:
            WorldError: it is missing without a default, or ``read`` rejects its value.
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

    def table(self, key: str) -> Table:
        """Return the entry ``key``, a table; an empty one if it is missing."""
        return Table(self.take(key, row, {}), key)

    def tables(self, key: str) -> list[Table]:
        """Return the entry ``key``, an array of tables; an empty list if it is missing."""
        entries = self.take(key, rows, [])
        return [Table(each, f"{key} {each.get('name', i)!r}") for i, each in enumerate(entries)]

    def close(self) -> None:
        """Raise a WorldError if an entry was never requested."""
        for key in self._entries:
            if key not in self._known:
                known = ", ".join(self._known)
                raise WorldError(self._say(f"unknown entry {key!r}; known entries: {known}"))

    def _say(self, text: str) -> str:
        return f"{self.what}: {text}" if self.what else text


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
    x, y = numbers(value, 2, "[x, y]")
    return x, y


def placement(value: Any) -> Placement:
    """Read x, y and a yaw in degrees."""
    x, y, yaw = numbers(value, 3, "[x, y, yaw]")
    return Placement(x, y, math.radians(yaw))


def bounds(value: Any) -> Bounds:
    """Read the smallest and the largest x and y."""
    x0, y0, x1, y1 = numbers(value, 4, "[x0, y0, x1, y1]")
    return x0, y0, x1, y1


def size(value: Any) -> tuple[float, float, float]:
    """Read width, depth and height."""
    width, depth, height = numbers(value, 3, "[width, depth, height]")
    return width, depth, height


def area(value: Any) -> tuple[float, float]:
    """Read two lengths, along x and along y."""
    length, width = numbers(value, 2, "[length, width]")
    return length, width


def rise(value: Any) -> tuple[float, float]:
    """Read one height, or two: at the -x and at the +x end."""
    if isinstance(value, list):
        low, high = numbers(value, 2, "a height or [low, high]")
        return low, high
    return number(value), number(value)


def numbers(value: Any, length: int, form: str) -> list[float]:
    """Read a list of ``length`` numbers; ``form`` describes it in messages."""
    if not isinstance(value, list) or len(value) != length:
        raise ValueError(f"must be {form}, got {value!r}")
    return [number(v) for v in value]


def count(value: Any) -> int:
    """Read a whole number."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"must be a whole number, got {value!r}")
    return value


def text(value: Any) -> str:
    """Read a text."""
    if not isinstance(value, str):
        raise TypeError(f"must be a text, got {value!r}")
    return value


def flag(value: Any) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        raise TypeError(f"must be true or false, got {value!r}")
    return value


def waypoints(value: Any) -> tuple[Waypoint, ...]:
    """Read a list of points."""
    if not isinstance(value, list):
        raise TypeError(f"must be a list of [x, y], got {value!r}")
    return tuple(point(v) for v in value)


def path(value: Any) -> tuple[PathPoint, ...]:
    """Read a list of points, each with an optional third number, the duration of a stop."""
    if not isinstance(value, list):
        raise TypeError(f"must be a list of [x, y] or [x, y, stop], got {value!r}")
    if not all(isinstance(v, list) and len(v) in (2, 3) for v in value):
        raise ValueError(f"must be a list of [x, y] or [x, y, stop], got {value!r}")
    return tuple(tuple(number(n) for n in v) for v in value)


def placements(value: Any) -> dict[str, Placement]:
    """Read a table of named placements."""
    if not isinstance(value, dict):
        raise TypeError(f"must be a table of name = [x, y, yaw], got {value!r}")
    read = {}
    for key, entry in value.items():
        try:
            read[key] = placement(entry)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{key} {error}") from None
    return read


def row(value: Any) -> dict[str, Any]:
    """Read a table."""
    if not isinstance(value, dict):
        raise TypeError(f"must be a table, got {value!r}")
    return value


def rows(value: Any) -> list[dict[str, Any]]:
    """Read an array of tables."""
    if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
        raise TypeError(f"must be an array of tables, got {value!r}")
    return value
