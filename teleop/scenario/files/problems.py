"""What the schema has against a document, in one line for each field."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, Final

from teleop.scenario.files.errors import ScenarioError
from teleop.scenario.files.fields import Node, either, kinds, node_at, type_text
from teleop.scenario.files.lines import FieldPath

Problem = Mapping[str, Any]
"""An entry of ``pydantic.ValidationError.errors()``."""

_SIGNS: Final = {
    "greater_than": (">", "gt"),
    "greater_than_equal": (">=", "ge"),
    "less_than": ("<", "lt"),
    "less_than_equal": ("<=", "le"),
}
_LONGEST: Final = 60
"""Number of characters of a value that a message shows."""


def scenario_errors(problems: Sequence[Problem], data: object) -> list[ScenarioError]:
    """Return one error for each field that is wrong, in the order in which they were found.

    Args:
        problems: The errors of the validation.
        data: The document.
    """
    found: dict[FieldPath, ScenarioError] = {}
    for problem in problems:
        path, inside_union = _field(problem, data)
        message = _wrong_value(path, data) if inside_union else _message(problem, path, data)
        found.setdefault(path, ScenarioError(path, message))
    return list(found.values())


def nearest(name: str, known: Sequence[str]) -> str:
    """Return ``; did you mean a?`` with the most similar of the known names, or nothing if none is."""
    close = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean {close[0]}?" if close else ""


def _field(problem: Problem, data: object) -> tuple[FieldPath, bool]:
    """Return the field of a problem, and whether it is in one of several alternatives of that field.

    Pydantic puts the kind of a table, and the type of an alternative, between the names of fields.
    """
    path: FieldPath = ()
    parts = problem["loc"]
    for i, part in enumerate(parts):
        if isinstance(data, Mapping) and part == data.get("kind"):
            continue
        if isinstance(data, Mapping) and part in data:
            data = data[part]
        elif isinstance(data, list) and isinstance(part, int):
            if part >= len(data):
                return path, False
            data = data[part]
        elif isinstance(data, Mapping) and i == len(parts) - 1:
            return (*path, part), False
        else:
            return path, True
        path = (*path, part)
    return path, False


def _message(problem: Problem, path: FieldPath, data: object) -> str:
    kind, context = problem["type"], problem.get("ctx", {})
    if kind in _SIGNS:
        sign, key = _SIGNS[kind]
        return f"must be {sign} {context[key]:g}, got {shown(problem['input'])}"
    if kind == "missing" and not isinstance(problem["loc"][-1], int):
        node = node_at(path, data)
        return f"is missing{_purpose(node)}"
    if kind == "unexpected_keyword_argument":
        return _unknown(path, data)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _wrong_kind(path, problem["input"], data)
    if kind == "finite_number":
        return f"must be a finite number, got {shown(problem['input'])}"
    if kind in ("string_pattern_mismatch", "string_too_short", "string_too_long"):
        return f"got {shown(problem['input'])}{_purpose(node_at(path, data))}"
    if kind == "too_short" and "items" in (node_at(path, data) or {}):
        return f"needs at least {context['min_length']} elements, got {context['actual_length']}"
    return _wrong_value(path, data)


def _wrong_value(path: FieldPath, data: object) -> str:
    node = node_at(path, data)
    for part in path:
        data = data[part]  # type: ignore[index]
    wanted = "something else" if node is None else type_text(node)
    article = "a " if wanted[0].isalpha() and wanted != "true or false" else ""
    return f"must be {article}{wanted}, got {shown(data)}"


def _purpose(node: Node | None) -> str:
    text = " ".join(str((node or {}).get("description", "")).replace("``", "`").split())
    return f": {text}" if text else ""


def _unknown(path: FieldPath, data: object) -> str:
    node = node_at(path[:-1], data)
    known = list((node or {}).get("properties", {}))
    return f"unknown field{nearest(str(path[-1]), known) or '; known are ' + ', '.join(known)}"


def _wrong_kind(path: FieldPath, value: object, data: object) -> str:
    node = node_at(path, data)
    known = list(kinds(node or {}))
    given = value.get("kind") if isinstance(value, Mapping) else None
    if given is None:
        return f"needs a kind: {either(known)}"
    return f"unknown kind {shown(given)}{nearest(str(given), known)}; there are {', '.join(known)}"


def shown(value: object) -> str:
    """Return a value for a message: short, and without control characters."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
