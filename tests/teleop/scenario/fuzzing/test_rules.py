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


KILLED = {"fault": [{"kind": "operator_killed", "at": 3.5}]}
HUNG = {"fault": [{"kind": "operator_killed", "at": 3.0, "silent": True}]}
SLOW_LINK = {
    "fault": [{"kind": "link", "at": 2.0, "direction": "up", "delay": 1.6}],
    "mission": {"time_limit": 7.0},
}
BLIND = {
    "fault": [{"kind": "link", "at": 2.0, "direction": "down", "delay": 2.5}],
    "mission": {"time_limit": 7.0},
}
ESTOP = {"fault": [{"kind": "estop", "at": 3.0}]}
HINT = {
    "fault": [{"kind": "wrong_hint", "at": 1.5, "off": 0.5}],
    "mission": {"time_limit": 7.0},
}
TURNED = {"start": {"at": [40.0, 4.0, 90.0]}}
CARRIED_OFF = {
    "operator": {"kind": "follower", "speed": 0.7},
    "fault": [{"kind": "estop", "at": 3.52}, {"kind": "kidnap", "at": 3.5}],
}
UNDONE = {
    "seed": 7,
    "operator": {"kind": "careless", "speed": 0.5, "mistakes": 60.0},
    "mission": {"time_limit": 4.0},
}
WATCHED = {"roles": ["operate", "view"], "second": {"kind": "careless", "mistakes": 60.0}}
STOPPED = {
    "roles": ["operate", "operate"],
    "operator": {"kind": "careless", "mistakes": 60.0},
    "second": {"kind": "careless", "mistakes": 60.0, "oddities": 60.0},
    "seed": 3,
    "mission": {"time_limit": 16.0},
}
WAITING = {
    "roles": ["operate", "operate"],
    "second": {"kind": "follower"},
    "fault": [{"kind": "operator_killed", "at": 2.0, "silent": True}],
    "mission": {"time_limit": 8.0},
}
BACK = {
    "operator": {"kind": "careless", "mistakes": 0.0, "oddities": 60.0},
    "mission": {"time_limit": 10.0},
}
TWO = {"second": {"kind": "careless", "mistakes": 0.0}}

CASES = [
    ("no_watchdog", "source", HUNG),
    ("slow_watchdog", "source", HUNG),
    ("disconnect_ignored", "source", KILLED),
    ("stale_command_obeyed", "stale", SLOW_LINK),
    ("way_back_ignored", "stale", BLIND),
    ("lease_race", "one-driver", TWO),
    ("estop_released_by_neutral", "e-stop", ESTOP),
    ("estop_ignored_while_driving", "e-stop", ESTOP),
    ("weak_brakes", "rest", KILLED),
    ("turn_sign", "obeys", TURNED),
    ("sound_scans_refused", "readings", {}),
    ("hint_never_answered", "hint-answered", HINT),
    ("undo_forgets", "undo", UNDONE),
    ("transform_not_inverted", "published", {}),
    ("covariance_about_own_axes", "published", TURNED),
    ("odometry_in_map", "published", {}),
    ("odometry_stamp_late", "in-time", {}),
    ("cloud_distances_negated", "cloud", {}),
    ("old_sweep_published", "in-time", {}),
    ("viewers_may_publish", "viewer", WATCHED),
    ("viewers_may_call", "viewer", WATCHED),
    ("estop_released_by_all", "e-stop", STOPPED),
    ("lease_never_ends", "free", WAITING),
    ("turns_swapped_backwards", "source", BACK),
]
"""Mutant, the rule that it breaks, and the session in which it does."""


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.untraced
@pytest.mark.parametrize(
    "changes",
    [
        KILLED,
        HUNG,
        SLOW_LINK,
        BLIND,
        ESTOP,
        HINT,
        UNDONE,
        CARRIED_OFF,
        TWO,
        TURNED,
        WATCHED,
        STOPPED,
        WAITING,
        BACK,
    ],
)
def test_robot_breaks_no_rule(changes: dict[str, Any]) -> None:
    assert judge_session(session(**changes)).broken == ()


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize(("mutant", "rule", "changes"), CASES)
def test_defect_breaks_its_rule(
    mutant: str, rule: str, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(robot_mutants, "patch", patched.setattr)
        robot_mutants.MUTANTS[mutant]()
        broken = judge_session(session(**changes)).broken
    assert [each.rule for each in broken][:1] == [rule], broken
