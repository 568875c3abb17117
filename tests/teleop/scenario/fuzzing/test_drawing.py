"""Drawn sessions: a number stands for one session, which a scenario file can hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.files.writing import scenario_text
from teleop.scenario.fuzzing.drawing import SCENES, draw_session
from teleop.scenario.session.scene import checked_scene_of


def drawn(numbers: range) -> list[Scenario]:
    """Return the sessions of some numbers, as far as they stand for one."""
    return [session for number in numbers if (session := draw_session(number)) is not None]


def test_number_always_stands_for_the_same_session() -> None:
    assert draw_session(7) == draw_session(7)


@pytest.mark.slow
def test_most_numbers_stand_for_a_session_and_no_two_for_the_same() -> None:
    sessions = drawn(range(60))
    assert len(sessions) > 50
    assert len(set(sessions)) == len(sessions)


@pytest.mark.slow
def test_sessions_use_all_scenes_operators_and_faults() -> None:
    sessions = drawn(range(150))
    assert {session.world.scene for session in sessions} == set(SCENES)
    assert {s.operator.kind for s in sessions} == {"follower", "steering", "careless", "hand"}
    arms = [s for s in sessions if s.world.arm]
    assert 10 < len(arms) < 40
    assert {s.operator.kind for s in arms} == {"hand"}
    assert {fault.kind for session in sessions for fault in session.fault} == {
        *("link", "operator_killed", "kidnap", "wheel_slip", "scanner_dead", "scanner_dirty"),
        *("wrong_hint", "estop", "clock_step", "door_closed"),
    }
    assert any(session.second is not None for session in sessions)


@pytest.mark.slow
def test_drawn_session_survives_its_scenario_file(tmp_path: Path) -> None:
    for number, session in enumerate(drawn(range(30))):
        path = tmp_path / f"{number}.toml"
        path.write_text(scenario_text(session), encoding="utf-8")
        assert read_scenario(path) == session


@pytest.mark.long
@pytest.mark.slow
def test_drawn_sessions_can_be_run() -> None:
    for session in drawn(range(3)):
        checked_scene_of(session)
