from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.localization_history import (
    SWEEP_COLUMNS,
    History,
    write_covariances,
    write_health,
)
from localization.types import Estimate, Health, Match, Pose, ScanConsistency, Twist


def estimate(
    stamp: int, health: Health, *, match: Match | None = None, known: bool = True
) -> Estimate:
    spread = np.arange(1.0, 7.0) * (1.0 + stamp)
    return Estimate(
        stamp,
        Pose.planar(float(stamp), 0.0, 0.0) if known else None,
        Pose.identity(),
        np.diag(spread) + 0.1,
        Twist.planar(0.0, 0.0),
        health,
        (f"at {stamp}",),
        match,
        nis=None if match is None else 2.5,
        consistency=None if match is None else ScanConsistency(0.3, 0.1, 0.15, 0.05),
    )


def half_seen(stamp: int) -> Match:
    """Two directions: along x, and a mix of y and yaw."""
    mixed = np.array([0.0, 0.6, 0.0, 0.0, 0.0, 0.8])
    directions = np.stack([np.eye(6)[0], mixed])
    return Match(stamp, Pose.identity(), np.eye(6), directions, np.zeros(5), 0.75)


@pytest.fixture
def history() -> History:
    kept = History()
    kept.add(estimate(1, Health.WAITING, known=False))
    kept.add(estimate(2, Health.WAITING, known=False))
    kept.add(estimate(3, Health.TRACKING, match=half_seen(3)))
    kept.add(estimate(4, Health.TRACKING))
    kept.add(estimate(5, Health.LOST))
    return kept


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_pose_has_its_covariance_in_the_table(history: History, tmp_path: Path) -> None:
    write_covariances(tmp_path / "c.csv", history)
    rows = table(tmp_path / "c.csv")
    assert [int(r["stamp_ns"]) for r in rows] == history.trajectory().stamps.tolist() == [3, 4, 5]
    axes = ("x", "y", "z", "rx", "ry", "rz")
    for row, covariance in zip(rows, history.covariances(), strict=True):
        assert len(row) == 1 + 21
        for i, a in enumerate(axes):
            for j, b in enumerate(axes[i:], start=i):
                assert float(row[f"cov_{a}_{b}"]) == covariance[i, j]


def test_sweeps_and_changes_of_health_have_rows(history: History, tmp_path: Path) -> None:
    write_health(tmp_path / "h.csv", history.sweeps)
    rows = table(tmp_path / "h.csv")
    assert tuple(rows[0]) == SWEEP_COLUMNS
    assert [(r["stamp_ns"], r["health"]) for r in rows] == [
        ("1", "waiting"), ("3", "tracking"), ("5", "lost"),
    ]  # fmt: skip
    assert [r["inlier_ratio"] for r in rows] == ["", "0.75", ""]
    swept = rows[1]
    assert (swept["unexplained"], swept["free_space_violation"], swept["nis"]) == (
        "0.3",
        "0.15",
        "2.5",
    )
    assert swept["observable_directions"] == "2"
    assert json.loads(swept["reasons"]) == ["at 3"]


def test_observability_is_the_share_of_each_axis(history: History) -> None:
    (row,) = (r for r in history.sweeps if r.observable_directions is not None)
    np.testing.assert_allclose(row.observability, [1.0, 0.36, 0.0, 0.0, 0.0, 0.64])
