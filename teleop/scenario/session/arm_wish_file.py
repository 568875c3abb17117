"""What clients wanted of the arm, as values that JSON holds to the bit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, Final, get_args

import numpy as np

from localization.types import Pose
from teleop.robot.arm.arm_commands import Five, Wish

_KINDS: Final[Mapping[str, type[Any]]] = {
    kind.__name__: kind for part in get_args(Wish) for kind in (get_args(part) or (part,))
}
"""All kinds of wishes, by name."""


def plain_wish(wish: Wish) -> dict[str, Any]:
    """Return a wish as dictionaries, lists and numbers."""
    values = {field.name: _plain(getattr(wish, field.name)) for field in fields(wish)}
    return {"wish": type(wish).__name__, **values}


def read_wish(values: Any) -> Wish:
    """Return the wish that ``plain_wish`` made these values of.

    Raises:
        ValueError: If they are not of one.
    """
    kind = _KINDS.get(str(values.get("wish", ""))) if isinstance(values, dict) else None
    if kind is None:
        raise ValueError("a wish of no known kind")
    types = {field.name: str(field.type) for field in fields(kind)}
    if wrong := types.keys() ^ (values.keys() - {"wish"}):
        raise ValueError(f"{kind.__name__} has no or unknown fields: {', '.join(sorted(wrong))}")
    read = {name: _value(name, wanted, values[name]) for name, wanted in types.items()}
    wish: Wish = kind(**read)
    return wish


def _plain(value: Any) -> Any:
    if isinstance(value, Pose):
        quaternion = value.quaternion_wxyz.tolist()
        return {"position": value.position.tolist(), "quaternion_wxyz": quaternion}
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _value(name: str, wanted: str, value: Any) -> object:
    kinds = wanted.split(" | ")
    if value is None and "None" in kinds:
        return None
    try:
        if reader := _READERS.get(kinds[0]):
            return reader(value)
    except (TypeError, KeyError):
        raise ValueError(f"{name} must be {wanted}, got {value!r:.40}") from None
    if type(value).__name__ not in kinds:
        raise ValueError(f"{name} must be {wanted}, got {value!r:.40}")
    return value


def _pose(value: Any) -> Pose:
    position, quaternion = (_numbers(value[key]) for key in ("position", "quaternion_wxyz"))
    return Pose(np.array(position), np.array(quaternion))


def _numbers(values: Any) -> tuple[float, ...]:
    if not isinstance(values, list) or not all(type(value) is float for value in values):
        raise TypeError
    return tuple(values)


def _some(count: int) -> Callable[[Any], tuple[float, ...]]:
    def read(values: Any) -> tuple[float, ...]:
        if len(values) != count:
            raise TypeError
        return _numbers(values)

    return read


def _rows(values: Any) -> tuple[Five, ...]:
    return tuple(_FIVE(row) for row in values)  # type: ignore[misc]


_FIVE: Final = _some(5)
_READERS: Final[Mapping[str, Callable[[Any], object]]] = {
    "Pose": _pose,
    "Five": _FIVE,
    "Three": _some(3),
    "tuple[float, ...]": _numbers,
    "tuple[Five, ...]": _rows,
}
"""Reads the fields that are not plain, by their type."""
