"""Which alarms follow from what is known, by the rules that the console page follows too."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from teleop.operator.operating_data import operating_data
from teleop.operator.words import Fact, Facts, filled, known


class Severity(IntEnum):
    """How urgent a notice is; greater is worse."""

    CALM = 0
    """Nothing to do."""
    INFO = 1
    """Worth a note."""
    STALE = 2
    """What is shown is old."""
    WARNING = 3
    """Something is not as it should be."""
    ALARM = 4
    """The robot is stopped, hurt or lost."""


@dataclass(frozen=True, slots=True)
class Notice:
    """One thing that an operator should know now."""

    severity: Severity
    """How urgent it is."""
    text: str
    """It, in few words."""


@dataclass(frozen=True, slots=True)
class Alarm(Notice):
    """A notice by one of the rules."""

    kind: str
    """Which rule it follows from."""
    group: str
    """Alarms of which it is the only one; its kind if it has none."""


def alarms_of(facts: Facts, active: Collection[str] = ()) -> tuple[Alarm, ...]:
    """Return the alarms, the gravest first.

    Args:
        facts: What is known.
        active: Kinds that are active already; some end a little later than they begin.
    """
    found: dict[str, Alarm] = {}
    for rule in operating_data("alarms")["rules"]:
        kind, group = rule["kind"], rule.get("group", rule["kind"])
        if group not in found and all(
            _meets(condition, facts.get(condition["fact"]), kind in active)
            for condition in rule["when"]
        ):
            severity = Severity[rule["severity"].upper()]
            found[group] = Alarm(severity, filled(rule["words"], facts), kind, group)
    return tuple(sorted(found.values(), key=lambda alarm: -alarm.severity))


def _meets(condition: Mapping[str, Any], value: Fact, active: bool) -> bool:
    if value is None or not known(value):
        return False
    if "is" in condition:
        return value in condition["is"]
    if "above" in condition:
        limit = condition.get("ends", condition["above"]) if active else condition["above"]
        return bool(float(value) > limit)
    return "below" not in condition or bool(float(value) < condition["below"])
