"""Records on a disk that is full: they end, with what they hold readable, and nothing else does."""

from __future__ import annotations

import logging
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from localization.logs.mcap_writer import ReadingsWriter
from localization.logs.open_log import open_log
from localization.maps.cloud import Cloud
from localization.types import Health, Hint, Pose
from robot_sim import Simulation, World
from teleop.robot.drive import Drive
from teleop.robot.inbox import PoseHint
from teleop.robot.real_time.process_messages import (
    DRIVEN,
    ESTIMATED,
    OTHER,
    End,
    EstimatorSetup,
    pack,
    unpack,
)
from teleop.robot.recording import Recording
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
