"""A scenario gets the operator that it asks for, with the habits that it names."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop.errors import SettingError
from teleop.scenario.files import operator_settings as settings
from teleop.scenario.operators.building import operator_of
from teleop.scenario.operators.operator import Briefing, GoalPlace
from teleop.scenario.operators.replay import Replay
from tests.teleop.scenario.operators.unicycle import Unicycle

FAR = GoalPlace((40.0, 0.0), 0.5, way=((40.0, 0.0),))


@pytest.mark.parametrize(
    ("slow", "fast"),
    [
        (settings.Follower(speed=0.2), settings.Follower(speed=0.6)),
        (
            settings.Steering("steering", speed=0.2, lapses=0.0),
            settings.Steering("steering", speed=0.6, lapses=0.0),
        ),
        (
            settings.Careless("careless", speed=0.2, mistakes=0.0),
            settings.Careless("careless", speed=0.6, mistakes=0.0),
        ),
    ],
)
def test_speed_is_the_one_that_is_asked_for(
    slow: settings.Operator, fast: settings.Operator
) -> None:
    gone = []
    for chosen in (slow, fast):
        robot = Unicycle()
        robot.seat(operator_of(chosen, beside=None), Briefing((FAR,), 0))
        robot.run(10.0)
        gone.append(robot.x)
    assert gone[1] / gone[0] == pytest.approx(3.0, rel=0.15)


def test_follower_drives_by_the_topic_and_at_the_rate_that_it_is_given() -> None:
    robot = Unicycle()
    chosen = settings.Follower(interface="cmd_vel", rate=25.0)
    robot.seat(operator_of(chosen, beside=None), Briefing((FAR,), 0))
    robot.run(4.0)
    assert robot.stamps == []
    assert len(robot.commands) == pytest.approx(100, abs=2)


def test_recorded_commands_are_read_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "commands.jsonl").write_text("")
    chosen = settings.Replay("replay", "commands.jsonl")
    assert type(operator_of(chosen, beside=tmp_path)) is Replay


@pytest.mark.parametrize("name", ["../commands.jsonl", "/etc/passwd", "link.jsonl"])
def test_recorded_commands_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "scenario"
    folder.mkdir()
    (tmp_path / "commands.jsonl").write_text("")
    (folder / "link.jsonl").symlink_to(tmp_path / "commands.jsonl")
    with pytest.raises(SettingError, match="not in the scenario file's folder"):
        operator_of(settings.Replay("replay", name), beside=folder)


def test_client_of_ones_own_is_no_operator_of_the_library() -> None:
    with pytest.raises(SettingError, match="--client"):
        operator_of(settings.Client("client"), beside=None)
