"""The table of topics: the page made of it is up to date, and its types are known."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from teleop.robot.cameras.camera_topics import CAMERA_TOPICS
from teleop.robot.topics.arm_topics import (
    ARM_ACTIONS,
    ARM_INFO,
    ARM_INPUTS,
    ARM_OUTPUTS,
    ARM_SERVICES,
)
from teleop.robot.topics.topic_table import INPUTS, LATCHED, OUTPUTS, SERVICES
from teleop.robot.topics_page import markdown
from teleop.ros_types import registry

ROOT = Path(__file__).resolve().parents[4]
REGISTRY = registry()
TABLE = (*OUTPUTS, *INPUTS, *LATCHED, *CAMERA_TOPICS, *ARM_OUTPUTS, *ARM_INPUTS, ARM_INFO)
TOPICS = [(t.name, t.type) for t in TABLE]


def test_page_of_the_docs_is_what_the_table_says() -> None:
    page = (ROOT / "docs" / "topics.md").read_text(encoding="utf-8")
    assert page == markdown(), "run: python -m teleop.robot.topics_page > docs/topics.md"


def test_types_of_all_topics_services_and_actions_are_known() -> None:
    assert [REGISTRY[kind].name for _, kind in TOPICS] == [kind for _, kind in TOPICS]
    for service in (*SERVICES, *ARM_SERVICES):
        assert REGISTRY.service(service.type).name == service.type
    for action in ARM_ACTIONS:
        assert REGISTRY.action(action.type).name == action.type


def test_no_name_is_taken_twice() -> None:
    names = Counter([name for name, _ in TOPICS] + [s.name for s in SERVICES])
    assert names.most_common(1)[0][1] == 1


def test_rates_divide_the_second() -> None:
    assert all(50 % topic.every == 0 for topic in OUTPUTS if topic.every)
