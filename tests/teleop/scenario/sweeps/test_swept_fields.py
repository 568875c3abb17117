from __future__ import annotations

import pytest

from teleop.errors import SettingError
from teleop.scenario.files.faults import Link
from teleop.scenario.files.operator_settings import Careless
from teleop.scenario.sweeps.axes import Value
from teleop.scenario.sweeps.swept_fields import with_values
from tests.teleop.scenario.sweeps.support import scenario

KIDNAP = {"kind": "kidnap", "at": 1.0}


def test_a_link_is_added_at_the_end_so_that_no_other_fault_draws_anew() -> None:
    made, _ = with_values(scenario(fault=[KIDNAP]), {"link.delay": 0.5, "link.rate": 1000})
    assert made.fault[0] == scenario(fault=[KIDNAP]).fault[0]
    assert made.fault[1:] == (Link("link", 0.0, delay=0.5, rate=1000.0),)


def test_the_link_of_the_whole_run_is_used_if_there_is_one() -> None:
    faults = [{"kind": "link", "at": 3.0, "rate": 9.0}, {"kind": "link", "at": 0.0, "jitter": 0.1}]
    made, _ = with_values(scenario(fault=faults), {"link.delay": 0.5})
    assert len(made.fault) == 2
    assert made.fault[1] == Link("link", 0.0, jitter=0.1, delay=0.5)
    assert made.fault[0] == Link("link", 3.0, rate=9.0)


def test_fields_of_tables_and_of_faults_are_set_and_read_back_as_the_schema_has_them() -> None:
    base = scenario(fault=[KIDNAP])
    values: dict[str, Value] = {
        "operator.speed": 1,
        "world.alive": True,
        "fault[0].at": 2,
        "start.at": [1, 2],
    }
    made, held = with_values(base, values)
    assert list(held.values()) == [1.0, True, 2.0, [1.0, 2.0]]
    assert isinstance(held["operator.speed"], float)
    assert (made.operator.kind, made.world.alive, made.fault[0].at) == ("follower", True, 2.0)
    assert made.start.at == (1.0, 2.0)


def test_a_link_that_is_no_worse_than_none_is_left_out() -> None:
    base = scenario(fault=[KIDNAP])
    assert with_values(base, {"link.delay": 0}) == (base, {"link.delay": 0.0})


def test_an_operator_of_another_kind_keeps_the_habits_that_both_have() -> None:
    base = scenario(operator={"kind": "follower", "speed": 0.4, "interface": "cmd_vel"})
    made, _ = with_values(base, {"operator.kind": "careless"})
    assert made.operator == Careless("careless", 0.4)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("link.dely", 1, "did you mean link.delay"),
        ("link.at", 1, "from the start to the end"),
        ("operator.sped", 1, "did you mean operator.speed"),
        ("operatr.speed", 1, "did you mean operator"),
        ("operator", 1, "is a table"),
        ("fault.at", 1, r"fault\[0\]\.at"),
        ("fault[1].at", 1, r"has 1 of fault, \[0\] to \[0\]"),
        ("fault[0].delay", 1, r"known are fault\[0\]\.kind"),
        ("fault[0].kind", "link", "two files"),
        ("start.at.x", 1, "no fields"),
        ("seed", 1, "--seeds"),
        ("name", "a", "changes nothing"),
        ("operator.speed", 99, "must be <= 3, got 99"),
        ("operator.kind", "client", "operator of the library"),
        ("world.alive", 1, "must be true or false"),
        ("a:b", 1, "no name of a field"),
    ],
)
def test_what_cannot_be_swept_is_refused_with_what_can(name: str, value: int, says: str) -> None:
    with pytest.raises(SettingError, match=says):
        with_values(scenario(fault=[KIDNAP]), {name: value})
