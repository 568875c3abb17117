"""The judge of the guard's campaign: what was touched, and whose doing it was."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from benchmarks.guard import campaign, physics, wire
from benchmarks.guard.judge import Contacts, Outcome, Plan
from benchmarks.guard.resumed import resumed
from robot_sim import World, WorldOptions
from robot_sim.worlds.loading import parse_world
from tests.robot_sim.conftest import ROOM

SECOND = 1_000_000_000
LEFT, RIGHT = (f"spare_person_1_{side}_leg" for side in ("left", "right"))


def world() -> World:
    return parse_world(ROOM, name="room", options=WorldOptions(spare_people=1))


def test_person_with_two_legs_is_one_contact_until_two_seconds_without_a_touch() -> None:
    judge = Contacts(world())
    for tick, touching in enumerate([(LEFT,), (LEFT, RIGHT), (), (RIGHT,)]):
        judge.take(touching, tick * SECOND // 50, 0.3, 0.0)
    assert judge.kinds == {"met": 1}
    judge.take((), SECOND, 0.0, 0.0)
    judge.take((RIGHT,), 4 * SECOND, 0.01, 0.0)
    assert judge.kinds == {"met": 1, "walked into": 1}


def test_wall_that_a_person_pushed_the_robot_into_is_not_its_own_doing() -> None:
    room = world()
    wall = "east_0"
    judge = Contacts(room)
    judge.take((wall,), 0, 0.1, 0.0)
    assert judge.kinds == {"seen": 1}
    judge.take((), SECOND, 0.1, 1.0)
    judge.take((LEFT, wall), 2 * SECOND, 0.1, 1.0)
    judge.take((), 3 * SECOND, 0.1, 1.2)
    judge.take((wall,), 4 * SECOND, 0.1, 1.4)
    assert judge.kinds["pushed"] == 2
    judge.take((), 5 * SECOND, 0.1, 1.6)
    judge.take((wall,), 6 * SECOND, 0.1, 1.6)
    assert judge.kinds["seen"] == 2


def test_wall_that_the_robot_leans_on_is_one_contact_though_it_trembles() -> None:
    judge = Contacts(world())
    for tick in range(0, 200, 2):
        judge.take(("east_0",), tick * SECOND // 50, 0.0, 0.0)
        judge.take((), (tick + 1) * SECOND // 50, 0.0, 0.0)
    assert judge.kinds == {"seen": 1}
    assert judge.names == {"east_0": 1}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(
    "way",
    [
        pytest.param(physics, id="in process"),
        pytest.param(wire, id="over the wire", marks=pytest.mark.slow),
    ],
)
def test_driver_who_steers_for_the_wall_meets_it_only_without_the_guard(way: ModuleType) -> None:
    with_guard, without = (
        way.drive(Plan("office", False, "at the wall", 5, guarded), 20.0)
        for guarded in (True, False)
    )
    assert (with_guard.seen, with_guard.way > 1.0, with_guard.stopped > 1.0) == (0, True, True)
    assert (without.seen > 0, without.way > 1.0, without.stopped) == (True, True, 0.0)


@pytest.mark.slow
def test_campaign_drives_only_what_its_file_does_not_hold(tmp_path: Path) -> None:
    file, drives = tmp_path / "drives.jsonl", campaign.plan(120.0)
    first = resumed(file, drives, _short, Outcome)
    assert {(o.seed, o.guarded) for o in first} == {(0, True), (0, False)}
    lines = file.read_text()
    assert len(resumed(file, campaign.plan(240.0), _short, Outcome)) == 4
    assert file.read_text().startswith(lines)


@pytest.mark.parametrize("words", [[], ["drives", "fast"], ["drives", "wire", "120"]])
def test_words_that_are_no_part_of_the_campaign_are_answered_with_those_that_are(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert campaign.main(words) == 2
    assert "FOLDER [SECONDS | wire | operators | cost]" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def _short(plan: Plan) -> Outcome:
    return physics.drive(plan, 0.1)
