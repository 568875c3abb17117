from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from teleop.errors import SettingError
from teleop.scenario.files.faults import Fault, Kidnap, Link, OperatorKilled, WheelSlip
from teleop.scenario.referee.outcome import Outcome
from teleop.scenario.reports.run_reports import write_reports
from teleop.scenario.session.run import replay_run, run_scenario
from teleop.scenario.whatif.fork import ForkError, Futures, fork
from tests.teleop.scenario.session.support import Forward
from tests.teleop.scenario.whatif.support import drive

pytestmark = pytest.mark.slow

FORK = 75
"""Ticks until 1.5 s."""


def differs_from(futures: Futures) -> int:
    """Return the first tick in which the robots of two futures are not at the same place, to the bit."""
    first, second = (o.lines for o in (futures.actual, futures.forked))
    count = min(len(first.stamps), len(second.stamps))
    same = (first.true[:count] == second.true[:count]).all(axis=1)
    same &= (first.command[:count] == second.command[:count]).all(axis=1)
    same &= (first.error[:count] == second.error[:count]) | np.isnan(first.error[:count])
    return count if same.all() else int(np.argmin(same))


@pytest.mark.long
@pytest.mark.parametrize(
    "fault",
    [
        Link("link", 1.5, delay=0.3),
        Kidnap("kidnap", 1.5, "niche"),
        OperatorKilled("operator_killed", 1.5),
    ],
    ids=lambda fault: fault.kind,
)
def test_a_fork_of_an_operator_of_the_library_is_the_same_run_up_to_the_fault(
    fault: Fault, run: Path, tmp_path: Path
) -> None:
    futures = fork(run, 1.5, (fault,), tmp_path / "fork")
    assert futures.is_closed_loop
    assert futures.at == FORK * 20_000_000
    assert FORK <= differs_from(futures) < 150
    assert futures.actual.sha256 == json.loads((run / "outcome.json").read_text())["sha256"]
    assert futures.forked.sha256 != futures.actual.sha256
    write_reports(futures.forked, tmp_path / "fork")
    assert replay_run(tmp_path / "fork").sha256 == futures.forked.sha256


def test_a_time_within_a_tick_is_the_end_of_that_tick(run: Path, tmp_path: Path) -> None:
    futures = fork(run, 1.487, (WheelSlip("wheel_slip", 1.487),), tmp_path)
    assert futures.at == FORK * 20_000_000
    assert futures.faults[0].at == 1.5


@pytest.mark.long
def test_a_fork_of_a_clients_run_replays_its_messages_later_and_says_so(
    client_run: Path, tmp_path: Path
) -> None:
    futures = fork(client_run, 1.5, (Link("link", 1.5, delay=0.3),), tmp_path)
    assert not futures.is_closed_loop
    assert "client" in futures.open_loop
    # Until the first command is missing, the last one before the fork holds.
    assert FORK <= differs_from(futures) < 150
    ages = futures.forked.command_ages
    assert ages.max() >= futures.actual.command_ages.max() + 0.29
    assert replay_run(tmp_path).sha256 == futures.forked.sha256


def test_a_clients_robot_is_carried_off_though_nobody_can_react(
    client_run: Path, tmp_path: Path
) -> None:
    futures = fork(client_run, 1.5, (Kidnap("kidnap", 1.5, "niche"),), tmp_path)
    assert differs_from(futures) == FORK
    assert [e.text for e in futures.forked.events if e.stamp == futures.at][:1] == [
        "the robot is carried off to niche"
    ]


@pytest.mark.long
def test_an_operator_of_ones_own_drives_anew_if_it_is_named_and_else_is_replayed(
    tmp_path: Path,
) -> None:
    run = tmp_path / "run"
    outcome: Outcome = run_scenario(drive(), run, operator=Forward(0.0, 0.5))
    write_reports(outcome, run)
    fault = Link("link", 1.5, delay=0.3)
    named = fork(run, 1.5, (fault,), tmp_path / "named", operator=Forward(0.0, 0.5))
    assert named.is_closed_loop
    unnamed = fork(run, 1.5, (fault,), tmp_path / "unnamed")
    assert "--operator" in unnamed.open_loop
    assert not (tmp_path / "unnamed/commands.jsonl").exists()
    assert named.common == unnamed.common


def test_a_time_that_is_not_of_the_run_is_refused(run: Path, tmp_path: Path) -> None:
    for at in (-0.1, 3.0, float("nan")):
        with pytest.raises(SettingError, match=r"0 to 2\.98 s"):
            fork(run, at, (OperatorKilled("operator_killed", 1.5),), tmp_path / "fork")


def test_a_run_that_does_not_repeat_is_not_forked(run: Path, tmp_path: Path) -> None:
    changed = tmp_path / "run"
    shutil.copytree(run, changed)
    file = changed / "outcome.json"
    file.write_text(file.read_text().replace(json.loads(file.read_text())["sha256"], "0" * 64))
    with pytest.raises(ForkError, match="does not repeat to the bit"):
        fork(changed, 1.5, (OperatorKilled("operator_killed", 1.5),), tmp_path / "fork")
