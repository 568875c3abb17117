"""How fast a robot may be, by a rule that is fed with ticks made by hand."""

from __future__ import annotations

import numpy as np

from localization.maps.cloud import Cloud
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.rules.command_in_force import CommandIsLimited
from teleop.scenario.referee.rules.rule import RunFacts
from teleop.scenario.referee.rules.wire_facts import WireFacts
from tests.teleop.scenario.referee.ticks import Ticks

NOTHING = Cloud(np.zeros((0, 3)), np.zeros((0, 3)), "nothing")


def test_robot_beyond_its_speed_breaks_the_rule_unless_something_has_just_pushed_it() -> None:
    rule = CommandIsLimited(
        RunFacts(Scenario(1, "one"), WireFacts(lambda: 0), NOTHING, 0.7, 2.0, 1.0)
    )
    ticks = Ticks()
    assert rule.take(ticks.tick(speed=0.8)) is None
    assert rule.take(ticks.tick(speed=1.1)) == "it drives at 1.10 m/s"
    assert rule.take(ticks.tick(speed=1.1, touching=["door"])) is None
    later = [rule.take(ticks.tick(speed=1.1)) for _ in range(26)]
    assert later == [None] * 25 + ["it drives at 1.10 m/s"]


def test_robot_that_drops_may_be_as_fast_as_its_fall_makes_it_and_no_faster() -> None:
    rule = CommandIsLimited(
        RunFacts(Scenario(1, "one"), WireFacts(lambda: 0), NOTHING, 0.7, 2.0, 1.0)
    )
    ticks = Ticks()
    assert rule.take(ticks.tick(speed=0.7, height=0.2)) is None
    # 1.25 * 0.7 m/s and a fall of 0.05 m: 1.322 m/s.
    assert rule.take(ticks.tick(speed=1.3, height=0.15)) is None
    assert rule.take(ticks.tick(speed=1.34, height=0.15)) == "it drives at 1.34 m/s"
    later = [rule.take(ticks.tick(speed=1.0, height=0.15)) for _ in range(50)]
    assert later[:47] == [None] * 47
    assert later[47] == "it drives at 1.00 m/s"


def test_command_beyond_the_speed_breaks_the_rule_even_as_something_pushes() -> None:
    rule = CommandIsLimited(
        RunFacts(Scenario(1, "one"), WireFacts(lambda: 0), NOTHING, 0.7, 2.0, 1.0)
    )
    tick = Ticks().tick(command=0.8, touching=["door"])
    assert rule.take(tick) == "the command in force is 0.800 m/s, 0.000 rad/s"
