"""Rules that hold in every run: the robot keeps them, and a robot with one small defect breaks the right one."""

from __future__ import annotations

from typing import Any

import pytest

from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.fuzzing.judged_session import judge_session
from tests.teleop.scenario.fuzzing import robot_mutants


def session(**changes: Any) -> Scenario:
    """Return a short drive through the corridor, with changes of its fields."""
    plain = {
        "format": 1,
        "name": "rules",
        "world": {"scene": "corridor"},
        "start": {"at": "quarter"},
        "mission": {"goals": [{"at": "three_quarters"}], "time_limit": 5.0},
        "limits": {"goals": False, "rules": True},
    }
    drawn: Scenario = SCHEMA.validate_python({**plain, **changes})
    return drawn


SESSIONS: dict[str, dict[str, Any]] = {
    "killed": {"fault": [{"kind": "operator_killed", "at": 3.5}]},
    "hung": {"fault": [{"kind": "operator_killed", "at": 3.0, "silent": True}]},
    "slow link": {
        "fault": [{"kind": "link", "at": 2.0, "direction": "up", "delay": 1.6}],
        "mission": {"time_limit": 7.0},
    },
    "blind": {
        "fault": [{"kind": "link", "at": 2.0, "direction": "down", "delay": 2.5}],
        "mission": {"time_limit": 7.0},
    },
    "estop": {"fault": [{"kind": "estop", "at": 3.0}]},
    "hint": {
        "fault": [{"kind": "wrong_hint", "at": 1.5, "off": 0.5}],
        "mission": {"time_limit": 7.0},
    },
    "turned": {"start": {"at": [40.0, 4.0, 90.0]}},
    "carried off": {
        "operator": {"kind": "follower", "speed": 0.7},
        "fault": [{"kind": "estop", "at": 3.52}, {"kind": "kidnap", "at": 3.5}],
    },
    "undone": {
        "seed": 7,
        "operator": {"kind": "careless", "speed": 0.5, "mistakes": 60.0},
        "mission": {"time_limit": 4.0},
    },
    "watched": {"roles": ["operate", "view"], "second": {"kind": "careless", "mistakes": 60.0}},
    "stopped": {
        "roles": ["operate", "operate"],
        "operator": {"kind": "careless", "mistakes": 60.0},
        "second": {"kind": "careless", "mistakes": 60.0, "oddities": 60.0},
        "seed": 3,
        "mission": {"time_limit": 16.0},
    },
    "waiting": {
        "roles": ["operate", "operate"],
        "second": {"kind": "follower"},
        "fault": [{"kind": "operator_killed", "at": 2.0, "silent": True}],
        "mission": {"time_limit": 8.0},
    },
    "back": {
        "operator": {"kind": "careless", "mistakes": 0.0, "oddities": 60.0},
        "mission": {"time_limit": 10.0},
    },
    "two": {"second": {"kind": "careless", "mistakes": 0.0}},
    "plain": {},
}
"""Changes of the drive that the robot, and most mutants of it, are tried with."""

CASES = [
    ("no_watchdog", "source", "hung"),
    ("slow_watchdog", "source", "hung"),
    ("disconnect_ignored", "source", "killed"),
    ("stale_command_obeyed", "stale", "slow link"),
    ("way_back_ignored", "stale", "blind"),
    ("lease_race", "one-driver", "two"),
    ("estop_released_by_neutral", "e-stop", "estop"),
    ("estop_ignored_while_driving", "e-stop", "estop"),
    ("weak_brakes", "rest", "killed"),
    ("turn_sign", "obeys", "turned"),
    ("sound_scans_refused", "readings", "plain"),
    ("hint_never_answered", "hint-answered", "hint"),
    ("undo_forgets", "undo", "undone"),
    ("transform_not_inverted", "published", "plain"),
    ("covariance_about_own_axes", "published", "turned"),
    ("odometry_in_map", "published", "plain"),
    ("odometry_stamp_late", "in-time", "plain"),
    ("cloud_distances_negated", "cloud", "plain"),
    ("old_sweep_published", "in-time", "plain"),
    ("viewers_may_publish", "viewer", "watched"),
    ("viewers_may_call", "viewer", "watched"),
    ("estop_released_by_all", "e-stop", "stopped"),
    ("lease_never_ends", "free", "waiting"),
    ("turns_swapped_backwards", "source", "back"),
]
"""Mutant, the rule that it breaks, and the session in which it does."""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SESSIONS if name != "plain"])
def test_robot_breaks_no_rule(name: str) -> None:
    assert judge_session(session(**SESSIONS[name])).broken == ()


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(("mutant", "rule", "name"), CASES)
def test_defect_breaks_its_rule(
    mutant: str, rule: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(robot_mutants, "patch", patched.setattr)
        robot_mutants.MUTANTS[mutant]()
        broken = judge_session(session(**SESSIONS[name])).broken
    assert [each.rule for each in broken][:1] == [rule], broken
