"""A run from its first tick to its end: the same bits each time, its limit of time, and what ends it."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from localization.evaluation.tum_file import read_tum
from localization.types import SECOND, Hint
from robot_sim import PhysicsError
from teleop.robot.inbox import PoseHint
from teleop.robot.topics.topic_table import GROUND_TRUTH, OUTPUTS
from teleop.scenario.operators.operator import Briefing
from teleop.scenario.operators.wire import Answer, Wire
from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.session.session import Session
from tests.teleop.scenario.session.support import (
    Forward,
    Listener,
    digests,
    outcome,
    run,
    scenario,
)
from tests.teleop.support import ROOT

WORLDS: dict[str, dict[str, Any]] = {
    "office": {"scene": "office", "world": {"alive": True, "rearranged": 3, "firmware": True}},
    "glasshouse": {"scene": "glasshouse", "world": {"effects": True, "sun": 0.5}},
}


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("world", WORLDS)
def test_same_scenario_and_seed_give_the_same_bits_and_another_seed_others(world: str) -> None:
    chosen = scenario(seed=4, **WORLDS[world])
    first, second = run(chosen, Forward(), ticks=30), run(chosen, Forward(), ticks=30)
    assert digests(first.ticks) == digests(second.ticks)
    assert first.sha256 == second.sha256
    other = run(replace(chosen, seed=5), Forward(), ticks=30)
    assert other.sha256 != first.sha256


ELSEWHERE = """
from tests.teleop.scenario.session.support import Forward, run, scenario
faults = [{"kind": "wrong_hint", "at": 0.2}, {"kind": "kidnap", "at": 0.4}]
print(run(scenario(*faults, seed=4, world={"alive": True}), Forward(), ticks=30).sha256)
"""


@pytest.mark.long
@pytest.mark.process
def test_two_processes_give_the_same_bits_whatever_the_order_of_their_sets() -> None:
    digests = set()
    for hash_seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", ELSEWHERE],
            env={**os.environ, "PYTHONHASHSEED": hash_seed},
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        )
        digests.add(done.stdout.strip())
    assert len(digests) == 1
    assert len(digests.pop()) == 64


@pytest.mark.parametrize("seed", [0, 2**63 - 1])
def test_smallest_and_largest_seed_run(seed: int) -> None:
    chosen = scenario(
        {"kind": "kidnap", "at": 0.1}, seed=seed, start={"known": "about", "off": 0.5}
    )
    assert run(chosen, ticks=10).session.ending == "enough"


@pytest.mark.parametrize(
    ("limit", "ticks"), [(1e-9, 1), (0.02, 1), (0.020000001, 2), (0.5, 25), (0.51, 26)]
)
def test_run_ends_with_the_first_tick_that_reaches_the_time_limit(limit: float, ticks: int) -> None:
    ended = run(scenario(time=limit))
    assert len(ended.ticks) == ended.session.ticks == ticks
    assert ended.session.ending == "the time of the run is over"
    assert outcome(ended).status is ExitStatus.PASSED


def test_goal_that_is_not_reached_ends_with_the_time() -> None:
    ended = run(scenario(time=0.1, goals=[{"at": "east_lobby"}]))
    assert ended.session.ending == "time is up"
    assert outcome(ended).status is ExitStatus.MISSED


def test_goals_at_the_start_are_reached_at_once_one_a_tick() -> None:
    start = {"at": [2.5, 4.0], "within": 0.3}
    ended = run(scenario(goals=[start, start, start]))
    assert ended.session.ending == "all goals are reached"
    assert len(ended.ticks) == 3
    assert outcome(ended).status is ExitStatus.PASSED


def test_goal_that_is_reached_with_the_last_tick_counts() -> None:
    start = {"at": [2.5, 4.0], "within": 0.3, "stay": 0.08}
    assert run(scenario(time=0.1, goals=[start])).session.ending == "all goals are reached"
    assert run(scenario(time=0.08, goals=[start])).session.ending == "time is up"


def test_session_that_is_over_ticks_no_more() -> None:
    ended = run(scenario(time=0.1))
    assert ended.session.tick() is None
    ended.session.end("again")
    assert ended.session.ending == "the time of the run is over"
    assert ended.session.stamp == SECOND // 10


# What the robot knows of its start


def given(**start: Any) -> Hint | None:
    begun = run(scenario(start={"at": [10.0, 4.0, 30.0], **start}, seed=9), ticks=1)
    hints = [m for m in begun.ticks[0].inbox if isinstance(m, PoseHint)]
    assert all(m.client == "" for m in hints)
    assert len(hints) <= 1
    return hints[0].hint if hints else None


def test_robot_knows_exactly_where_it_starts() -> None:
    hint = given(known="exactly")
    assert hint is not None
    assert hint.map_from_base.position[:2].tolist() == pytest.approx([10.0, 4.0])
    assert hint.map_from_base.yaw == pytest.approx(0.5235987755982988)


def test_robot_is_given_a_pose_that_is_as_wrong_as_the_scenario_says() -> None:
    hint = given(known="about", off=1.5, turned=20.0)
    assert hint is not None
    dx, dy = (hint.map_from_base.position[:2] - [10.0, 4.0]).tolist()
    assert (dx**2 + dy**2) ** 0.5 == pytest.approx(1.5)
    turned = abs(hint.map_from_base.yaw - 0.5235987755982988)
    assert turned == pytest.approx(0.3490658503988659)
    assert hint.covariance[0, 0] == pytest.approx(0.75**2)


def test_robot_that_knows_nothing_gets_no_hint() -> None:
    assert given(known="nothing") is None


def test_hint_of_the_start_is_no_hint_of_an_operator() -> None:
    assert outcome(run(scenario(), ticks=2)).figures["hints"] == 0.0


# Ground truth


class Cheat(Listener):
    """Advertises the topics of the truth, to have them published; asks which topics there are."""

    names: tuple[str, ...] = ()

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        wire.call("/rosapi/topics", on_answer=self._take_names)
        for topic in TRUTH:
            wire.send({"op": "advertise", "topic": topic, "type": TRUTH[topic]})
        super().begin(wire, briefing)

    def _take_names(self, answer: Answer) -> None:
        self.names = tuple(answer.values["topics"])


TRUTH = {topic.name: topic.type for topic in OUTPUTS if topic.name in GROUND_TRUTH}


def test_truth_is_neither_advertised_nor_published_even_if_a_client_advertises_it() -> None:
    cheat, other = Cheat(**TRUTH), Listener(**TRUTH)
    run(scenario(), cheat, other, Forward(), ticks=25)
    assert "/odom" in cheat.names
    assert not set(cheat.names) & GROUND_TRUTH
    assert cheat.heard == other.heard == []


@pytest.mark.slow
def test_client_that_may_see_the_truth_gets_it() -> None:
    listener = Listener(**TRUTH)
    run(scenario(operator={"kind": "client", "truth": True}), listener, ticks=10)
    assert listener.heard


# Physics that fails


def fail_at(session: Session, ticks: int) -> None:
    step = session.simulation.step

    def failing() -> Any:
        if session.ticks == ticks:
            raise PhysicsError("the robot left the world at 1e9 m/s")
        return step()

    session.simulation.step = failing  # type: ignore[method-assign]


@pytest.mark.parametrize("ticks", [0, 10])
def test_physics_that_fails_ends_the_run_and_keeps_what_was_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ticks: int
) -> None:
    begin = Session.tick

    def tick(self: Session) -> Any:
        if self.ticks == 0 and "step" not in vars(self.simulation):
            fail_at(self, ticks)
        return begin(self)

    monkeypatch.setattr(Session, "tick", tick)
    ended = run(scenario(), Forward(), folder=tmp_path / "run")
    assert (
        ended.session.ending == "the physics became unstable: the robot left the world at 1e9 m/s"
    )
    assert len(ended.ticks) == ticks
    assert outcome(ended).status is ExitStatus.MISSED
    assert (tmp_path / "run" / "commands.jsonl").stat().st_size > 0
    if ticks:
        assert len(read_tum(tmp_path / "run" / "truth.tum")) == ticks
    else:
        assert (tmp_path / "run" / "truth.tum").is_file()
