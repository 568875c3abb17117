"""Rules of the referee that are fed with ticks made by hand: how fast, as commanded, and what an undo goes back to."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.pipeline.event_queue import PLACED_ANEW
from teleop.robot.inbox import Undo
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.rules.command_in_force import CommandIsLimited
from teleop.scenario.referee.rules.motion import MovesAsTold
from teleop.scenario.referee.rules.rule import RunFacts
from teleop.scenario.referee.rules.undo import UndoUndoes
from teleop.scenario.referee.rules.wire_facts import WireFacts
from tests.teleop.scenario.referee.ticks import Ticks

NOTHING = Cloud(np.zeros((0, 3)), np.zeros((0, 3)), "nothing")
FACTS = RunFacts(Scenario(1, "one"), WireFacts(lambda: 0), NOTHING, 0.7, 2.0, 1.0)


@pytest.mark.parametrize(
    ("tilt", "touching", "broken"), [(0.0, [], True), (0.3, [], False), (0.0, ["wall"], False)]
)
def test_robot_that_stands_against_its_command_breaks_the_rule_unless_held_or_on_a_bank(
    tilt: float, touching: list[str], broken: bool
) -> None:
    rule = MovesAsTold(FACTS)
    ticks = Ticks()
    said = [rule.take(ticks.tick(command=0.4, tilt=tilt, touching=touching)) for _ in range(60)]
    assert any(said) is broken


def test_robot_beyond_its_speed_breaks_the_rule_unless_something_has_just_pushed_it() -> None:
    rule = CommandIsLimited(FACTS)
    ticks = Ticks()
    assert rule.take(ticks.tick(speed=0.8)) is None
    assert rule.take(ticks.tick(speed=1.1)) == "it drives at 1.10 m/s"
    assert rule.take(ticks.tick(speed=1.1, touching=["door"])) is None
    later = [rule.take(ticks.tick(speed=1.1)) for _ in range(26)]
    assert later == [None] * 25 + ["it drives at 1.10 m/s"]


def test_robot_that_drops_may_be_as_fast_as_its_fall_makes_it_and_no_faster() -> None:
    rule = CommandIsLimited(FACTS)
    ticks = Ticks()
    assert rule.take(ticks.tick(speed=0.7, height=0.2)) is None
    # 1.25 * 0.7 m/s and a fall of 0.05 m: 1.322 m/s.
    assert rule.take(ticks.tick(speed=1.3, height=0.15)) is None
    assert rule.take(ticks.tick(speed=1.34, height=0.15)) == "it drives at 1.34 m/s"
    later = [rule.take(ticks.tick(speed=1.0, height=0.15)) for _ in range(50)]
    assert later[:47] == [None] * 47
    assert later[47] == "it drives at 1.00 m/s"


def test_command_beyond_the_speed_breaks_the_rule_even_as_something_pushes() -> None:
    rule = CommandIsLimited(FACTS)
    tick = Ticks().tick(command=0.8, touching=["door"])
    assert rule.take(tick) == "the command in force is 0.800 m/s, 0.000 rad/s"


FOUND = (f"{PLACED_ANEW}: explains 59% of the sweeps on the way here",)


@pytest.fixture
def rule() -> UndoUndoes:
    return UndoUndoes(FACTS)


def test_undo_of_the_first_pose_must_leave_none(rule: UndoUndoes) -> None:
    ticks = Ticks()
    assert rule.take(ticks.tick(known=False)) is None
    assert rule.take(ticks.tick(reasons=FOUND)) is None
    kept = rule.take(ticks.tick(inbox=[Undo("anna")]))
    assert kept == "after an undo of its first pose it still has one"


def test_search_that_finds_the_robot_close_to_its_pose_is_what_the_next_undo_undoes(
    rule: UndoUndoes,
) -> None:
    ticks = Ticks()
    assert rule.take(ticks.tick()) is None
    assert rule.take(ticks.tick(guess=(5.0, 0.0, 0.0), reasons=FOUND)) is None
    assert rule.take(ticks.tick(guess=(5.2, 0.0, 0.0), reasons=FOUND)) is None
    assert rule.take(ticks.tick(guess=(5.0, 0.0, 0.0), inbox=[Undo("anna")])) is None


def test_undo_that_leads_elsewhere_breaks_the_rule(rule: UndoUndoes) -> None:
    ticks = Ticks()
    assert rule.take(ticks.tick()) is None
    assert rule.take(ticks.tick(guess=(5.0, 0.0, 0.0))) is None
    gone = rule.take(ticks.tick(guess=(5.0, 0.0, 0.0), inbox=[Undo("anna")]))
    assert gone == "after an undo it is 5.00 m from where it was"
