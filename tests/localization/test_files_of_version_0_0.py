"""Files that version 0.0 wrote are read by today's code, whatever was renamed since."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from localization.calibration.mount_file import read_mounts
from localization.evaluation.estimate_trace import read_trace
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import ate
from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_log import McapLog, read_log
from localization.pipeline.localizer import LocalizerConfig
from localization.pipeline.log_replay import config_of, localize, settings_left_out
from localization.types import Health, Verdict
from teleop.scene_clouds import scene_cloud_path

WRITTEN = Path(__file__).parents[1] / "data/written_by_0_0"
RUN = WRITTEN / "run"
REMOVED: tuple[str, ...] = (
    "ekf.kappa",
    "ekf.kappa_walk",
    "health.disagreements",
    "health.opinion_distance",
    "health.opinion_yaw",
    "search.budget",
    "map_search.budget",
    "hypotheses.nowhere",
    "second_opinion",
    "opinion_period",
    "lost_search_period",
)
"""Settings of version 0.0 that were removed on purpose."""


@pytest.fixture
def log() -> McapLog:
    return read_log(RUN / "readings.mcap")


def test_log_gives_all_its_readings(log: McapLog) -> None:
    kinds = Counter(type(reading).__name__ for reading in log)
    assert kinds == {"WheelSpeeds": 150, "Inertial": 150, "Scan": 60, "Hint": 1}
    assert log.complete
    assert not log.skipped
    assert log.wheel_radius == 0.110475
    assert log.mounts["laser_horizontal"].position.tolist() == [0.125, 0.0, 0.4]


def test_configuration_in_the_log_is_understood(log: McapLog) -> None:
    """The run used the defaults of its time, which renaming does not change."""
    assert settings_left_out(log) == REMOVED
    assert config_of(log) == LocalizerConfig()


@pytest.mark.slow
def test_log_is_localised_as_it_was(cache: Path) -> None:
    """What the filter assumes of the wheels is not the same, so the positions are compared to a millimetre.

    A hint may be answered a few readings earlier or later than it was.
    """
    run = localize(RUN / "readings.mcap", scene_cloud_path("office"), cache=cache)
    before = read_tum(RUN / "estimate.tum")
    now = Trajectory.from_estimates(run.estimates)
    assert [v.verdict for v in run.verdicts] == [Verdict.ACCEPTED]
    assert abs(len(now.stamps) - len(before.stamps)) < 5
    _, here, there = np.intersect1d(now.stamps, before.stamps, return_indices=True)
    assert len(here) > 80
    np.testing.assert_allclose(now.positions[here], before.positions[there], atol=1e-3)


def test_trajectories_are_read_and_compared() -> None:
    errors = ate(read_tum(RUN / "estimate.tum"), read_tum(RUN / "truth.tum"))
    assert 0.0 < errors.position.rmse < 0.02


def test_trace_is_read() -> None:
    rows = read_trace(RUN / "trace.csv")
    healths = Counter(row.health for row in rows)
    assert len(rows) == 150
    assert healths[Health.WAITING] > 0
    assert healths[Health.TRACKING] > 0
    matched = [row for row in rows if row.inlier_ratio is not None]
    assert len(matched) > 10
    assert all(row.observable_directions == 6 and row.nis is not None for row in matched)
    assert rows[0].reasons


def test_mounts_are_read(log: McapLog) -> None:
    mounts = read_mounts(WRITTEN / "mounts.toml")
    assert mounts.keys() == log.mounts.keys()
    for name, mount in mounts.items():
        np.testing.assert_allclose(mount.rotation, log.mounts[name].rotation, atol=1e-15)
