"""Real logs as benchmarks: frames, changed odometry and stamps, scores, the command's table."""

from __future__ import annotations

import bz2
import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.real import command as real
from benchmarks.real.corrected_logs import corrected_scans
from benchmarks.real.logs import STAMPS, Excerpt, again, real_drive, stamped, turned
from benchmarks.real.scores import WRONG, answers, mean_score, run_real, score_real
from localization.geometry import FloatArray, wrap_angle
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Odometry, Pose, Reading, Scan

WALLS = np.array(
    [
        [[0.0, 0.0], [9.0, 0.0]],
        [[9.0, 0.0], [9.0, 6.0]],
        [[9.0, 6.0], [0.0, 6.0]],
        [[0.0, 6.0], [0.0, 0.0]],
        [[6.0, 6.0], [6.0, 4.5]],
        [[2.0, 0.0], [2.0, 1.0]],
    ]
)
"""Ends (W, 2, 2) of the walls of a room [m]."""
ANGLES = -0.5 * math.pi + math.pi / 180.0 * np.arange(180)
MOUNT = -0.04
"""The scanner's place ahead of the base [m]."""


def ranges_from(pose: FloatArray) -> FloatArray:
    """Return the distances (180,) of the walls from a scanner's x, y, yaw."""
    line = np.column_stack([np.cos(ANGLES + pose[2]), np.sin(ANGLES + pose[2])])
    along = WALLS[:, 1] - WALLS[:, 0]
    offset = WALLS[:, 0] - pose[:2]
    cross = line[:, None, 0] * along[None, :, 1] - line[:, None, 1] * along[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / cross
        part = (offset[:, 0] * line[:, None, 1] - offset[:, 1] * line[:, None, 0]) / cross
    met = np.where((far > 0.0) & (part >= 0.0) & (part <= 1.0), far, np.inf)
    found: FloatArray = met.min(axis=1)
    return found


def step(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return pose b (x, y, yaw) as seen from a."""
    c, s = math.cos(a[2]), math.sin(a[2])
    dx, dy = b[:2] - a[:2]
    return np.array([c * dx + s * dy, c * dy - s * dx, wrap_angle(b[2] - a[2])])


def flaser(stamp: float, scanner: FloatArray, base: FloatArray, ranges: FloatArray) -> str:
    words = [f"{r:.2f}" for r in ranges]
    poses = " ".join(f"{v:.6f}" for v in (*scanner, *base))
    return f"FLASER {len(words)} {' '.join(words)} {poses} {stamp:.6f} host {stamp - 100.0:.6f}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive of 30 s along an arc as the data sets have it: raw log, corrected log, relations."""
    folder = tmp_path_factory.mktemp("room")
    time = np.arange(0.0, 30.0, 0.2)
    turned = 0.06 * time
    scanner = np.column_stack(
        [1.5 + 4.0 * np.sin(turned), 2.0 + 4.0 * (1.0 - np.cos(turned)) * 0.5, 0.6 * turned]
    )
    base = scanner.copy()
    base[:, 0] -= MOUNT * np.cos(scanner[:, 2])
    base[:, 1] -= MOUNT * np.sin(scanner[:, 2])
    # The raw log's odometry has a frame of its own.
    away = np.array([20.0, -7.0, 1.1])
    scans = [ranges_from(pose) for pose in scanner]
    raw = "".join(
        flaser(100.0 + t, step(away, s), step(away, b), seen)
        for t, s, b, seen in zip(time, scanner, base, scans, strict=True)
    )
    (folder / "room.clf.bz2").write_bytes(bz2.compress(raw.encode()))
    corrected = "".join(
        flaser(time[i], scanner[i], scanner[i], scans[i]) for i in range(0, len(time), 3)
    )
    (folder / "room-corrected.log.gz").write_bytes(gzip.compress(corrected.encode()))
    lines = []
    for i in range(0, len(time) - 20, 7):
        x, y, yaw = step(scanner[i], scanner[i + 20])
        lines.append(f"{100 + time[i]:.6f} {100 + time[i + 20]:.6f} {x} {y} 0 0 0 {yaw}")
    (folder / "room.relations").write_text("\n".join(lines))
    return folder


@pytest.mark.slow
def test_real_log_is_held_against_its_corrected_scans_and_its_relations(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    drive = real_drive(folder, Excerpt("room", 5.0, 25.0))
    assert drive.log.mounts["laser"].position[0] == pytest.approx(MOUNT, abs=1e-5)
    assert len(drive.track) == 97
    assert len(drive.reference) == 17
    score, _ = run_real(drive, LocalizerConfig.of(drive.log.sensors))
    assert score.relations > 5
    assert score.wrong < 0.1
    assert score.mean < 0.06
    assert score.relation < 0.06
    # The measures notice a pose that is wrong, in whatever state it is reported.
    config = LocalizerConfig.of(drive.log.sensors)
    found = answers(drive, Localizer(drive.world, drive.log.mounts, config))
    off = drive.track[len(found) // 2 :] + 2.0 * WRONG
    drive.track[len(found) // 2 :] = off
    assert score_real(drive, found).wrong > 0.4
    assert score_real(drive, found).trusted > 0.2


@pytest.mark.slow
def test_replays_of_ranges_that_differ_by_a_millionth_are_scored_by_their_means(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    drive = real_drive(folder, Excerpt("room", 5.0, 12.0))
    other = again(drive, 3)
    for before, after in zip(drive.readings, other.readings, strict=True):
        if isinstance(before, Scan) and isinstance(after, Scan):
            assert after.ranges == pytest.approx(before.ranges * 1.000003, rel=1e-12)
        else:
            assert after is before
    config = LocalizerConfig.of(drive.log.sensors)
    one, two = (run_real(run, config)[0] for run in (drive, other))
    mean = mean_score([one, two])
    assert one.mean != two.mean
    assert mean.mean == pytest.approx(0.5 * (one.mean + two.mean))
    assert mean.max == max(one.max, two.max)
    assert sum(mean.states.values()) == pytest.approx(1.0)
    assert mean_score([one]).mean == one.mean


@pytest.mark.slow
def test_command_prints_a_row_for_each_change_of_a_log(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kept = tmp_path / "kept"
    words = [
        str(folder),
        "--begin",
        "5",
        "--end",
        "15",
        "--stamps",
        "logged",
        "even",
        "--runs",
        "1",
    ]
    real.main([*words, "--keep", str(kept), "--set", "kiss_odometry=no"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["log", "method", "scans"]
    cases = [line[:34].strip() for line in lines[1::2]]
    assert cases == ["room, 5 to 15 s", "room, 5 to 15 s, stamps even"]
    with np.load(kept / "room_5_to_15_s_stamps_even.npz") as held:
        assert len(held["pose"]) == len(held["error"]) == len(held["health"])
        placed = np.isfinite(held["error"])
        assert placed.mean() > 0.8
        assert held["error"][placed].max() < WRONG
        assert np.array_equal(np.isfinite(held["pose"][:, 0]), placed)


def test_command_without_a_folder_runs_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    real.main()
    assert "skipped" in capsys.readouterr().out


def test_turned_odometry_turns_more_and_moves_as_far() -> None:
    poses = [Pose.planar(0.3 * i, 0.02 * i * i, 0.1 * i) for i in range(6)]
    readings: list[Reading] = [Odometry(i * SECOND, pose) for i, pose in enumerate(poses, 1)]
    found = [r.odom_from_base for r in turned(readings, 1.2) if isinstance(r, Odometry)]
    for a, b, before, after in zip(poses, poses[1:], found, found[1:], strict=False):
        step, changed = a.inverse() @ b, before.inverse() @ after
        np.testing.assert_allclose(changed.position, step.position, atol=1e-12)
        assert changed.yaw == pytest.approx(1.2 * step.yaw)


@pytest.mark.parametrize("how", STAMPS)
def test_scan_and_odometry_of_a_line_keep_one_stamp(how: str) -> None:
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.integers(SECOND // 20, SECOND // 2, 20)).tolist()
    readings: list[Reading] = []
    none = np.zeros(0)
    for t in times:
        readings.append(Scan(t, "laser", none, none, none, none.astype(np.int64), 0.1, 9.0))
        readings.append(Odometry(t, Pose.identity()))
    found = [r.stamp for r in stamped(readings, how)]
    assert found[::2] == found[1::2]
    steps = np.diff(found[::2])
    if how == "even":
        assert np.all(steps == steps[0])
        assert found[-1] == pytest.approx(times[-1], abs=len(times))
    else:
        moved = np.abs(np.array(found[::2]) - times)
        assert moved.max() <= SECOND // 20
        assert np.any(moved > 0) == (how == "shaken")


def test_setting_of_a_part_is_changed_by_name() -> None:
    whole = LocalizerConfig()
    config = real.changed(whole, ["kiss_odometry=no", "health.lost_sigma=inf"])
    assert whole.kiss_odometry
    assert not config.kiss_odometry
    assert config.health.lost_sigma == math.inf


def corrected_like_gmapping(folder: Path, digits: int, away: FloatArray) -> Path:
    """A corrected log with steps of the wheels between the scans, whose corrections are ``away`` times their number."""
    time = np.arange(0.0, 20.0, 0.2)
    counted = np.column_stack([1.5 + 0.2 * time, np.full_like(time, 2.0), 0.02 * time])
    lines, shift = ["PARAM robot_use_laser on nohost 0\n", "ODOM broken line\n"], np.zeros(3)
    for i, (t, odom) in enumerate(zip(1.1e9 + time, counted, strict=True)):
        pose = odom + shift
        stamp = f"{t:.{digits}g}" if digits < 10 else f"{t:.6f}"
        end = f"0 0 0 {stamp} host {stamp}\n"
        lines.append(f"ODOM {pose[0]:.9f} {pose[1]:.9f} {pose[2]:.9f} {end}")
        if i % 5 == 0:
            shift = away * (i // 5)
            fixed = " ".join(f"{v:.9f}" for v in odom + shift)
            seen = " ".join(f"{r:.2f}" for r in ranges_from(odom + shift))
            lines.append(f"FLASER {len(ANGLES)} {seen} {fixed} {fixed} {stamp} host {stamp}\n")
            lines.append(f"ODOM {fixed} 0 0 0 0 host 0\n")
    path = folder / "lone-corrected.log.gz"
    path.write_bytes(gzip.compress("".join(lines).encode()))
    return path


def test_corrected_poses_are_read_though_stamps_were_printed_with_six_digits(
    tmp_path: Path,
) -> None:
    scans = corrected_scans(corrected_like_gmapping(tmp_path, 6, np.array([0.0, 0.01, 0.0])))
    assert len(scans) == 20
    assert [pose.position[1] for _, pose in scans] == pytest.approx(
        [2.0 + 0.01 * i for i in range(20)]
    )


def test_log_without_a_raw_one_is_rebuilt_with_the_odometry_that_the_wheels_counted(
    tmp_path: Path,
) -> None:
    corrected_like_gmapping(tmp_path, 10, np.array([0.03, -0.01, 0.0]))
    drive = real_drive(tmp_path, Excerpt("lone"))
    odometry = [r for r in drive.readings if isinstance(r, Odometry)]
    assert odometry[-1].odom_from_base.position[0] == pytest.approx(0.2 * 19.0, abs=1e-6)
    assert odometry[-1].odom_from_base.position[1] == pytest.approx(0.0, abs=1e-6)
    assert len(drive.reference) == 10
    assert real._logs(tmp_path) == ["lone"]
