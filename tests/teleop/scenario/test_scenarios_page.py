"""The page on scenarios: its files can be read, and its tables are complete."""

import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from teleop.scenario.files.reading import scenario_from
from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.robot_process import RobotEvent, RobotProcess, TrueState
from teleop.scenario.run_files import RUN_FILES
from teleop.scenario.scenarios_page import markdown
from teleop.scenario.session import client_access

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/scenarios.md").read_text(encoding="utf-8")


def column(head: str) -> list[str]:
    """Return what stands in backticks in the first column of the table with a head."""
    lines = PAGE.splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith(f"| {head} |"))
    found: list[str] = []
    for line in lines[begin + 2 :]:
        if not line.startswith("|"):
            break
        found += re.findall(r"`([^`]+)`", line.split("|")[1])
    return found


@pytest.mark.parametrize("text", re.findall(r"^```toml\n(.*?)^```$", PAGE, re.M | re.S))
def test_every_scenario_of_the_page_can_be_read(text: str) -> None:
    assert scenario_from(tomllib.loads(text)).name


def test_all_files_of_a_run_are_listed() -> None:
    of_sim = ["run.png", "summary.json"]
    assert sorted([*column("file"), *of_sim]) == sorted(RUN_FILES)


def test_all_exit_statuses_are_listed() -> None:
    rows = re.findall(r"^\| (\d) \| `(\w+)` \|", PAGE, re.M)
    assert rows == [(str(int(s)), s.name.lower()) for s in ExitStatus]


def test_all_variables_that_a_client_finds_are_listed() -> None:
    source = Path(client_access.__file__).read_text(encoding="utf-8")
    assert sorted(column("variable")) == sorted(set(re.findall(r'"(FARSTEER_\w+)"', source)))


def test_all_members_of_a_robot_in_a_test_are_listed() -> None:
    named = {member.partition("(")[0] for member in column("member")}
    methods = {name for name in vars(RobotProcess) if not name.startswith("_")}
    assert named == methods | {"url", "host", "port", "token"}


def test_all_fields_of_the_true_state_and_of_an_event_are_listed_in_their_order() -> None:
    assert column("field of the true state") == [field.name for field in fields(TrueState)]
    (events,) = re.findall(r"^\| `events\(\)` \| (.*) \|$", PAGE, re.M)
    assert re.findall(r"`(\w+)`", events) == [field.name for field in fields(RobotEvent)]


def test_sheet_of_the_scenarios_of_the_project_is_made_of_their_files() -> None:
    sheet = (ROOT / "docs/sheets/scenarios.md").read_text(encoding="utf-8")
    again = "run: python -m teleop.scenario.scenarios_page > docs/sheets/scenarios.md"
    assert sheet == markdown(), again
