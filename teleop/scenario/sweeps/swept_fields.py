"""Fields of a scenario by name: which one a name means, and a scenario with other values of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from teleop.errors import SettingError
from teleop.scenario.files.errors import FieldPath, ScenarioError, dotted
from teleop.scenario.files.faults import Fault, Link
from teleop.scenario.files.fields import kinds, node_at, resolved, schema
from teleop.scenario.files.operator_settings import OUTSIDE
from teleop.scenario.files.problems import nearest
from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.sweeps.axes import Value

_PART: Final = re.compile(r"([a-z_]+)((?:\[\d+\])*)")
_LINK: Final = "link"
"""Name by which the link of the whole run is meant, which is a fault of its own."""
_REFUSED: Final = {
    "format": "it says how the file is written",
    "name": "it changes nothing",
    "description": "it changes nothing",
    "seed": "each cell has seeds of its own; say how many with --seeds",
}


def with_values(
    scenario: Scenario, values: Mapping[str, Value]
) -> tuple[Scenario, dict[str, Value]]:
    """Return a scenario with other values of some fields, and the values as the schema has them.

    Args:
        scenario: The scenario.
        values: Values by field; ``link.delay`` and its like mean a link fault from the start to the end, which is
            added if the scenario has none, and left out if it is no worse than no link.

    Raises:
        SettingError: If there is no such field, or a value is not for it; the message has what would work.
    """
    data = SCHEMA.dump_python(scenario, mode="json")
    # What an operator can be asked for depends on its kind, so that comes first.
    paths = {}
    for name in sorted(values, key=lambda name: not name.endswith(".kind")):
        paths[name] = field_path(name, data)
        _set(data, paths[name], values[name])
    try:
        made = scenario_from(data)
    except ExceptionGroup as group:
        errors = [e for e in group.exceptions if isinstance(e, ScenarioError)]
        raise SettingError(f"--over: {'; '.join(map(str, errors))}") from None
    if isinstance(made.operator, OUTSIDE):
        raise SettingError(
            "operator.kind: a sweep needs an operator of the library, which is the same in each run:"
            " follower, steering, careless or replay"
        )
    document = SCHEMA.dump_python(made, mode="json")
    held = {name: _get(document, paths[name]) for name in values}
    if any(name.startswith(f"{_LINK}.") for name in values):
        made = replace(made, fault=tuple(f for f in made.fault if not _is_no_worse(f)))
    return made, held


def _is_no_worse(fault: Fault) -> bool:
    """Return whether a fault is a link that changes nothing, as with a delay of 0."""
    return isinstance(fault, Link) and not (
        fault.delay or fault.jitter or fault.rate or fault.blackout
    )


def _get(data: Any, path: FieldPath) -> Value:
    for part in path:
        data = data[part]
    value: Value = data
    return value


def field_path(name: str, data: dict[str, Any]) -> FieldPath:
    """Return the path of a field in a scenario's document; a link that is meant and not there is added to it.

    Raises:
        SettingError: If there is no such field.
    """
    parts = _parts(name)
    if str(parts[0]) in _REFUSED:
        raise SettingError(f"--over {name}: cannot be swept: {_REFUSED[str(parts[0])]}")
    if parts[0] == _LINK:
        if parts[1:] in (("at",), ("lasting",)):
            raise SettingError(
                f"--over {name}: this link holds from the start to the end; put one into the file, and sweep"
                f" fault[0].{parts[1]}"
            )
        known = kinds(schema()["properties"]["fault"]["items"])[_LINK]["properties"]
        offered = [f"link.{each}" for each in known if each not in ("kind", "at", "lasting")]
        if name not in offered:
            raise _unknown(name, str(parts[-1]), offered)
        return ("fault", _link(data), parts[1])
    if parts[0] == "fault" and parts[-1] == "kind":
        raise SettingError(
            f"--over {name}: each kind of fault has fields of its own; write two files"
        )
    _check(name, parts, data)
    return parts


def _parts(name: str) -> FieldPath:
    parts: list[str | int] = []
    for word in name.split("."):
        found = _PART.fullmatch(word)
        if found is None:
            raise SettingError(
                f"--over {name}: no name of a field; they are written as operator.speed or fault[0].delay"
            )
        parts.append(found[1])
        parts += [int(number) for number in re.findall(r"\d+", found[2])]
    return tuple(parts)


def _check(name: str, parts: FieldPath, data: dict[str, Any]) -> None:
    """Check each step of a path, so that the message names what is there."""
    here: Any = data
    for i, part in enumerate(parts):
        node = resolved(node_at(parts[:i], data) or {})
        before = dotted(parts[:i])
        if isinstance(part, int):
            if not isinstance(here, list) or part >= len(here):
                count = len(here) if isinstance(here, list) else 0
                raise SettingError(
                    f"--over {name}: the scenario has {count} of {before}"
                    + (f", [0] to [{count - 1}]" if count else "")
                )
            here = here[part]
            continue
        if isinstance(here, list):
            raise SettingError(f"--over {name}: say which one: {before}[0].{part}")
        known = list(node.get("properties", {}))
        if not known:
            raise SettingError(
                f"--over {name}: {before} has no fields; give values for it as a whole"
            )
        if part not in known:
            offered = [f"{before}.{each}".lstrip(".") for each in known]
            raise _unknown(name, part, offered if i else [*offered, _LINK])
        here = here.get(part) if isinstance(here, Mapping) else None
    if isinstance(here, Mapping) or (isinstance(here, list) and here and isinstance(here[0], dict)):
        table = resolved(node_at(parts, data) or {})
        fields = ", ".join(f"{name}.{each}" for each in table.get("properties", {}))
        raise SettingError(f"--over {name}: is a table; name one of its fields: {fields}")


def _unknown(name: str, part: str, offered: list[str]) -> SettingError:
    last = {each.rpartition(".")[2]: each for each in offered}
    close = nearest(part, list(last))
    if close:
        near = close.removeprefix("; did you mean ").removesuffix("?")
        close = f"; did you mean {last[near]}?"
    return SettingError(
        f"--over {name}: unknown field{close or '; known are ' + ', '.join(offered)}"
    )


def _link(data: dict[str, Any]) -> int:
    """Return the number of the link fault that holds for everybody from the start to the end."""
    faults = data["fault"]
    for i, fault in enumerate(faults):
        is_whole = fault["kind"] == _LINK and not fault["at"] and fault.get("lasting") is None
        if is_whole and fault.get("client") is None:
            return i
    # At the end, for what a fault draws by the seed depends on its number.
    faults.append({"kind": _LINK, "at": 0.0})
    return len(faults) - 1


def _set(data: Any, path: FieldPath, value: Value) -> None:
    for part in path[:-1]:
        if data[part] is None:
            data[part] = {}
        data = data[part]
    data[path[-1]] = value
    if path == ("operator", "kind"):
        kind = kinds(schema()["properties"]["operator"]).get(str(value), {})
        for other in [key for key in data if key not in kind.get("properties", data)]:
            del data[other]
