"""What is swept: fields with their values, as they are written on the command line."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from decimal import Decimal
from typing import Final, TypeAlias

from teleop.errors import SettingError

Value: TypeAlias = bool | int | float | str | list["Value"]
"""A value of a field, as scenario files have them."""

LARGEST: Final = 100_000
"""Largest number of values of an axis, and of runs of a sweep."""

_NUMBER: Final = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_RANGE: Final = re.compile(rf"({_NUMBER}):({_NUMBER}):({_NUMBER})")
_WORD: Final = re.compile(r"[A-Za-z0-9_][\w .-]*")


@dataclass(frozen=True, slots=True)
class Axis:
    """A field and the values that it takes."""

    name: str
    """The field, such as ``link.delay`` or ``fault[0].at``."""
    values: tuple[Value, ...]
    """Its values, in order; at least one."""


def axis_of(text: str) -> Axis:
    """Read ``FIELD=VALUES``: a range ``0:2:0.25`` with both ends, a list ``1,2,5``, or words ``a,b``.

    Raises:
        SettingError: If it is something else.
    """
    name, equals, values = text.partition("=")
    name, values = name.strip(), values.strip()
    if not (name and equals and values):
        raise SettingError(
            f"--over {text}: give FIELD=VALUES, such as link.delay=0:2:0.25 or operator.speed=0.4,0.8"
        )
    if found := _RANGE.fullmatch(values):
        return Axis(name, _range(text, *found.groups()))
    return Axis(name, _list(text, values))


def _range(text: str, begin: str, end: str, step: str) -> tuple[Value, ...]:
    # In decimals, so that 0:2:0.1 holds 0.3 and not 0.30000000000000004, and its end.
    low, high, by = Decimal(begin), Decimal(end), Decimal(step)
    if not by or (high - low) / by < 0:
        raise SettingError(f"--over {text}: a step of {step} does not lead from {begin} to {end}")
    count = int((high - low) / by) + 1
    if count > LARGEST:
        raise SettingError(f"--over {text}: {count} values are too many; {LARGEST} are the limit")
    values = [low + i * by for i in range(count)]
    whole = all(value == value.to_integral_value() for value in (low, by))
    return tuple(int(value) if whole else float(value) for value in values)


def _list(text: str, values: str) -> tuple[Value, ...]:
    try:
        members = tomllib.loads(f"members = [{values}]")["members"]
    except tomllib.TOMLDecodeError:
        members = [word.strip() for word in values.split(",")]
        if not all(_WORD.fullmatch(word) for word in members):
            raise SettingError(
                f"--over {text}: {values!r} is no range (0:2:0.25), no list (1,2,5) and no words (a,b)"
            ) from None
    if not members or not all(_is_value(member) for member in members):
        raise SettingError(f"--over {text}: values are numbers, words, true and false, or [x, y]")
    if len(members) > LARGEST:
        raise SettingError(f"--over {text}: {len(members)} values; {LARGEST} are the limit")
    return tuple(members)


def _is_value(member: object) -> bool:
    if isinstance(member, list):
        return all(isinstance(each, (int, float)) for each in member)
    return isinstance(member, (bool, int, float, str))


def value_text(value: Value) -> str:
    """Return a value for people."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.10g}"
    return str(value)
