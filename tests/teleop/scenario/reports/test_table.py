"""The table of outcomes in the terminal."""

from dataclasses import replace

from localization.cli.terminal import WIDTH
from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.reports.table import Verdict, table, verdict
from tests.teleop.scenario.reports.outcomes import EVIL, outcome, passed


def test_it_says_who_passed_and_why_others_did_not() -> None:
    lines = table([verdict(passed(), "runs/a"), verdict(outcome(), "runs/b")])
    assert lines == [
        "scenario                 verdict        robot time   factor",
        "kidnapped-in-the-office  passed             60.0 s     4.7x",
        "kidnapped-in-the-office  MISSED             60.0 s     4.7x",
        "    goals reached: 2, limit 3",
        "    largest error of the position: 5.66 m, limit <= 0.1 m",
        "    mean NEES: not measured, limit 2 to 12",
        "    see runs/b/report.html",
        "1 of 2 passed",
    ]


def test_a_file_that_could_not_be_run_has_no_times() -> None:
    lines = table([Verdict("a.toml", ExitStatus.BAD_INPUT, 0.0, 0.0, ("a.toml:3: no TOML",), "")])
    assert lines[1:] == ["a.toml    BAD INPUT", "    a.toml:3: no TOML", "0 of 1 passed"]


def test_a_client_s_words_cannot_move_the_cursor() -> None:
    failed = replace(passed(), status=ExitStatus.CLIENT_FAILED, ending=f"the client said {EVIL}")
    text = "\n".join(table([verdict(failed)]))
    assert "CLIENT FAILED" in text
    assert "\x1b" not in text
    assert "\x00" not in text


def test_names_of_any_length_leave_the_columns_in_their_place() -> None:
    long = replace(passed(), scenario=replace(passed().scenario, name="a" * 80))
    lines = table([verdict(passed()), verdict(long)])
    assert lines[0].index("verdict") <= WIDTH - 38
    assert lines[1].index("passed") == lines[0].index("verdict")
