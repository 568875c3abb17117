"""Faults of a client that is not ours: it is killed or made to hang, and its link gets worse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from teleop.scenario.files.errors import ScenarioError
from teleop.scenario.files.faults import Link, OperatorKilled
from teleop.scenario.files.limits import Limits
from teleop.scenario.files.operator_settings import Follower
from teleop.scenario.referee.outcome import EventKind, ExitStatus
from teleop.scenario.session.run import replay_run
from tests.teleop.scenario.clients.support import lasted, moved, python, rests, run, said, scenario

pytestmark = [pytest.mark.process, pytest.mark.slow]

BRAKES = Limits(goals=False, contacts=0, stopping_time=1.5, runaway=1.0)


@pytest.mark.long
@pytest.mark.parametrize("silent", [False, True])
def test_the_run_goes_on_after_the_scenario_has_killed_its_client(
    tmp_path: Path, silent: bool
) -> None:
    killed = OperatorKilled("operator_killed", 2.5, silent)
    judged = scenario(time_limit=5.0, fault=(killed,), limits=BRAKES)
    outcome = run(tmp_path, python("plain_websockets"), judged)
    # It was not the client that failed.
    assert (outcome.status, outcome.ending) == (ExitStatus.PASSED, "the time of the run is over")
    assert lasted(outcome) == 5.0
    assert moved(outcome)
    assert rests(outcome)
    assert outcome.figures["stops"] == 1
    left = any(text.endswith(" left") for text in said(outcome, EventKind.CLIENT))
    hung = any("no command for" in text for text in said(outcome, EventKind.STOP))
    assert hung == silent
    assert left or silent


@pytest.mark.long
def test_a_delayed_link_delays_what_a_client_wants_and_the_run_can_be_repeated(
    tmp_path: Path,
) -> None:
    judged = scenario(fault=(Link("link", 0.0, delay=0.1),))
    outcome = run(tmp_path, python("plain_websockets"), judged)
    assert outcome.status is ExitStatus.PASSED
    # A tenth of a second each way; the first command of all comes before anything is known of the link.
    assert np.median(outcome.command_ages) == pytest.approx(0.2, abs=0.1)
    assert replay_run(tmp_path).sha256 == outcome.sha256


def test_an_operator_of_the_library_does_not_drive_beside_a_client(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="second: drives beside an operator of the library"):
        run(tmp_path / "run", "true", scenario(second=Follower()))
