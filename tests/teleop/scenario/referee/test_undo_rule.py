"""What an undo goes back to, by a rule that is fed with ticks made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.pipeline.event_queue import PLACED_ANEW
from teleop.robot.inbox import Undo
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.rules.rule import RunFacts
from teleop.scenario.referee.rules.undo import UndoUndoes
from teleop.scenario.referee.rules.wire_facts import WireFacts
from tests.teleop.scenario.referee.ticks import Ticks

NOTHING = Cloud(np.zeros((0, 3)), np.zeros((0, 3)), "nothing")
FOUND = (f"{PLACED_ANEW}: explains 59% of the sweeps on the way here",)


@pytest.fixture
def rule() -> UndoUndoes:
    return UndoUndoes(RunFacts(Scenario(1, "one"), WireFacts(lambda: 0), NOTHING, 0.7, 2.0, 1.0))


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
