"""Scenarios as TOML: only what differs from the defaults, in the order of the schema."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from teleop.scenario.files.operator_settings import Follower
from teleop.scenario.files.scenario import SCHEMA, Scenario

_FLAT: Final = 100
"""Number of columns of a table that is written in one line."""


def scenario_text(scenario: Scenario) -> str:
    """Return a scenario as the text of a TOML file."""
    data = SCHEMA.dump_python(scenario, mode="json", exclude_defaults=True)
    data = {"format": scenario.format, "name": scenario.name, **data}
    tables = {k: v for k, v in data.items() if isinstance(v, dict)}
    # A kind may be the default of its field, but its table is nothing without it.
    if scenario.operator != Follower():
        tables["operator"] = {"kind": scenario.operator.kind, **tables.get("operator", {})}
    if scenario.second is not None:
        tables["second"] = {"kind": scenario.second.kind, **tables.get("second", {})}
    faults = [
        {"kind": f.kind, **d} for f, d in zip(scenario.fault, data.get("fault", ()), strict=True)
    ]
    plain = {k: v for k, v in data.items() if k not in tables and k != "fault"}
    blocks = [_pairs(plain)]
    blocks += [f"[{name}]\n{_pairs(table)}" for name, table in tables.items() if table]
    blocks += [f"[[fault]]\n{_pairs(fault)}" for fault in faults]
    # Limits stand last, as what is judged at the end.
    blocks.sort(key=lambda block: block.startswith("[limits]"))
    return "\n".join(blocks)


def _pairs(table: Mapping[str, Any]) -> str:
    return "".join(f"{key} = {_long_value(value)}\n" for key, value in table.items())


def _long_value(value: object) -> str:
    """Return a value, a list of tables in a line for each."""
    text = toml_value(value)
    if len(text) <= _FLAT or not isinstance(value, list):
        return text
    return "[\n" + "".join(f"  {toml_value(member)},\n" for member in value) + "]"


def toml_value(value: object) -> str:
    """Return a value as TOML writes it.

    Raises:
        TypeError: If it is of no type that scenarios have.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for surrogates, which ``ensure_ascii`` would make.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (int, float)):
        return repr(value) if isinstance(value, int) or math.isfinite(value) else f"{value}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k} = {toml_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    raise TypeError(f"{type(value).__name__} is no type of a scenario file")
