"""The page ``docs/topics.md``, made from the table of topics.

``python -m teleop.robot.topics.topics_page > docs/topics.md`` writes it.
"""

from __future__ import annotations

import sys
from typing import Any

from teleop.robot.topics.topic_table import (
    INPUTS,
    LATCHED,
    OUTPUTS,
    SERVICES,
    Interface,
    Topic,
)


def markdown() -> str:
    """Return the page."""
    outputs = [
        f"| `{t.name}` | `{t.type}` | {_rate(t)}{', latched' if t.latch else ''} | {t.description} |"
        for t in OUTPUTS
    ]
    once = [f"| `{i.name}` | `{i.type}` | once | {i.description} |" for i in LATCHED]
    lines = [
        "# Topics",
        "",
        "This page is made from the table in `teleop/robot/topics/topic_table.py`:",
        "`python -m teleop.robot.topics.topics_page`. Rates are of robot time. Clients cannot publish on the",
        "robot's topics.",
        "",
        "## From the robot",
        "",
        "| topic | type | rate | content |",
        "|---|---|---|---|",
        *outputs,
        *once,
        "",
        "## To the robot",
        "",
        "| topic | type | content |",
        "|---|---|---|",
        *_rows(INPUTS),
        "",
        "## Services",
        "",
        "| service | type | effect |",
        "|---|---|---|",
        *_rows(SERVICES),
        "",
    ]
    return "\n".join(lines)


def _rate(topic: Topic[Any]) -> str:
    return f"{50 / topic.every:g} Hz" if topic.every else "on events"


def _rows(interfaces: tuple[Interface, ...]) -> list[str]:
    return [f"| `{i.name}` | `{i.type}` | {i.description} |" for i in interfaces]


if __name__ == "__main__":
    sys.stdout.write(markdown())
