"""Localised logs as recordings: what is drawn, and what is not drawn again and again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory
from localization.report.rerun_recording import LogRecording
from localization.types import (
    SECOND,
    Candidate,
    Estimate,
    Health,
    Hint,
    HintVerdict,
    Match,
    Pose,
    Sweep,
    Twist,
    Verdict,
)
from tests.support_rooms import HALL, MOUNTS
from tests.teleop.operator.support import column, events, rows

BEGIN = 1_700_000_000 * SECOND
"""Logs may count from 1970."""


def seen(stamp: int, pose: Pose) -> Estimate:
    """An estimate with a sweep of fifty points."""
    points = np.random.default_rng(stamp % 97).uniform(-2.0, 2.0, (50, 3))
    sweep = Sweep(stamp, points, np.zeros((50, 3)), np.zeros(50, dtype=bool))
    match = Match(stamp, pose, np.eye(6), np.eye(6), np.full(50, 0.01), 0.9)
    return Estimate(
        stamp, pose, Pose.identity(), 1e-4 * np.eye(6), Twist.planar(0.0, 0.0), Health.TRACKING,
        match=match, sweep=sweep, nis=1.5,
    )  # fmt: skip


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "log.rrd"
    truth = Trajectory.from_poses([(0, Pose.identity()), (SECOND, Pose.planar(1.0, 0.0, 0.0))])
    record = LogRecording(path, HALL.cloud(0.2), MOUNTS, truth)
    start = Pose.planar(2.0, 2.0, 0.0)
    waiting = replace(
        seen(BEGIN, start), map_from_base=None, match=None, sweep=None, health=Health.RELOCALISING,
        reasons=("2 places explain what is seen: drive on to make sure",),
        hypotheses=(Candidate(start, 0.9), Candidate(Pose.planar(5.0, 4.0, 1.0), 0.8)),
    )  # fmt: skip
    record.show(waiting)
    hint = Hint(BEGIN, Pose.planar(2.5, 2.0, 0.1), 0.1 * np.eye(6))
    answer = HintVerdict(BEGIN, hint, Verdict.ACCEPTED, "explains 90%", (Candidate(start, 0.9),))
    record.show(replace(seen(BEGIN + SECOND // 10, start), verdict=answer))
    # It stands for five seconds, then drives a metre in two; between sweeps nothing is new.
    for i in range(2, 72):
        along = max(0.0, (i - 52) * 0.05)
        record.show(seen(BEGIN + i * SECOND // 10, start @ Pose.planar(along, 0.0, 0.0)))
        between = seen(BEGIN + i * SECOND // 10 + 1, start)
        record.show(replace(between, match=None, sweep=None))
    record.close()
    return path


def test_map_paths_hypotheses_hint_and_plots_are_there(recording: Path) -> None:
    drawn = rows(recording)
    for entity in (
        "map/cloud", "map/live", "map/path/estimate", "map/path/truth", "map/hypotheses",
        "map/hint/ghost", "map/uncertainty", "state/health", "plots/nis/nis", "plots/fit/fit",
    ):  # fmt: skip
        assert drawn.get(entity, 0) > 0, entity


def test_standing_robot_gives_a_small_recording(recording: Path) -> None:
    # Once a second while it stands, then every two decimetres.
    assert rows(recording)["map/live"] < 20


def test_events_are_logged(recording: Path) -> None:
    texts = [text for _, text in events(recording)]
    assert any("2 places explain" in text for text in texts)
    assert "hint accepted: explains 90%" in texts
    assert any(text.startswith("tracking: nominal") for text in texts)


def test_plots_hold_one_value_for_each_sweep(recording: Path) -> None:
    values = column(recording, "plots/nis/nis", "Scalars:scalars")
    assert len(values) == 71
