"""Logs that were cut out, put together, or recorded with two robots: named in one line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from localization.logs.continuity import LogContinuity
from localization.pipeline.log_replay import LogRun
from localization.types import SECOND, Hint, Inertial, Odometry, Pose, Reading, Scan, WheelSpeeds
from teleop.__main__ import main
from tests.localization.logs.test_carmen_log import flaser
from tests.support_rooms import HALL, Drive, write_log


class Held:
    """A log in memory."""

    path = Path("held.log")
    metadata: dict[str, str] = {}  # noqa: RUF012
    warnings = ()

    def __init__(self, *scanners: str) -> None:
        self.mounts = dict.fromkeys(scanners, Pose.identity())


def scan(stamp: float, name: str = "laser", beams: int = 181, half: float = 90.0) -> Scan:
    return Scan.uniform(
        round(stamp * SECOND),
        name,
        angle_min=-np.deg2rad(half),
        angle_increment=2.0 * np.deg2rad(half) / max(beams - 1, 1),
        time_increment=0.0,
        ranges=np.ones(beams),
        range_min=0.1,
        range_max=30.0,
    )


def odometry(stamp: float, x: float = 0.0, yaw: float = 0.0) -> Odometry:
    return Odometry(round(stamp * SECOND), Pose.planar(x, 0.0, yaw))


def notes(readings: Iterable[Reading], *scanners: str) -> tuple[str, ...]:
    watch = LogContinuity(Held(*(scanners or ("laser",))))  # type: ignore[arg-type]
    for reading in readings:
        watch.observe(reading)
    return watch.notes


def test_ordinary_log_is_not_remarked_upon() -> None:
    readings: list[Reading] = []
    for i in range(100):
        readings += [scan(0.1 * i, beams=181 + i % 3), odometry(0.1 * i - 1.0 + 1.0, 0.05 * i)]
        readings.append(Inertial(i, np.zeros(3), np.zeros(3)))
        readings.append(WheelSpeeds(i * 10**7, 0.02 * i, 0.02 * i))
    readings.append(Hint(5, Pose.identity(), np.zeros((6, 6))))
    assert notes(readings) == ()


def test_base_that_begins_with_another_heading_does_not_begin_in_the_middle() -> None:
    assert notes([odometry(0.0, 0.0, -1.57), odometry(0.1, 0.01, -1.57)]) == ()


def test_readings_that_are_late_by_seconds_are_no_clock_set_back() -> None:
    assert notes([scan(10.0), scan(8.0), scan(11.0)]) == ()


@pytest.mark.parametrize(
    ("first", "said"),
    [
        (odometry(0.0, 12.5, 0.5), "its odometry starts at 12.50 0.00 m, 29°"),
        (WheelSpeeds(0, 0.5, 0.4), "the wheels roll at 0.50 and 0.40 m/s in the first reading"),
    ],
)
def test_beginning_in_the_middle_of_a_drive_is_named(first: Reading, said: str) -> None:
    (note,) = notes([first, odometry(0.1, 0.05)][: 1 if isinstance(first, Odometry) else 2])
    assert note.startswith("begins in the middle of a drive")
    assert said in note


def test_clock_that_jumps_back_an_hour_is_named_once_with_its_place() -> None:
    readings = [scan(4000.0 + i) for i in range(10)] + [scan(409.0 + i) for i in range(10)]
    readings += [scan(300.0)]
    (note,) = notes(readings)
    assert "jumps back by 3600.0 s at 9.0 s of the log" in note
    assert "1 more such" in note
    assert "cut the log there" in note


def test_pause_of_minutes_is_named() -> None:
    (note,) = notes([scan(0.0), scan(1.0), scan(301.0)])
    assert "scans of laser pauses for 300 s at 1.0 s of the log" in note


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (scan(5.0, beams=361), "from 181 beams from -90° to 90° to 361 beams from -90° to 90°"),
        (scan(5.0, half=120.0), "to 181 beams from -120° to 120°"),
    ],
)
def test_other_beams_in_the_middle_are_another_scanner(other: Scan, said: str) -> None:
    (note,) = notes([scan(0.0), scan(1.0), other])
    assert "its scanner laser changes at 5.0 s of the log" in note
    assert said in note


def test_scanner_of_another_name_in_the_middle_is_named() -> None:
    (note,) = notes([scan(0.0, "a"), scan(1.0, "a"), scan(2.0, "b"), scan(3.0, "b")], "a", "b")
    assert note == "its scanner changes from a to b at 2.0 s of the log"
    assert notes([scan(0.0, "a"), scan(0.5, "b"), scan(1.0, "a"), scan(1.5, "b")], "a", "b") == ()


def test_scans_whose_pose_is_unknown_are_counted_by_name() -> None:
    (note,) = notes([scan(0.0), scan(0.5, "r2/laser"), scan(1.0), scan(1.5, "r2/laser")])
    assert note.startswith("2 scans of r2/laser are not used")
    assert "known: laser" in note


def test_equal_stamps_of_a_source_are_named() -> None:
    (note,) = notes([scan(7.0) for _ in range(12)])
    assert note.startswith("all 12 stamps of its scans of laser are equal (7 s)")


@pytest.mark.slow
def test_findings_are_in_the_summary_and_on_the_terminal(
    tmp_path: Path, hall_map: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A CARMEN text whose clock jumps back an hour, and whose scanner gets twice the beams."""
    drive = Drive(HALL, Pose.planar(2.6, 1.6, 0.2), (3.0, 0.2, 0.0))
    lines = []
    for i in range(30):
        pose = drive.pose(i * 10**8)
        seconds = 5000.0 + 0.1 * i - (3600.0 if i >= 20 else 0.0)
        lines.append(flaser(HALL, pose, pose, seconds, beams=361 if i >= 10 else 181))
    log = tmp_path / "odd.log"
    log.write_text("\n".join(lines) + "\n")
    out = tmp_path / "out"
    words = ["localize", str(log), "--map", str(hall_map), "--start", "2.6", "1.6", "11.5"]
    assert main([*words, "--out", str(out), "--no-recording"]) in (0, 1)
    printed = " ".join(capsys.readouterr().out.split())  # lines are as wide as the terminal
    page = (out / "report.html").read_text(encoding="utf-8")
    for said in (
        "jumps back by 3599.9 s at 1.9 s of the log: readings after it are out of order",
        "its scanner laser changes at 1.0 s of the log from 181 beams",
        "begins in the middle of a drive: its odometry starts at 2.60 1.60 m",
    ):
        assert said in printed
        assert said in page


def test_refused_readings_never_have_an_empty_reason(tmp_path: Path, hall_map: Path) -> None:
    """Also when the last reading is refused, after which no estimate comes."""
    readings = Drive(HALL, Pose.planar(3.0, 2.0, 0.3), (0.5, 0.0, 0.0)).readings()
    broken = [*readings, WheelSpeeds(readings[-1].stamp + 1, 99.0, 99.0)]
    run = LogRun(write_log(tmp_path / "log.mcap", broken), hall_map)
    list(run)
    (note,) = (n for n in run.notes if "refused" in n)
    assert note.startswith("1 readings refused, such as: refused wheel speeds 99, 99 m/s")
