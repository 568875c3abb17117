"""Whether a robot moves as it is commanded, by a rule that is fed with ticks made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.rules.motion import MovesAsTold
from teleop.scenario.referee.rules.rule import RunFacts
from teleop.scenario.referee.rules.wire_facts import WireFacts
from tests.teleop.scenario.referee.ticks import Ticks

NOTHING = Cloud(np.zeros((0, 3)), np.zeros((0, 3)), "nothing")


@pytest.mark.parametrize(
    ("tilt", "touching", "broken"), [(0.0, [], True), (0.3, [], False), (0.0, ["wall"], False)]
)
def test_robot_that_stands_against_its_command_breaks_the_rule_unless_held_or_on_a_bank(
    tilt: float, touching: list[str], broken: bool
) -> None:
    rule = MovesAsTold(RunFacts(Scenario(1, "one"), WireFacts(lambda: 0), NOTHING, 0.7, 2.0, 1.0))
    ticks = Ticks()
    said = [rule.take(ticks.tick(command=0.4, tilt=tilt, touching=touching)) for _ in range(60)]
    assert any(said) is broken
