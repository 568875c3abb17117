"""Clients that step the robot's time: the same bits each time, whatever else they try."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from teleop.scenario.referee.outcome import EventKind, ExitStatus
from teleop.scenario.session import over_socket
from teleop.scenario.session.attendance import Attendance
from teleop.scenario.session.client_watch import ClientWatch
from tests.teleop.scenario.clients.support import (
    moved,
    python,
    repeats,
    rests,
    run,
    said,
    scenario,
)

pytestmark = [pytest.mark.process, pytest.mark.slow]

TRIED = (
    *("publish /odom", "publish /scan", "publish /tf", "publish /clock", "publish /scenario/state"),
    *("advertise /amcl_pose", "advertise /ground_truth/odom", "publish /ground_truth/odom"),
    *("advertise_service /teleop/estop", "use /sim/set_entity_state", "use /sim/simulate_steps"),
)
"""What the cheating client is found out at; ``odom`` is ``/odom``, and a parameter is nobody's secret."""


@pytest.mark.long
def test_stepping_clients_drive_the_same_way_each_time_whether_they_cheat_or_not(
    tmp_path: Path,
) -> None:
    honest = run(tmp_path / "honest", python("stepping"), pace="lockstep")
    again = run(tmp_path / "again", python("stepping"), pace="lockstep")
    cheat = run(tmp_path / "cheat", python("stepping", "cheat"), pace="lockstep")
    assert honest.status is again.status is ExitStatus.PASSED
    assert honest.pace == "lockstep"
    assert honest.factor > 1.0
    assert honest.sha256 == again.sha256 == cheat.sha256
    assert repeats(tmp_path / "cheat", cheat)
    # Only that it tried is held against it.
    assert (cheat.status, cheat.ending) == (ExitStatus.MISSED, "all goals are reached")
    assert [check.name for check in cheat.checks if not check.met] == ["violations"]
    found_out = [text.partition(" tried to ")[2] for text in said(cheat, EventKind.VIOLATION)]
    assert sorted(found_out) == sorted(TRIED)
    assert any("/rosapi/set_param: /goal" in text for text in said(cheat, EventKind.CLIENT))
    assert not said(honest, EventKind.VIOLATION)


@pytest.mark.long
@pytest.mark.parametrize("time_limit", [30.0, 3.0])
def test_a_stepping_client_that_leaves_with_the_end_is_not_blamed_however_late_that_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, time_limit: float
) -> None:
    async def connected(watch: ClientWatch, attendance: Attendance) -> str:
        while not watch.ever:  # noqa: ASYNC110 - a watch has no event
            await asyncio.sleep(0.01)
        return ""

    # The first look at the client comes when the run and its client have ended.
    monkeypatch.setattr(over_socket, "_connected", connected)
    monkeypatch.setattr(over_socket, "_POLL", 4.0)
    # Its own status says what it thinks of the goal; whether it was there is the referee's matter.
    command = f"{python('stepping').replace('exec ', '')} || true"
    outcome = run(tmp_path, command, scenario(time_limit=time_limit), pace="lockstep")
    reached = time_limit > 10.0
    assert outcome.status is (ExitStatus.PASSED if reached else ExitStatus.MISSED)
    assert outcome.ending == ("all goals are reached" if reached else "time is up")


def test_a_client_that_steps_no_more_has_failed(tmp_path: Path) -> None:
    judged = scenario(patience=2.0)
    outcome = run(tmp_path, python("misbehaving", "freezes_while_driving"), judged, pace="lockstep")
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending == "the client has not called /sim/step for 2 s"


def test_the_robot_of_a_stepping_client_that_dies_brakes(tmp_path: Path) -> None:
    outcome = run(tmp_path, python("misbehaving", "dies_while_stepping"), pace="lockstep")
    assert outcome.status is ExitStatus.CLIENT_FAILED
    assert outcome.ending == "the client ended with signal 9"
    assert moved(outcome)
    assert rests(outcome)
