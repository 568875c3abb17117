"""A second arm of servos that follows the robot's, in runs of a scenario."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from teleop.scenario.operators.building import operator_of
from teleop.scenario.session.run import replay_run, run_scenario
from tests.teleop.scenario.session.support import Listener, run, scenario

WORLD = {"arm": "s2", "scanner": "none", "board": "degree"}
TASKS = [{"kind": "jog", "rates": [0.5, 0, 0, 0, 0], "lasting": 1}, {"kind": "wait", "lasting": 2}]
HAND = {"kind": "hand", "tasks": TASKS}


def test_second_arm_follows_and_its_error_is_that_of_servos() -> None:
    chosen = scenario(world=WORLD, operator=HAND, time=5.0)
    listener = Listener(**{"/arm/mirror": "farsteer_msgs/msg/ArmMirror"})
    found = run(chosen, operator_of(chosen.operator, beside=None), listener)
    error = found.session.referee.judged()[1]["mirror_error"]
    assert 0.0 < math.degrees(error) < 1.5
    assert {m["state"] for _, m in listener.heard} <= {"following", "behind"}


@pytest.mark.slow
def test_unplugged_it_is_lost_and_the_run_repeats_with_its_error(tmp_path: Path) -> None:
    fault = {"kind": "board_unplugged", "at": 0.5, "lasting": 1}
    chosen = scenario(fault, world=WORLD, operator=HAND, time=5.0, limits={"mirror_error": 1.5})
    first = run_scenario(chosen, tmp_path / "run")
    assert [e.text for e in first.events if "board" in e.text] == [
        "the second arm's board is unplugged",
        "over: the second arm's board is unplugged",
    ]
    again = replay_run(tmp_path / "run")
    assert again.sha256 == first.sha256
    assert again.figures["mirror_error"] == first.figures["mirror_error"]
