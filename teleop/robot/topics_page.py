"""The page ``docs/topics.md``, made from the table of topics.

``python -m teleop.robot.topics_page > docs/topics.md`` writes it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

from teleop.robot.cameras.camera_topics import CAMERA_TOPICS, InfoTopic, PictureTopic
from teleop.robot.runs.run_interfaces import DELETE, KEEP, START, STATE, STOP
from teleop.robot.topics.arm_topics import (
    ARM_ACTIONS,
    ARM_INFO,
    ARM_INPUTS,
    ARM_OUTPUTS,
    ARM_SERVICES,
)
from teleop.robot.topics.topic_table import (
    ACTIONS,
    ANSWERS,
    INPUTS,
    LATCHED,
    OUTPUTS,
    PLAYGROUND_SERVICES,
    SERVICES,
    SHARE_SERVICES,
    SIMULATION_ACTION,
    SIMULATION_SERVICES,
    Interface,
    Topic,
)
from teleop.robot.video.video_interfaces import VIDEO_SERVICES, VIDEO_TOPICS


def markdown() -> str:
    """Return the page."""
    once = [f"| `{i.name}` | `{i.type}` | once | {i.description} |" for i in LATCHED]
    answers = [
        f"| `{i.name}` | `{i.type}` | on events | {i.description} |" for i in (*ANSWERS, STATE)
    ]
    arm_once = f"| `{ARM_INFO.name}` | `{ARM_INFO.type}` | once | {ARM_INFO.description} |"
    lines = [
        "# Topics",
        "",
        "*Reference.* Made from the tables `topics/topic_table.py`, `topics/arm_topics.py` and `cameras/camera_topics.py` of `teleop/robot`:",
        "`python -m teleop.robot.topics_page`. Rates are of robot time. Clients cannot publish on the",
        "robot's topics.",
        "",
        "## From the robot",
        "",
        *_table("topic | type | rate | content", [*_outputs(OUTPUTS), *answers, *once]),
        "## From its camera",
        "",
        "With `farsteer serve --camera NAME` ([Cameras](cameras.md#on-a-served-robot)); nothing is drawn or encoded unless somebody",
        "subscribes. Rates are those of the camera.",
        "",
        *_table("topic | type | content", _rows((*CAMERA_TOPICS, *VIDEO_TOPICS))),
        *_table("service | type | effect", _rows(VIDEO_SERVICES)),
        "[Video](video.md) has the addresses of streams and photographs.",
        "",
        "## To the robot",
        "",
        *_table("topic | type | content", _rows(INPUTS)),
        "## Services",
        "",
        *_table("service | type | effect", _rows((*SERVICES, START, STOP, DELETE, KEEP))),
        "Only with `farsteer serve --lan`:",
        "",
        *_table("service | type | effect", _rows(SHARE_SERVICES)),
        "Only with `farsteer serve --playground`, see [the playground](playground.md):",
        "",
        *_table("service | type | effect", _rows(PLAYGROUND_SERVICES)),
        "## Actions",
        "",
        *_table("action | type | effect", _rows(ACTIONS)),
        "## With an arm",
        "",
        "Only with `farsteer serve --arm`. `/tf` then has the arm's links as well, `/robot_description` its shapes and masses,",
        "and `/joint_states` a message of the arm's joints before that of the wheels: subscribe with a `queue_length` of 2",
        "for both. The one who drives moves the arm; each needs its own deadman.",
        "",
        *_table("topic from the robot | type | rate | content", [*_outputs(ARM_OUTPUTS), arm_once]),
        *_table("topic to the robot | type | content", _rows(ARM_INPUTS)),
        *_table("action | type | effect", _rows(ARM_ACTIONS)),
        *_table("service | type | effect", _rows(ARM_SERVICES)),
        "## For the referee",
        "",
        "`simulation_interfaces` 2.1, only where a robot was started for it and only with the referee's token. What",
        "is not offered answers `RESULT_FEATURE_UNSUPPORTED`.",
        "",
        *_table("service | type | effect", _rows((*SIMULATION_SERVICES, SIMULATION_ACTION))),
    ]
    return "\n".join(lines)


def _table(head: str, rows: Iterable[str]) -> list[str]:
    """Return the lines of a table, and an empty one behind it."""
    return [f"| {head} |", f"|{'---|' * (head.count('|') + 1)}", *rows, ""]


def _outputs(topics: Iterable[Topic[Any]]) -> list[str]:
    return [
        f"| `{t.name}` | `{t.type}` | {_rate(t)}{', latched' if t.latch else ''} | {t.description} |"
        for t in topics
    ]


def _rate(topic: Topic[Any]) -> str:
    return f"{50 / topic.every:g} Hz" if topic.every else "on events"


def _rows(interfaces: Iterable[Interface | PictureTopic | InfoTopic]) -> list[str]:
    return [f"| `{i.name}` | `{i.type}` | {i.description} |" for i in interfaces]


if __name__ == "__main__":
    sys.stdout.write(markdown())
