"""Whole drives through the office, in lockstep: what the project promises, on real parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.trajectory import EmptyTrajectoryError
from localization.evaluation.tum_file import read_tum
from localization.maps.cloud import Cloud
from localization.types import Verdict
from robot_sim import World
from teleop.scenario.mission import Mission
from teleop.scenario.mission_run import run_in_process
from teleop.scenario.run_recorder import RunRecord
from teleop.scenario.run_summary import RunSummary

pytestmark = [pytest.mark.slow, pytest.mark.untraced, pytest.mark.timeout(600)]


def drive(
    mission: Mission, office: World, cloud: Cloud, cache: Path, folder: Path
) -> tuple[RunSummary, RunRecord]:
    return run_in_process(mission, office, cloud, folder, cache=cache)


@pytest.mark.long
def test_robot_stays_localised_all_the_way_round_the_office(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    summary, record = drive(Mission(seed=0), office, office_cloud, cache, tmp_path)
    assert summary.passed, summary.checks
    assert summary.distance >= 80.0
    assert [v.verdict for v in record.verdicts] == [Verdict.ACCEPTED]
    assert summary.health["tracking"] > 0.95
    assert summary.nees is not None
    assert 2.0 <= summary.nees <= 10.0


@pytest.mark.long
def test_slipping_wheels_do_not_carry_the_estimate_away(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    # What a slip did to the estimate shows at once; ten seconds after the last the drive may end.
    mission = Mission(seed=3, slip=(20.0, 31.03, 47.05, 62.5), duration=75.0)
    summary, _ = drive(mission, office, office_cloud, cache, tmp_path)
    assert summary.ate is not None
    assert summary.ate.position.max <= 0.10
    assert summary.health["slipping"] > 0.0
    assert summary.passed, summary.checks


@pytest.mark.long
def test_slip_is_noticed_even_when_it_sets_in_too_gently_for_the_tyre_test(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wheels 30 % too fast gain no impossible speed; KISS-ICP has to contradict them."""
    from robot_sim import SlipFault

    slips = (SlipFault(20 * 10**9, 2 * 10**9, 1.3),)
    monkeypatch.setattr(Mission, "slips", property(lambda self: slips))
    summary, record = drive(Mission(seed=3, duration=30.0), office, office_cloud, cache, tmp_path)
    slipping = [s.stamp / 1e9 for s in record.ticks if s.estimate.health == "slipping"]
    assert slipping
    assert 20.0 <= slipping[0] <= 20.6
    assert summary.ate is not None
    assert summary.ate.position.max <= 0.05


@pytest.mark.long
def test_same_seed_gives_the_same_bits_and_another_seed_does_not(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    files = ("readings.mcap", "estimate.tum", "truth.tum", "trace.csv")
    folders = [tmp_path / name for name in ("first", "again", "other")]
    for folder, seed in zip(folders, (5, 5, 6), strict=True):
        drive(Mission(seed=seed, duration=12.0), office, office_cloud, cache, folder)
    first, again, other = ([(f / name).read_bytes() for name in files] for f in folders)
    assert first == again
    assert all(a != b for a, b in zip(first, other, strict=True))


def test_robot_waits_for_a_better_hint_when_the_first_is_far_off(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    """A hint twelve metres off, claimed to be good to a decimetre, leads nowhere and is not followed."""
    mission = Mission(seed=1, pose_error=12.0, hint_sigma=0.1, hint_sigma_heading=3.0, duration=4.0)
    summary, record = drive(mission, office, office_cloud, cache, tmp_path)
    assert [v.verdict for v in record.verdicts] in ([Verdict.REJECTED], [Verdict.AMBIGUOUS])
    assert not summary.passed
    with pytest.raises(EmptyTrajectoryError):
        read_tum(tmp_path / "estimate.tum")
    assert np.ptp([s.truth.map_from_base.position[0] for s in record.ticks]) < 0.01
