"""All settings of the localiser in one table: name, default, and what each is, with unit and source.

``python -m localization.cli.settings_table`` prints the table as ``docs/settings.md`` has it. It is made from the
dataclasses themselves, so that what is written there is what runs.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from enum import StrEnum
from typing import Any

from localization.config import LocalizerConfig
from localization.types import SECOND

_HEAD = """\
# Settings of the localiser

This page is printed by `python -m localization.cli.settings_table` from the dataclasses that hold the settings, and a
test keeps it so. What is written there is what runs: there is no other place for a number.

A *sigma* is one standard deviation, where nothing else is said. A *chi-square* is a bound on a squared,
normalised error, with its degrees of freedom and the share of honest errors that it lets pass. A *density*
[unit/sqrt(Hz)] is the error of a rate: over t seconds its integral errs by density x sqrt(t). Where a data
sheet or a paper gave a number it is named; all others were chosen on the shipped scenes, never on the
generated buildings of the benchmark, and [the benchmark](accuracy.md) shows what they amount to.
"""


@dataclass(frozen=True, slots=True)
class Setting:
    """One field of a dataclass of settings."""

    name: str
    default: object
    text: str
    """Its docstring, in one line."""


def settings_of(config: type) -> tuple[Setting, ...]:
    """Return a dataclass's fields with their docstrings; nested dataclasses are left out."""
    told = _docstrings(config)
    found = []
    for entry in fields(config):
        value = _default(entry)
        if not is_dataclass(value):
            found.append(Setting(entry.name, value, told.get(entry.name, "")))
    return tuple(found)


def tables(config: type = LocalizerConfig, name: str = "") -> Iterator[tuple[str, type]]:
    """Yield a dataclass of settings and those within it, each with its path from the first."""
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
        page += ["| setting | default | what it is |", "|---|---|---|"]
        for setting in settings_of(config):
            text = setting.text.replace("|", "\\|").replace("``", "`")
            page.append(f"| `{setting.name}` | {written(setting.default, text)} | {text} |")
        page.append("")
    return "\n".join(page).rstrip() + "\n"


def written(value: object, text: str) -> str:
    """Return a default as people read it: angles in degrees, nanoseconds in seconds."""
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


def _docstrings(config: type) -> dict[str, str]:
    """Return the strings that stand beneath a class's fields, by the field's name."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(config))).body
    assert isinstance(tree, ast.ClassDef)
    told = {}
    for field, beneath in zip(tree.body, tree.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            match beneath:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    told[field.target.id] = " ".join(text.split())
    return told


if __name__ == "__main__":
    sys.stdout.write(markdown())
