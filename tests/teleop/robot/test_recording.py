"""Records on a disk that is full: they end, with what they hold readable, and nothing else does."""

from __future__ import annotations

import logging
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from localization.logs.mcap_writer import ReadingsWriter
from localization.logs.open_log import open_log
from localization.maps.cloud import Cloud
from localization.types import Health, Hint, Pose
from robot_sim import Simulation, World
from teleop.robot.drive import Drive
from teleop.robot.inbox import PoseHint, WorldCall
from teleop.robot.real_time.process_messages import (
    DRIVEN,
    ESTIMATED,
    OTHER,
    End,
    EstimatorSetup,
    pack,
    unpack,
)
from teleop.robot.recording import PLAYGROUND, Recording
from teleop.robot.serve import start_estimator
from teleop.robot.steps.precision_log import StepsWriter
from teleop.robot.tick_record import EstimateRecord
from tests.support import a_drive

ROOM = 300_000
"""Bytes that the disk takes."""


@contextmanager
def full_disk(process: int = 0) -> Iterator[None]:
    """Let a process write no file beyond ``ROOM``, as on a disk without further room."""
    before = resource.prlimit(process, resource.RLIMIT_FSIZE)
    resource.prlimit(process, resource.RLIMIT_FSIZE, (ROOM, before[1]))
    try:
        yield
    finally:
        resource.prlimit(process, resource.RLIMIT_FSIZE, before)


def test_log_on_a_full_disk_ends_once_and_what_it_holds_is_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "drive.mcap"
    mounts = {"laser_horizontal": Pose.identity(), "laser_vertical": Pose.identity()}
    recording = Recording(ReadingsWriter(path, mounts), path)
    drive = a_drive(15.0)
    with full_disk(), caplog.at_level(logging.ERROR):
        for stamp, reading in drive:
            recording.readings((reading,), stamp)
        recording.close()
    (record,) = caplog.records
    assert "drive.mcap ends here: File too large; the robot goes on" in record.getMessage()
    assert path.stat().st_size <= ROOM
    kept = list(open_log(path))
    assert 0 < len(kept) < len(drive)
    assert [r.stamp for r in kept] == [reading.stamp for _, reading in drive[: len(kept)]]


def test_disk_that_fills_as_the_log_is_completed_costs_its_end_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "drive.mcap"
    mounts = {"laser_horizontal": Pose.identity(), "laser_vertical": Pose.identity()}
    recording = Recording(ReadingsWriter(path, mounts), path, StepsWriter(tmp_path / "s.csv"))
    for stamp, reading in a_drive(2.0):
        recording.readings((reading,), stamp)
    with full_disk(), caplog.at_level(logging.ERROR):
        recording.close()
    assert len(caplog.records) <= 1


def test_call_that_comes_while_older_readings_wait_is_logged_in_its_place(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    mounts = {"laser_horizontal": Pose.identity(), "laser_vertical": Pose.identity()}
    recording, drive = Recording(ReadingsWriter(path, mounts), path), a_drive(2.0)
    middle, last = drive[len(drive) // 2][0], drive[-1][0]
    recording.calls([WorldCall("a", 1, "Slip", "{}")], middle)
    recording.calls([WorldCall("a", 2, "Slip", "{}")], last + 1)
    for stamp, reading in drive:
        recording.readings((reading,), stamp)
    recording.close()
    assert [r.stamp for r in open_log(path)] == [reading.stamp for _, reading in drive]
    with path.open("rb") as file:
        times = [
            (channel.topic, message.log_time)
            for _, channel, message in make_reader(file).iter_messages(log_time_order=False)
        ]
    assert [time for topic, time in times if topic == PLAYGROUND] == [middle, last + 1]
    assert [time for _, time in times] == sorted(time for _, time in times)


@pytest.mark.process
@pytest.mark.slow
def test_localiser_keeps_its_pose_when_the_disk_of_its_log_is_full(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    simulation, path = Simulation(office, seed=0), tmp_path / "drive.mcap"
    drive = Drive(simulation)
    setup = EstimatorSetup(office_cloud, simulation.mounts, cache, path, {}, 0.11)
    estimator = start_estimator().begin(setup)
    try:
        estimator.ready()
        with full_disk(estimator.pid):
            inbox = [PoseHint("", Hint(0, simulation.truth().map_from_base, np.zeros((6, 6))))]
            estimates: list[EstimateRecord] = []
            for number in range(200):
                record = drive.tick(number * 20_000_000, inbox)
                inbox = []
                estimator.channel.send(pack(DRIVEN, record))
                while len(estimates) <= number:
                    for payload in estimator.channel.wait():
                        assert payload[:1] == ESTIMATED
                        estimates.append(unpack(payload))
            assert path.stat().st_size <= ROOM
        last = estimates[-1].estimate
        assert last.health is Health.TRACKING
        assert last.map_from_base is not None
        assert last.map_from_base.position == pytest.approx(
            simulation.truth().map_from_base.position, abs=0.1
        )
    finally:
        estimator.end(pack(OTHER, End()))
    assert 0 < len(list(open_log(path))) < 200 * 5
