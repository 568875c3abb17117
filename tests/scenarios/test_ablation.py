"""The ablation's own parts: its switches switch, its real logs are read in the right frames, its table is short."""

from __future__ import annotations

import bz2
import gzip
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks._ablation_drives import COST
from benchmarks._ablation_table import ablation, unmeasured
from benchmarks._figures import Figure, Sheet
from benchmarks._mechanisms import ALL, MECHANISMS, REMOVED, both
from benchmarks._real_logs import WRONG, Excerpt, answers, real_drive, run_real, score_real
from benchmarks.ablation import PAIRS, SPECIAL, concerned
from localization.geometry import FloatArray, wrap_angle
from localization.pipeline.localizer import Localizer, LocalizerConfig

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


def test_real_log_is_held_against_its_corrected_scans_and_its_relations(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    drive = real_drive(folder, Excerpt("room", 5.0, 25.0))
    assert drive.log.mounts["laser"].position[0] == pytest.approx(MOUNT, abs=1e-5)
    assert len(drive.track) == 97
    assert len(drive.reference) == 17
    score = run_real(drive, LocalizerConfig.of(drive.log.sensors))
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


@pytest.mark.parametrize("name", MECHANISMS)
def test_each_mechanism_is_taken_out_by_settings_that_are_not_the_default(name: str) -> None:
    whole = LocalizerConfig()
    change = MECHANISMS[name]
    assert change(whole) != whole
    assert change(change(whole)) == change(whole)
    assert both()(whole) == whole


def test_drives_made_for_some_mechanisms_are_run_without_those_only() -> None:
    assert {name for names in SPECIAL.values() for name in names} <= set(MECHANISMS)
    assert {name for pair in PAIRS for name in pair} <= set(MECHANISMS)
    assert concerned("office", "debiasing")
    assert concerned("late scans, office", ALL)
    assert concerned("late scans, office", "debiasing + late readings")
    assert not concerned("late scans, office", "debiasing")


def test_table_of_the_ablation_shows_what_changed() -> None:
    sheet = Sheet()
    drive = [
        Figure("office", ALL, q, 1.0) for q in ("position", "heading", "NEES", "wrong", "doubt")
    ]
    log = [Figure("mirror", ALL, q, 2.0) for q in ("jumps", "first jump", "doubt")]
    same = [replace(f, method="a") for f in drive] + [Figure("office", "a", COST, 9.0, "ms")]
    other = [replace(f, method="b", value=3.0) for f in log]
    sheet.put("alone", [*drive, Figure("office", ALL, COST, 8.0, "ms"), *log], seconds=1.0)
    sheet.put("pairs", [*same, *other], seconds=1.0)
    table = ablation(sheet)
    assert "| office: position, heading, NEES, wrong, doubt |" in table
    assert "| all | 1, 1, 1, 1, 1 |" in table
    assert "| a | = |" in table
    assert "| b | 3, 3 |" in table
    assert "9" not in table


def test_table_of_the_ablation_marks_mechanisms_that_were_removed() -> None:
    sheet = Sheet()
    row = f"debiasing + {REMOVED[0]}"
    figures = [Figure("office", method, "position", 1.0) for method in (ALL, REMOVED[0], row)]
    sheet.put("alone", figures, seconds=1.0)
    table = ablation(sheet)
    assert f"| {REMOVED[0]} (removed) |" in table
    assert f"| debiasing + {REMOVED[0]} (removed) |" in table
    assert not set(REMOVED) & set(MECHANISMS)


def test_configurations_that_were_not_measured_are_listed() -> None:
    sheet = Sheet()
    sheet.put("alone", [Figure("office", ALL, "position", 1.0)], seconds=1.0)
    listed = unmeasured(sheet)
    assert all(f"*{name}*" in listed for name in MECHANISMS)
    assert f"*{ALL}*" not in listed
