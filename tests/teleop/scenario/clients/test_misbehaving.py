"""Clients that fail, flood, freeze or never come: judged and reported, without a hang, and the robot brakes."""

from __future__ import annotations

import os
import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from teleop.scenario.referee.outcome import EventKind, ExitStatus
from teleop.scenario.session.run import run_scenario
from tests.teleop.scenario.clients.support import (
    lasted,
    moved,
    python,
    repeats,
    rests,
    run,
    said,
    scenario,
)

pytestmark = pytest.mark.process


@pytest.mark.long
def test_a_client_that_never_connects_has_failed(tmp_path: Path) -> None:
    outcome = run(tmp_path, python("misbehaving", "never_comes"), scenario(patience=1.5))
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending == "no client connected within 1.5 s: no robot here"
    assert lasted(outcome) == 0.0
    assert repeats(tmp_path, outcome)


@pytest.mark.parametrize(
    ("command", "ending"),
    [
        ("exit 3", "the client ended with status 3"),
        ("exit 0", "the client ended before it connected"),
        ("kill -9 $$", "the client ended with signal 9"),
        (
            "/nowhere/client",
            "the client ended with status 127: /bin/sh: 1: /nowhere/client: not found",
        ),
        # Its status is zero, and it was there.
        (python("misbehaving", "goes_at_once"), "the client ended before the end of the run"),
    ],
)
def test_a_client_that_ends_at_once_has_failed_at_once(
    tmp_path: Path, command: str, ending: str
) -> None:
    begun = time.monotonic()
    outcome = run(tmp_path, command)
    assert (outcome.status, outcome.ending) == (ExitStatus.CLIENT_FAILED, ending)
    assert time.monotonic() - begun < 30.0, "it did not wait as patiently as for one that lives"


def test_a_client_that_opens_connections_and_says_nothing_has_never_connected(
    tmp_path: Path,
) -> None:
    judged = scenario(patience=3.0)
    outcome = run(tmp_path, python("misbehaving", "opens_and_says_nothing"), judged)
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending == "no client connected within 3 s"


@pytest.mark.long
@pytest.mark.parametrize(
    ("habit", "ending"),
    [
        ("fails_midway", "the client ended with status 1: the third test <b>failed</b>"),
        ("dies_while_driving", "the client ended with signal 9"),
    ],
)
def test_the_robot_brakes_before_a_run_ends_whose_client_fails_midway(
    tmp_path: Path, habit: str, ending: str
) -> None:
    outcome = run(tmp_path, python("misbehaving", habit))
    assert (outcome.status, outcome.ending) == (ExitStatus.CLIENT_FAILED, ending)
    assert moved(outcome)
    assert rests(outcome)
    assert outcome.figures["stops"] == 1
    assert ending in said(outcome, EventKind.CLIENT)
    assert repeats(tmp_path, outcome)
    stopping = next(check for check in outcome.checks if check.name == "stopping_time")
    assert stopping.met
    assert stopping.value > 0.0


@pytest.mark.long
def test_a_client_may_leave_and_come_back(tmp_path: Path) -> None:
    judged = scenario(time_limit=4.0, patience=10.0)
    outcome = run(tmp_path, python("misbehaving", "comes_back"), judged)
    came = [text for text in said(outcome, EventKind.CLIENT) if text.endswith(" connected")]
    assert len(came) == 3
    # It was gone as time was up, and nobody knows whether it would have come back.
    assert outcome.ending == "the client left before the end"


@pytest.mark.long
def test_a_client_that_freezes_misses_its_goal_and_its_robot_brakes(tmp_path: Path) -> None:
    judged = scenario(time_limit=4.0)
    outcome = run(tmp_path, python("misbehaving", "freezes_while_driving"), judged)
    assert (outcome.status, outcome.ending) == (ExitStatus.MISSED, "time is up")
    assert [check.name for check in outcome.checks if not check.met] == ["goals"]
    assert moved(outcome)
    assert rests(outcome)


@pytest.mark.parametrize(
    ("habit", "why"),
    [
        ("leaves_and_stays_alive", " left"),
        # Whichever of the two is exceeded first.
        pytest.param(
            "floods_with_frames",
            r" was disconnected: (more than 3000 WebSocket frames/s|rate limit of 200 operations/s)",
            marks=pytest.mark.long,
        ),
        pytest.param(
            "floods_with_bytes",
            r" was disconnected: rate limit of 2e\+06 bytes/s exceeded",
            marks=pytest.mark.long,
        ),
    ],
)
def test_a_client_that_leaves_or_floods_but_lives_is_given_time_to_come_back_and_the_report_says_why(
    tmp_path: Path, habit: str, why: str
) -> None:
    outcome = run(tmp_path, python("misbehaving", habit), scenario(patience=2.0))
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending == "the client left, and did not come back within 2 s"
    told = "\n".join(said(outcome, EventKind.CLIENT))
    assert re.search(why, told), told
    assert moved(outcome)
    assert rests(outcome)


@pytest.mark.long
def test_a_flood_of_connections_ends_with_the_run(tmp_path: Path) -> None:
    outcome = run(
        tmp_path, python("misbehaving", "floods_with_connections"), scenario(time_limit=5.0)
    )
    assert (outcome.status, outcome.ending) == (ExitStatus.MISSED, "time is up")
    assert outcome.factor > 0.3


@pytest.mark.long
def test_nonsense_is_reported_and_changes_nothing(tmp_path: Path) -> None:
    outcome = run(tmp_path, python("misbehaving", "talks_nonsense"), scenario(time_limit=30.0))
    assert (outcome.status, outcome.ending) == (ExitStatus.PASSED, "all goals are reached")
    told = said(outcome, EventKind.CLIENT)
    assert any("<script>alert(1)</script>" in text for text in told)
    assert outcome.figures["violations"] == 0


@pytest.mark.long
def test_a_client_that_reads_nothing_cannot_drive_as_its_link_counts_as_dead(
    tmp_path: Path,
) -> None:
    outcome = run(tmp_path, python("misbehaving", "reads_nothing"), scenario(time_limit=6.0))
    assert (outcome.status, outcome.ending) == (ExitStatus.MISSED, "time is up")
    assert rests(outcome)
    assert np.nanmax(outcome.command_ages) > 1.0


@pytest.mark.long
def test_a_client_that_somebody_else_has_started_is_judged_as_well(tmp_path: Path) -> None:
    clients: list[subprocess.Popen[bytes]] = []

    def start(share: float, text: str) -> None:
        address = text.partition("waiting for a client at ")[2]
        if address and not clients:
            environment = {**os.environ, "FARSTEER_URL": address, "FARSTEER_TOKEN": ""}
            clients.append(
                subprocess.Popen(python("plain_websockets"), shell=True, env=environment)
            )

    outcome = run_scenario(scenario(), tmp_path, progress=start)
    assert (outcome.status, outcome.ending) == (ExitStatus.PASSED, "all goals are reached")
    assert [client.wait(30.0) for client in clients] == [0]


def test_robot_for_which_no_client_comes_waits_no_longer_than_it_should(tmp_path: Path) -> None:
    outcome = run_scenario(scenario(patience=0.3), tmp_path)
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending == "no client connected within 0.3 s"
