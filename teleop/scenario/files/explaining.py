"""Explanation of the fields of scenario files, made from their schema."""

from __future__ import annotations

import re
from collections.abc import Sequence

from localization.cli.terminal import fitted
from teleop.errors import SettingError
from teleop.scenario.files.fields import FieldFacts, facts, schema
from teleop.scenario.files.problems import nearest


def explanation(name: str = "") -> list[str]:
    """Return lines that explain a field and what it contains.

    Args:
        name: Name of a field (``mission.goals.within``), of a table (``limits``) or of a kind (``kidnap``,
            ``fault.kidnap``); everything, unless given.

    Raises:
        SettingError: If there is no such field; the message has similar ones.
    """
    every = list(facts(schema()))
    chosen = every if not name else _chosen(every, name)
    lines: list[str] = []
    for field in chosen:
        if _is_head(field) and lines:
            lines.append("")
        lines += _lines(field)
    return lines


def field_names() -> list[str]:
    """Return all names that can be explained."""
    return sorted(
        {n for field in facts(schema()) for n in (_plain(field.name), _kind(field.name)) if n}
    )


def _chosen(every: Sequence[FieldFacts], name: str) -> list[FieldFacts]:
    wanted = _plain(name)
    kind = wanted.rpartition(".")[2]
    for i, field in enumerate(every):
        if _kind(field.name) == kind and _plain(field.name).startswith(wanted.rpartition(".")[0]):
            return [field, *_until_next_head(every[i + 1 :], _plain(field.name))]
    found = [f for f in every if _within(_plain(f.name), wanted)]
    if not found:
        # The last part alone is enough, where someone knows that there is ``stopping_time``.
        found = [f for f in every if _plain(f.name).rpartition(".")[2] == wanted]
    if not found:
        raise SettingError(
            f"a scenario has no field {name!r}{nearest(wanted, field_names())}"
            " (`farsteer scenario explain` lists all)"
        )
    return found


def _until_next_head(rest: Sequence[FieldFacts], table: str) -> list[FieldFacts]:
    found = []
    for field in rest:
        here = _plain(field.name)
        if not _within(here, table) or (_kind(field.name) and here == table):
            break
        found.append(field)
    return found


def _within(name: str, table: str) -> bool:
    return name == table or name.startswith(f"{table}.")


def _plain(name: str) -> str:
    """Return the name of a field without indices and kinds, which nobody types."""
    return re.sub(r"\[\w*\]", "", name.partition(",")[0])


def _kind(name: str) -> str:
    found = re.search(r'kind = "(\w+)"', name)
    return found[1] if found else ""


def _is_head(field: FieldFacts) -> bool:
    return field.type in ("table", "list of tables")


def _lines(field: FieldFacts) -> list[str]:
    """Return the name and what may be written in one line, and the sentence below."""
    if _is_head(field):
        return fitted(f"{field.name}: {field.text}")
    parts = [field.type, field.bounds, field.unit and f"[{field.unit}]"]
    what = " ".join(filter(None, parts))
    default = f"default {field.default}" if field.default not in ("", "required") else field.default
    head = ", ".join(filter(None, [what, default]))
    return fitted(f"  {field.name:24}  {head}", f"      {field.text}")
