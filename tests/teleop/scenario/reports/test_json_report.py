"""An outcome as JSON."""

import json

from teleop.scenario.files.reading import scenario_from
from teleop.scenario.reports.json_report import outcome_json
from tests.teleop.scenario.reports.outcomes import outcome, passed, scenario


def test_it_is_strict_json_in_which_nan_is_null() -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    values = json.loads(outcome_json(outcome()), parse_constant=refuse)
    assert values["figures"]["nees"] is None
    assert values["figures"]["distance"] == 52.3
    assert [check["value"] for check in values["limits"]] == [2.0, 5.66, 0.0, None, 0.0]


def test_it_has_the_verdict_in_words_and_as_exit_status() -> None:
    values = json.loads(outcome_json(outcome()))
    assert (values["status"], values["exit_status"], values["passed"]) == ("missed", 1, False)
    values = json.loads(outcome_json(passed()))
    assert (values["status"], values["exit_status"], values["passed"]) == ("passed", 0, True)


def test_events_keep_their_kind_stamp_and_place() -> None:
    event = json.loads(outcome_json(outcome()))["events"][1]
    assert event["kind"] == "fault"
    assert event["stamp"] == 10_000_000_000
    assert event["text"] == "the link is delayed by 0.5 s for 5 s"


def test_the_scenario_in_it_can_be_run_again() -> None:
    values = json.loads(outcome_json(outcome()))
    assert scenario_from(values["scenario"]) == scenario()


def test_time_lines_are_left_out() -> None:
    values = json.loads(outcome_json(outcome()))
    assert values["ticks"] == 3000
    assert "lines" not in values
    assert len(values["command_ages"]) == 550
