"""TOML tables read key by key, with errors that name a missing, invalid or unknown entry."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias, TypeVar

from robot_sim.errors import WorldError
from robot_sim.floorplan.actors_in_plan import PathPoint
from robot_sim.scene_objects.plan_elements import Placement

T = TypeVar("T")

Reader: TypeAlias = Callable[[Any], T]
"""Converts a value of TOML; it raises a TypeError or ValueError that says what must be there."""

REQUIRED: Final = object()
"""Default of an entry that must be there."""


class Table:
    """One table of the text, which records the requested keys to detect unknown entries."""

    def __init__(self, entries: Mapping[str, Any], what: str = "") -> None:
        """Wrap a parsed table; its messages begin with ``what``, such as ``wall 'north'``."""
        self.what = what
        self._entries = entries
        self._known: dict[str, None] = {}

    def take(self, key: str, read: Reader[T], default: Any = REQUIRED) -> T:
        """Return the entry ``key`` as converted by ``read``, or the default.

        Raises:
            WorldError: it is missing without a default, or ``read`` rejects its value.
        """
        self._known[key] = None
        if key not in self._entries:
            if default is REQUIRED:
                raise WorldError(self._say(f"lacks the entry {key!r}"))
            value: T = default
            return value
        try:
            return read(self._entries[key])
        except (TypeError, ValueError, OverflowError) as error:
            raise WorldError(self._say(f"{key} {error}")) from None

    def table(self, key: str) -> Table:
        """Return the entry ``key``, a table; an empty one if it is missing."""
        return Table(self.take(key, _row, {}), key)

    def tables(self, key: str) -> list[Table]:
        """Return the entry ``key``, an array of tables; an empty list if it is missing."""
        entries = self.take(key, _rows, [])
        return [Table(each, f"{key} {each.get('name', i)!r}") for i, each in enumerate(entries)]

    def close(self) -> None:
        """Raise a WorldError if an entry was never requested."""
        for key in self._entries:
            if key not in self._known:
                known = ", ".join(self._known)
                raise WorldError(self._say(f"unknown entry {key!r}; known entries: {known}"))

    def _say(self, text: str) -> str:
        return f"{self.what}: {text}" if self.what else text


def _is(kind: type[T], words: str) -> Reader[T]:
    """Return the reader of a type of TOML, which is not a type derived from it: true is no number."""

    def read(value: Any) -> T:
        if type(value) is not kind:
            raise TypeError(f"must be {words}, got {value!r}")
        return value

    return read


count: Final = _is(int, "a whole number")
text: Final = _is(str, "a text")
flag: Final = _is(bool, "true or false")
_row: Final = _is(dict, "a table")


def number(value: Any) -> float:
    """Read a number."""
    return float(value if type(value) is int else _is(float, "a number")(value))


def degrees(value: Any) -> float:
    """Read an angle in degrees as radians."""
    return math.radians(number(value))


def numbers(form: str) -> Reader[Any]:
    """Return the reader of a list of numbers of a form such as ``[x, y]``."""

    def read(value: Any) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != 1 + form.count(","):
            raise ValueError(f"must be {form}, got {value!r}")
        return tuple(map(number, value))

    return read


point: Final = numbers("[x, y]")
bounds: Final = numbers("[x0, y0, x1, y1]")
size: Final = numbers("[width, depth, height]")
area: Final = numbers("[length, width]")
_pose: Final = numbers("[x, y, yaw]")


def placement(value: Any) -> Placement:
    """Read x, y and a yaw in degrees."""
    x, y, yaw = _pose(value)
    return Placement(x, y, math.radians(yaw))


def rise(value: Any) -> tuple[float, float]:
    """Read one height, or two: at the -x and at the +x end."""
    if isinstance(value, list):
        low, high = numbers("a height or [low, high]")(value)
        return low, high
    return number(value), number(value)


def waypoints(value: Any) -> tuple[Any, ...]:
    """Read a list of points."""
    return tuple(map(point, _is(list, "a list of [x, y]")(value)))


def path(value: Any) -> tuple[PathPoint, ...]:
    """Read a list of points, each with an optional third number, the duration of a stop."""
    lists = _is(list, form := "a list of [x, y] or [x, y, stop]")(value)
    if not all(isinstance(v, list) and len(v) in (2, 3) for v in lists):
        raise ValueError(f"must be {form}, got {value!r}")
    return tuple(tuple(map(number, v)) for v in lists)


def placements(value: Any) -> dict[str, Placement]:
    """Read a table of named placements."""
    read = {}
    for key, entry in _is(dict, "a table of name = [x, y, yaw]")(value).items():
        try:
            read[key] = placement(entry)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{key} {error}") from None
    return read


def _rows(value: Any) -> list[dict[str, Any]]:
    """Read an array of tables."""
    if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
        raise TypeError(f"must be an array of tables, got {value!r}")
    return value
