"""Table of all settings of the localiser: name, default, meaning, unit and source.

``python -m localization.cli.settings_table`` prints the page ``docs/settings.md`` from the dataclasses that hold the
settings and their docstrings.
"""

from __future__ import annotations

import inspect
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from enum import StrEnum
from typing import Any

import docstring_parser

from localization.config import LocalizerConfig
from localization.types import SECOND

_HEAD = """\
# Settings of the localiser

*Reference.* Printed by `python -m localization.cli.settings_table` from the dataclasses that hold the settings; a test
compares the two. [Localisation](localization.md#settings) says how to change one, and which matter most.

A *sigma* is one standard deviation unless stated otherwise. A *chi-square* is a bound on a squared, normalised
error, given with its degrees of freedom and the share of consistent errors below it. A *density* [unit/sqrt(Hz)]
is the noise of a rate: the error of its integral over t seconds is density x sqrt(t). The source of a value is a
data sheet or a paper if one is named; all other values were chosen on the shipped scenes or on public logs of real
robots, never on the generated buildings of the benchmark, and [the benchmark](accuracy.md) shows their effect.
"""


@dataclass(frozen=True, slots=True)
class Setting:
    """One field of a dataclass of settings."""

    name: str
    """Name of the field."""
    default: object
    """Default value."""
    text: str
    """Docstring of the field in one line; empty if it has none."""


def settings_of(config: type) -> tuple[Setting, ...]:
    """Return a dataclass's fields with their docstrings, without fields that hold nested dataclasses."""
    described = docstring_parser.parse_from_object(config).params
    texts = {p.arg_name: " ".join((p.description or "").split()) for p in described}
    found = []
    for entry in fields(config):
        value = _default(entry)
        if not is_dataclass(value):
            found.append(Setting(entry.name, value, texts.get(entry.name, "")))
    return tuple(found)


def tables(config: type = LocalizerConfig, name: str = "") -> Iterator[tuple[str, type]]:
    """Yield a dataclass of settings and all nested ones, each with its path from the first."""
    yield name, config
    for entry in fields(config):
        value = _default(entry)
        if is_dataclass(value):
            yield from tables(type(value), f"{name}.{entry.name}".lstrip("."))


def markdown() -> str:
    """Return the page ``docs/settings.md``."""
    page = [_HEAD]
    for name, config in tables():
        title = f"`LocalizerConfig.{name}`: `{config.__name__}`" if name else f"`{config.__name__}`"
        about = inspect.cleandoc(config.__doc__ or "").replace("``", "`")
        page += [f"## {title}", "", about, ""]
        page += ["| setting | default | meaning |", "|---|---|---|"]
        for setting in settings_of(config):
            text = setting.text.replace("|", "\\|").replace("``", "`")
            page.append(f"| `{setting.name}` | {written(setting.default, text)} | {text} |")
        page.append("")
    return "\n".join(page).rstrip() + "\n"


def written(value: object, text: str) -> str:
    """Return a default as text: angles also in degrees, nanoseconds in seconds.

    Args:
        value: The default.
        text: Docstring of the setting, which holds the unit in brackets.
    """
    found = re.search(r"\[([^\]]+)\]", text)
    unit = found[1] if found else ""
    match value:
        case bool():
            return "yes" if value else "no"
        case StrEnum():
            return f"`{value.value}`"
        case tuple():
            return ", ".join(written(part, "") for part in value)
        case int() if unit == "ns":
            return f"{value / SECOND:g} s"
        case float() if unit.startswith("rad"):
            return f"{value:.3g} ({math.degrees(value):.3g} deg)"
        case float():
            return f"{value:.4g}"
        case None:
            return "none"
    return str(value)


def _default(entry: Field[Any]) -> Any:
    if entry.default is not MISSING:
        return entry.default
    if entry.default_factory is not MISSING:
        return entry.default_factory()
    raise TypeError(f"setting {entry.name} has no default")


if __name__ == "__main__":
    sys.stdout.write(markdown())
