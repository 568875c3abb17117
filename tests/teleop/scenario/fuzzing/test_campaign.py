"""Campaigns: the same number gives the same result on any process, and what falls is reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from teleop.__main__ import main
from teleop.scenario.fuzzing import campaign as campaigns
from teleop.scenario.fuzzing.campaign import attempt, broken_at, campaign
from teleop.scenario.fuzzing.fuzz_command import Fuzz
from teleop.scenario.fuzzing.judged_session import JudgedSession
from teleop.scenario.referee.rules.rule import Broken
from tests.teleop.scenario.fuzzing.test_rules import session


@pytest.mark.long
@pytest.mark.slow
def test_numbers_give_the_same_digests_on_one_process_and_on_two() -> None:
    numbers = (12, 42)  # short ones, in the corridor
    one = {done.number: done.judged for done in campaign(numbers, jobs=1, seconds=1e9)}
    two = {done.number: done.judged for done in campaign(numbers, jobs=2, seconds=1e9)}
    assert {n: j and j.sha256 for n, j in one.items()} == {
        n: j and j.sha256 for n, j in two.items()
    }
    assert any(one.values())


def test_no_session_is_begun_after_the_time_is_up() -> None:
    assert list(campaign(iter(()), jobs=1, seconds=0.0)) == []


def test_session_that_makes_the_program_fall_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def fall(scenario: object) -> JudgedSession:
        raise ZeroDivisionError("of no use")

    monkeypatch.setattr(campaigns, "judge_session", fall)
    done = attempt(1, shrinking=False)
    assert done.failure is not None
    assert (done.failure.broken.rule, done.failure.broken.how) == (
        "no-crash",
        "ZeroDivisionError: of no use",
    )


def test_session_whose_bits_differ_when_run_again_is_a_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    digests = iter(("a" * 64, "b" * 64))
    plain = JudgedSession((), 1.0, 1.0, "", (), 1.0, 1.0)
    monkeypatch.setattr(
        campaigns, "judge_session", lambda scenario: replace(plain, sha256=next(digests))
    )
    done = attempt(20, shrinking=False)
    assert done.failure is not None
    assert done.failure.broken.rule == "same-bits"


def test_time_at_which_another_rule_is_broken_does_not_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    broken = (Broken("source", 2_000_000_000, ""), Broken("rest", 3_000_000_000, ""))
    judged = JudgedSession(broken, 5.0, 1.0, "", (), 1.0, 1.0)
    monkeypatch.setattr(campaigns, "judge_session", lambda scenario: judged)
    assert broken_at(session(), "rest") == 3.0
    assert broken_at(session(), "undo") is None


def test_impossible_numbers_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["fuzz", "--sessions", "0", "--out", str(tmp_path)]) == 2
    assert "sessions must be >= 1" in capsys.readouterr().err


def test_rules_are_listed_with_their_sentences(capsys: pytest.CaptureFixture[str]) -> None:
    assert Fuzz(rules=True)() == 0
    listed = capsys.readouterr().out
    assert "e-stop" in listed
    assert "nothing moves the robot from an e-stop until somebody releases it who may" in listed
