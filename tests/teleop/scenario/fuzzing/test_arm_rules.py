"""Rules of an arm: the robot keeps them, and an arm's control with one small defect breaks the right one."""

from __future__ import annotations

from typing import Any

import pytest

from teleop.robot.arm import mirror
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.fuzzing.judged_session import judge_session
from tests.teleop.scenario.fuzzing import robot_mutants
from tests.teleop.scenario.fuzzing.arm_mutants import ARM_MUTANTS

READY = {"kind": "move", "to": "ready"}
SWEEP = {"kind": "sweep", "radius": 0.05, "lasting": 3}
JOG = {"kind": "jog", "rates": [0.6, 0, 0, 0, 0], "lasting": 2}
ROAM = {"kind": "roam", "far": 0.35, "speed": 0.6, "lasting": 6}


def session(*tasks: dict[str, Any], **changes: Any) -> Scenario:
    """Return a short session of a hand on an arm, with changes of its fields."""
    plain = {
        "format": 1,
        "name": "rules",
        "world": {"scene": "corridor", "arm": "s2", "scanner": "none"},
        "operator": {"kind": "hand", "tasks": list(tasks)},
        "mission": {"time_limit": 9.0},
        "limits": {"rules": True},
    }
    drawn: Scenario = SCHEMA.validate_python({**plain, **changes})
    return drawn


HUNG = session(JOG, fault=[{"kind": "operator_killed", "at": 0.6, "silent": True}])
STOPPED = session(READY, JOG, fault=[{"kind": "estop", "at": 1.5}])
FAST = {"kind": "jog", "rates": [2.5, 0, 0, 0, 0], "lasting": 0.5}
BOXES = [
    {"kind": "box", "at": 0, "to": [x, y], "size": [0.08, 0.08, height]}
    for x, y, height in ((3.0, 4.15, 0.3), (2.95, 3.83, 0.25), (3.15, 4.0, 0.2), (3.08, 3.9, 0.4))
]
CROWDED = session(
    READY, ROAM | {"speed": 1.5, "lasting": 12}, fault=BOXES, mission={"time_limit": 15}
)
OTHERS = session(
    {"kind": "sweep", "lasting": 6}, second={"kind": "hand", "tasks": [{"kind": "wait"}, ROAM]}
)
JUMP = session(READY, {"kind": "lose", "by": [-0.4, 0.4, 0.4], "said": False})
GUESSED = session(READY, {"kind": "lose", "by": [0.0, 0.3, 0.3], "drift": 0.3, "lasting": 1.5})
CASES = [
    ("arm_clutch_absolute", "arm-hand", session(READY, SWEEP)),
    ("arm_watchdog_absent", "arm-source", HUNG),
    ("arm_jumps_followed", "arm-hand", JUMP),
    ("arm_untracked_followed", "arm-hand", GUESSED),
    ("arm_unchecked", "arm-clear", CROWDED),
    ("arm_jerk_unbounded", "arm-bounds", session(READY, ROAM)),
    ("arm_estop_deaf", "arm-e-stop", STOPPED),
    ("arm_stow_ignored", "arm-vehicle", session(READY, {"kind": "drive", "speed": 0.6})),
    ("arm_two_masters", "arm-hand", OTHERS),
    ("arm_held_by_a_step", "arm-bounds", session(READY, FAST)),
    ("arm_let_go_ignored", "arm-source", session(READY, JOG, {"kind": "wait", "lasting": 2})),
]
"""Mutant, the rule that it breaks, and the session in which it does."""


@pytest.mark.slow
def test_second_arm_that_nobody_says_is_lost_breaks_a_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    world = {"scene": "corridor", "arm": "s2", "scanner": "none", "board": "degree"}
    unplugged = {"kind": "board_unplugged", "at": 0.4, "lasting": 1}
    chosen = session({"kind": "wait", "lasting": 2.4}, world=world, fault=[unplugged])
    assert judge_session(chosen).broken == ()
    monkeypatch.setattr(mirror, "LOST", 10**15)
    assert [each.rule for each in judge_session(chosen).broken] == ["arm-mirror"]


def test_every_mutant_is_asked_for() -> None:
    assert [mutant for mutant, _, _ in CASES] == list(ARM_MUTANTS)


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(("mutant", "rule", "chosen"), CASES)
def test_defect_of_the_arms_control_breaks_its_rule_and_the_robot_breaks_none(
    mutant: str, rule: str, chosen: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert judge_session(chosen).broken == ()
    with monkeypatch.context() as patched:
        patched.setattr(robot_mutants, "patch", patched.setattr)
        ARM_MUTANTS[mutant]()
        broken = judge_session(chosen).broken
    assert [each.rule for each in broken][:1] == [rule], broken
