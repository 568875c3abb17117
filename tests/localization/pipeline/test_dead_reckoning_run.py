"""Logs without scanner, and logs without a map, from a file to a trajectory."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.tum_file import read_tum
from localization.logs.log_interface import LogError
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.dead_reckoning_run import DeadReckoningRun
from localization.pipeline.log_replay import Localized, LogRun, localize, open_run
from localization.types import (
    SECOND,
    Health,
    Hint,
    Inertial,
    Odometry,
    Pose,
    Reading,
    Twist,
)
from teleop.__main__ import main
from tests.localization.logs.test_ros_bag import recorded, ros1
from tests.support_rooms import HALL, Drive, by_odometry, write_log

START = Pose.planar(2.6, 1.6, 0.9)
DRIVE = Drive(HALL, START, (1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (2.0, 0.0, 0.8), (3.0, 0.4, -0.3))
END = DRIVE.pose(0).inverse() @ DRIVE.pose(DRIVE.end)
"""Where the drive ends, from where it begins."""


def scannerless(*, orientation: bool = True, inertial: bool = True) -> list[Reading]:
    """Odometry that turns 1.85 times as far as the robot, and an inertial unit whose world is turned by 0.9."""
    held: list[Reading] = []
    for reading in by_odometry(DRIVE, turn=1.85, begin=Pose.identity()):
        if isinstance(reading, Inertial) and inertial:
            given = DRIVE.pose(reading.stamp).quaternion_wxyz if orientation else None
            held.append(replace(reading, orientation=given))
        if isinstance(reading, Odometry):
            held.append(reading)
    return held


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ros1(tmp_path_factory.mktemp("bare") / "bag", recorded(scannerless()))


@pytest.fixture(scope="module")
def done(bag: Path) -> Localized:
    """The bag as it is dead-reckoned without a map, by the default settings."""
    return localize(bag)


def test_log_without_scanner_and_map_is_dead_reckoned_from_its_first_heading(
    done: Localized,
) -> None:
    last = done.estimates[-1]
    assert last.map_from_base is not None
    true = Pose.planar(0.0, 0.0, 0.9) @ END
    np.testing.assert_allclose(last.map_from_base.position, true.position, atol=0.02)
    assert last.map_from_base.yaw == pytest.approx(true.yaw, abs=0.01)
    assert last.odom_from_base is last.map_from_base
    assert {e.health for e in done.estimates} == {Health.DEGRADED}
    assert last.reasons == ("dead-reckoned: no scanner in the log",)
    assert done.notes == ()
    sigma = np.sqrt(np.diag(last.covariance))
    assert 0.02 < sigma[0] < 0.5


@pytest.mark.slow
def test_start_in_a_map_places_the_path_and_its_covariance(
    bag: Path, done: Localized, hall_map: Path
) -> None:
    turned = Pose.planar(3.0, 2.0, -1.0)
    placed = localize(bag, hall_map, start=turned)
    last = placed.estimates[-1]
    assert last.map_from_base is not None
    np.testing.assert_allclose(last.map_from_base.position, (turned @ END).position, atol=0.02)
    spread = [np.linalg.eigvalsh(r.estimates[-1].covariance) for r in (done, placed)]
    np.testing.assert_allclose(spread[0], spread[1], atol=1e-9)
    assert not np.allclose(done.estimates[-1].covariance, last.covariance)


@pytest.mark.slow
def test_map_without_a_start_and_hints_are_remarked_upon(hall_map: Path, tmp_path: Path) -> None:
    held = [*scannerless()[:200], Hint(SECOND // 2, START, np.zeros((6, 6)))]
    path = write_log(tmp_path / "log.mcap", held)
    assert localize(path).notes == ("1 hints were not used: give the first pose as the start",)
    bare = ros1(tmp_path / "bag", recorded(held))
    (note,) = localize(bare, hall_map).notes
    assert note.startswith("no start was given: the path begins at the map's origin")
    assert localize(bare, hall_map, start=START).notes == ()


@pytest.mark.slow
def test_gyro_alone_begins_with_heading_zero(tmp_path: Path) -> None:
    path = ros1(tmp_path / "bag", recorded(scannerless(orientation=False)))
    last = localize(path).estimates[-1]
    assert last.map_from_base is not None
    np.testing.assert_allclose(last.map_from_base.position, END.position, atol=0.05)


def test_odometry_alone_is_as_wrong_as_its_turns_and_says_so(tmp_path: Path) -> None:
    path = ros1(tmp_path / "bag", recorded(scannerless(inertial=False)))
    run = open_run(path)
    assert isinstance(run, DeadReckoningRun)
    last = list(run)[-1]
    assert last.map_from_base is not None
    error = np.linalg.norm(last.map_from_base.position - END.position)
    assert error > 0.3
    assert np.sqrt(last.covariance[0, 0] + last.covariance[1, 1]) > 0.5 * error
    assert run.motion == "displacement of the odometry, turned by the wheels"


@pytest.mark.slow
def test_log_with_scanner_is_dead_reckoned_without_a_map_and_the_scans_are_counted(
    tmp_path: Path, hall_map: Path
) -> None:
    path = write_log(tmp_path / "log.mcap", DRIVE.readings())
    run = open_run(path)
    assert isinstance(run, DeadReckoningRun)
    last = list(run)[-1]
    assert last.map_from_base is not None
    np.testing.assert_allclose(last.map_from_base.position, END.position, atol=0.1)
    assert last.reasons == ("dead-reckoned: no map",)
    (note,) = run.notes
    assert "scans were not used; `farsteer map`" in note
    assert isinstance(open_run(path, hall_map), LogRun)


@pytest.mark.parametrize(
    ("motion", "why"),
    [
        (Motion.WHEELS_AND_GYRO, "hold no wheel speeds"),
        (Motion.GYRO, "motion gyro needs a scanner and a map"),
        (Motion.SCANNER, "motion scanner needs a scanner and a map"),
    ],
)
def test_motion_that_the_log_cannot_give_is_named(bag: Path, motion: Motion, why: str) -> None:
    with pytest.raises(LogError, match=why):
        localize(bag, sensors=SensorConfiguration(motion))


@pytest.mark.slow
def test_odometry_of_velocities_alone_is_integrated(tmp_path: Path) -> None:
    """Some drivers fill the twist and leave the pose at zero."""
    held: list[Reading] = []
    for reading in scannerless():
        if isinstance(reading, Odometry):
            now, soon = DRIVE.pose(reading.stamp), DRIVE.pose(reading.stamp + SECOND // 100)
            step = now.inverse() @ soon
            twist = Twist.planar(100.0 * step.position[0], 100.0 * step.yaw)
            held.append(Odometry(reading.stamp, Pose.identity(), twist))
        else:
            held.append(reading)
    run = open_run(ros1(tmp_path / "bag", recorded(held)))
    assert isinstance(run, DeadReckoningRun)
    last = list(run)[-1]
    np.testing.assert_allclose(
        last.odom_from_base.position, (Pose.planar(0.0, 0.0, 0.9) @ END).position, atol=0.05
    )
    assert run.motion.startswith("velocity of the odometry, turned by gyro")


def test_odometry_asked_for_alone_leaves_the_inertial_unit_out(bag: Path) -> None:
    run = open_run(bag, sensors=SensorConfiguration(Motion.ODOMETRY))
    assert isinstance(run, DeadReckoningRun)
    list(run)
    assert run.motion == "displacement of the odometry, turned by the wheels"


def test_bag_of_an_inertial_unit_alone_cannot_be_dead_reckoned(tmp_path: Path) -> None:
    readings = [r for r in scannerless()[:100] if isinstance(r, Inertial)]
    path = ros1(tmp_path / "bag", recorded(readings))
    with pytest.raises(LogError, match="no scanner, odometry or wheels among its types"):
        localize(path)


def test_map_and_calibration_need_a_scanner(
    bag: Path, hall_map: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (["map", str(bag)], ["calibrate", str(bag), "--map", str(hall_map)]):
        assert main([*words, "--out", str(tmp_path / "out")]) == 2
        assert "has no scanner; `farsteer localize` without --map" in capsys.readouterr().err


@pytest.mark.slow
def test_settings_reach_dead_reckoning(bag: Path, done: Localized) -> None:
    plain = done.estimates[-1].covariance
    unsure = localize(bag, settings={"ekf.odometry.along": 0.5}).estimates[-1].covariance
    assert np.trace(unsure[:2, :2]) > 10.0 * np.trace(plain[:2, :2])
    level = localize(bag, settings={"sensors.motion": "odometry", "sensors.flat": True})
    assert level.estimates[-1].odom_from_base.position[2] == 0.0


@pytest.mark.slow
def test_command_without_a_map_writes_all_files_and_the_end(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["localize", str(bag), "--out", str(out), "--no-recording", "--no-report"]
    assert main([*words, "--set", "ekf.odometry.along=0.05"]) == 0
    printed = " ".join(capsys.readouterr().out.split())  # lines are as wide as the terminal
    assert ", dead-reckoned: no scanner in the log" in printed
    assert "turned by gyro and the orientation that the inertial unit reports" in printed
    assert "m along its worst direction" in printed
    assert "frame odom, which begins where the log does" in printed
    known = read_tum(out / "estimate.tum")
    np.testing.assert_allclose(
        known.positions[-1], (Pose.planar(0.0, 0.0, 0.9) @ END).position, atol=0.02
    )
    assert (out / "covariance.csv").read_text().count("\n") == len(known) + 1
    config = json.loads((out / "config.json").read_text())
    assert config["localizer"]["ekf"]["odometry"]["along"] == 0.05
    assert config["changed"] == {"ekf.odometry.along": "0.05"}
    assert config["map"] is None


@pytest.mark.slow
def test_report_and_recording_need_no_map(bag: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["localize", str(bag), "--out", str(out)]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 6
    assert "dead-reckoned: no scanner in the log" in page
    assert (out / "recording.rrd").read_bytes()[:3] == b"RRF"
