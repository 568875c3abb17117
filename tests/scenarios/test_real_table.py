"""The table of real logs: other methods, robots carried off, starts, and the tables in Markdown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from benchmarks.common.figures import OURS
from benchmarks.common.sheet import Sheet
from benchmarks.real import command as real
from benchmarks.real.failure_rules import ERROR, FAILED, RULES, judged, mean_absolute_error
from benchmarks.real.hints import KINDS, beginnings, start_at
from benchmarks.real.kidnaps import (
    HELD,
    Course,
    Noticed,
    _misled,
    _recovered,
    kidnap,
    pairs,
    stretches,
)
from benchmarks.real.log_tracks import odometry_at_scans
from benchmarks.real.logs import Excerpt, RealDrive, real_drive
from benchmarks.real.peers import AMCL, GICP, KISS, peer_answers, sweep_of
from benchmarks.real.scores import Answer, _quantile_bounds, score_real
from benchmarks.real.submissions import read_submission, submitted_answers
from benchmarks.real.tables import RULES as RULE_PARTS, knowing, of_noticed
from benchmarks.real.trials import place_at
from localization.pipeline.localizer import LocalizerConfig
from localization.types import SECOND, Health, Odometry, Pose, Reading, Scan
from tests.scenarios.test_real_logs import folder as folder

NONE = np.zeros(0)


@pytest.fixture
def drive(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RealDrive:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return real_drive(folder, Excerpt("room"))


def theirs(drive: RealDrive, path: Path, *, every: int = 1, covariance: str = "") -> Path:
    """Write the true poses of some scans as somebody else hands them in."""
    rows = zip(drive.times, drive.track, drive.heading, strict=True)
    path.write_text(
        "".join(
            f"{t:.6f} {x} {y} 0 0 0 {np.sin(yaw / 2)} {np.cos(yaw / 2)} {covariance}\n"
            for i, (t, (x, y), yaw) in enumerate(rows)
            if i % every == 0
        ),
        encoding="utf-8",
    )
    return path


@pytest.mark.parametrize(("name", "limit"), [(KISS, 0.08), (GICP, 0.08), (AMCL, 0.3)])
def test_peer_follows_the_drive_with_the_same_map_and_odometry(
    drive: RealDrive, name: str, limit: float
) -> None:
    found = list(peer_answers(drive, name))
    assert len(found) == len(drive.track)
    score = score_real(drive, found)
    assert score.mean < limit
    assert score.wrong == 0.0
    # It reports neither state nor covariance.
    assert np.isnan([score.trusted, score.tracking, score.nees, score.covered]).all()
    assert not score.states


def test_true_poses_handed_in_have_no_error_and_their_covariance_is_judged(
    drive: RealDrive, tmp_path: Path
) -> None:
    wide = "0.01 0 0 0.01 0 0.001"
    path = theirs(drive, tmp_path / "wide.tum", covariance=wide)
    score = score_real(drive, submitted_answers(drive, read_submission(path)))
    assert score.mean == pytest.approx(0.0, abs=1e-6)
    assert score.covered == 1.0
    assert score.nees < 0.1
    # Between the lines the pose is carried on by odometry.
    path = theirs(drive, tmp_path / "some.tum", every=10)
    found = submitted_answers(drive, read_submission(path))
    assert score_real(drive, found).mean < 0.05
    assert score_real(drive, found).n == len(drive.track)
    # A file of another log is not taken.
    path.write_text("5000.0 0 0 0 0 0 0 1\n", encoding="utf-8")
    with pytest.raises(ValueError, match="no line is within"):
        submitted_answers(drive, read_submission(path))


def test_interval_of_a_percentile_holds_the_true_one_in_95_of_100_drives() -> None:
    drawn = np.random.default_rng(0).exponential(size=(2000, 220))
    bounds = np.array([_quantile_bounds(list(errors), 0.95) for errors in drawn])
    held = (bounds[:, 0] <= np.log(20.0)) & (np.log(20.0) <= bounds[:, 1])
    assert 0.94 <= held.mean() <= 0.975
    assert _quantile_bounds([0.1], 0.95) == (0.1, 0.1)


@pytest.mark.slow
def test_robot_carried_off_begins_at_one_place_and_goes_on_far_from_it(drive: RealDrive) -> None:
    course = Course(before=4.0, after=6.0, way=1.0, apart=1.5)
    config = LocalizerConfig.of(drive.log.sensors)
    found = list(pairs(drive, course, count=3, seed=1))
    assert found == list(pairs(drive, course, count=3, seed=1))
    assert len(found) == 3
    for start, goal in found:
        assert np.hypot(*(drive.track[start + 20] - drive.track[goal])) >= course.apart
    result = kidnap(drive, config, *found[0], course)
    assert not result.doubted
    assert result.alarm < 4.0
    assert result.watched == pytest.approx(course.after, abs=0.5)


def test_error_rule_is_silent_where_beams_end_on_walls_and_speaks_where_a_pose_is_wrong(
    drive: RealDrive,
) -> None:
    walls = KDTree(drive.world.cloud.points[:, :2])
    scan = next(r for r in drive.readings if isinstance(r, Scan))
    sweep, here = sweep_of(scan, drive.mount), place_at(drive, 0)
    assert mean_absolute_error(sweep, here, walls) < 0.05
    assert mean_absolute_error(sweep, here @ Pose.planar(0.6, 0.5, 0.4), walls) > FAILED
    # Beams that end farther from the map than a metre say nothing, all together that nothing is wrong.
    assert mean_absolute_error(sweep, Pose.planar(90.0, 0.0, 0.0), walls) == 0.0


@pytest.mark.slow
def test_others_rules_are_asked_of_the_same_robots(drive: RealDrive) -> None:
    course = Course(before=4.0, after=4.0, way=0.2, apart=1.5)
    pair = next(pairs(drive, course, count=1, seed=0))
    said = judged(drive, *pair, course)
    assert list(said) == list(RULES)
    assert {n.watched for n in said.values()} == {stretches(drive, *pair, course).watched}
    assert not said[ERROR].doubted
    assert said[ERROR].alarm < 2.0
    assert said[ERROR].false_alarms == said[ERROR].alarmed == 0


def test_knowing_is_counted_over_all_logs_together() -> None:
    sheet, hour = Sheet(None), 3600.0
    one = [Noticed(False, 0.5, 1, 0.1, hour), Noticed(False, np.inf, 0, 0.0, hour)]
    two = [Noticed(False, 3.0, 0, 0.2, 2.0 * hour), Noticed(True, 0.0, 2, 0.3, 2.0 * hour)]
    for case, trials in (("a", one), ("b", two)):
        sheet.put(f"{RULE_PARTS}{case}", list(of_noticed(case, ERROR, trials)), seconds=1.0)
    *_, last = knowing(sheet).splitlines()
    cells = [cell.strip() for cell in last.strip("|").split("|")]
    assert cells[:3] == ["**all**", ERROR, "4 (3)"]
    assert cells[3].startswith("33.3")
    assert cells[4].startswith("66.7")
    assert cells[6].startswith("0.5 ")
    assert cells[7:] == ["18.3 %", "6"]


def test_recovery_is_a_right_and_trusted_pose_that_lasts(drive: RealDrive) -> None:
    def answers(states: Sequence[Health], *, wrong: Sequence[int]) -> list[Answer]:
        return [
            Answer(
                i * SECOND // 2,
                place_at(drive, 9 + i) @ drive.mount @ Pose.planar(0.0, 0.0, float(i in wrong)),
                np.eye(6),
                state,
                0.0,
            )
            for i, state in enumerate(states)
        ]

    states = [Health.TRACKING] + [Health.LOST] * 5 + [Health.DEGRADED] * 6
    found = answers(states, wrong=(0, 1, 3))
    assert _recovered(drive, 9, found) == 3.0
    lasts = round(HELD * 2)
    assert _recovered(drive, 9, found[: 6 + lasts]) == np.inf
    assert _recovered(drive, 9, answers(states, wrong=(8, 11))) == np.inf
    # Every third scan has a corrected pose: the first answer counts until the fourth.
    assert drive.corrected[9:13].tolist() == [True, False, False, True]
    assert _misled(drive, 9, found) == pytest.approx(1.5)


def test_start_from_an_exact_scan_is_right_when_placed_and_held(drive: RealDrive) -> None:
    config = LocalizerConfig.of(drive.log.sensors)
    (scan,) = beginnings(drive, count=1, seed=2, seconds=8.0, way=1.0)
    found = start_at(drive, config, scan, KINDS[0], seed=2, seconds=8.0)
    assert found.placed
    assert found.right_when_placed
    assert found.right_at_end


def test_odometry_at_a_scan_is_that_of_its_stamp_or_between_its_neighbours() -> None:
    def scan(t: int) -> Scan:
        return Scan(t, "laser", NONE, NONE, NONE, NONE.astype(np.int64), 0.1, 9.0)

    readings: list[Reading] = [
        Odometry(10, Pose.planar(0.0, 0.0, 3.1)),
        scan(15),
        Odometry(20, Pose.planar(1.0, 2.0, -3.1)),
        scan(20),
    ]
    between, exact = odometry_at_scans(readings)
    np.testing.assert_allclose(between.position[:2], [0.5, 1.0])
    assert abs(between.yaw) == pytest.approx(np.pi)
    assert exact.yaw == pytest.approx(-3.1)
    with pytest.raises(ValueError, match="no odometry"):
        odometry_at_scans([scan(15)])


@pytest.mark.slow
def test_command_writes_figures_and_tables_beside_each_other(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drive: RealDrive
) -> None:
    path = theirs(drive, tmp_path / "theirs.tum")
    out = tmp_path / "out" / "real.json"
    words = [str(folder), "--logs", "room", "--end", "12", "--peers", "--submission", str(path)]
    real.main([*words, "--kidnaps", "1"], out=out)
    held = json.loads(out.read_text(encoding="utf-8"))
    assert list(held) == ["room, 0 to 12 s", "kidnaps, room, 0 to 12 s", "rules, room, 0 to 12 s"]
    methods = {f["method"] for f in held["room, 0 to 12 s"]["figures"]}
    assert methods == {OURS, KISS, GICP, AMCL, "theirs"}
    table = out.with_suffix(".md").read_text(encoding="utf-8")
    assert "| room, 0 to 12 s | theirs | 58 |" in table


def test_command_names_a_bad_line_before_anything_is_run(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "bad.tum"
    path.write_text("1 2 3\n", encoding="utf-8")
    words = [str(folder), "--logs", "room", "--submission", str(path)]
    with pytest.raises(SystemExit, match=r"bad\.tum, line 1: a line needs 8 columns"):
        real.main(words)


def test_command_names_a_folder_without_logs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        real.main([str(tmp_path)])
    assert "holds no log NAME-corrected.log.gz" in capsys.readouterr().err
