"""A small part of ``python -m benchmarks localization``, with limits: the figures hold on every commit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks._peers import SmallGicp, plain
from benchmarks._recordings import Recording, record
from benchmarks._replaying import Run, bootstrap_rmse, replay, replay_monte_carlo, score, wilson
from benchmarks._searching import hint_trial, kidnap_trial, searcher_of
from localization.cloud import Cloud
from localization.faults import Clutter, occluded
from localization.localizer import Localizer
from localization.matching import Matcher
from localization.prepared import PreparedMap, prepare
from robot_sim import MOUNTS, World

HEIGHT = float(MOUNTS["laser_horizontal"].position[2])


@pytest.fixture(scope="module")
def world(office_cloud: Cloud, cache: Path) -> PreparedMap:
    return prepare(office_cloud, cache=cache)


@pytest.fixture(scope="module")
def recording(office: World) -> Recording:
    return record(office, name="office", seed=5, seconds=14.0)


@pytest.fixture(scope="module")
def nominal(recording: Recording, world: PreparedMap) -> Run:
    return replay(recording, Localizer(world, recording.mounts))


pytestmark = [pytest.mark.slow]


def test_the_goal_for_a_plain_drive_is_kept(nominal: Run) -> None:
    result = score(nominal)
    assert result.sweeps > 90
    assert result.rmse <= 0.01
    assert result.most <= 0.05
    assert result.yaw <= np.deg2rad(0.2)
    assert result.inside >= 0.9
    assert result.lost == 0.0


def test_the_goal_for_a_crowd_about_the_robot_is_kept(
    recording: Recording, world: PreparedMap
) -> None:
    hidden = tuple(occluded(recording.readings, Clutter(0.3), seed=5))
    crowded = recording.with_fault("crowd", hidden)
    result = score(replay(crowded, Localizer(world, recording.mounts)))
    assert result.sweeps > 90
    assert result.rmse <= 0.015


def test_peers_follow_the_same_readings_and_none_is_nearer(
    recording: Recording, world: PreparedMap, nominal: Run
) -> None:
    ours = score(nominal)
    kiss = replay(recording, Localizer(world, recording.mounts, plain(Matcher.KISS)))
    gicp = replay(
        recording,
        Localizer(world, recording.mounts, plain(Matcher.PLANE), matcher=SmallGicp(world)),
    )
    particles = replay_monte_carlo(nominal, world, height=HEIGHT)
    for peer, farthest in ((kiss, 0.15), (gicp, 0.15), (particles, 0.5)):
        result = score(peer)
        assert result.sweeps == ours.sweeps
        assert ours.rmse <= result.rmse <= farthest


def test_hints_far_off_are_found_and_none_is_taken_wrongly(
    nominal: Run, world: PreparedMap
) -> None:
    searcher, rng = searcher_of(world, HEIGHT), np.random.default_rng(1)
    trials = [hint_trial(searcher, nominal.moments[i], rng) for i in range(20, 116, 8)]
    assert sum(t.right for t in trials) >= len(trials) - 1
    assert not [t for t in trials if t.accepted and not t.right]
    trial = kidnap_trial(searcher, nominal.moments[20:])
    assert trial.right
    assert not trial.wrong


def test_bounds_of_a_share_are_wilsons() -> None:
    # Brown, Cai and DasGupta 2001: 0 of 10 is up to 27.8 %, 5 of 10 is 23.7 to 76.3 %.
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-3)
    assert wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-3)
    assert wilson(0, 0) == (0.0, 1.0)


def test_bootstrapped_bounds_hold_the_error_between_them_and_narrow_with_more_of_it() -> None:
    rng = np.random.default_rng(2)
    short, long = np.abs(rng.standard_normal(300)), np.abs(rng.standard_normal(9000))
    for far in (short, long):
        low, high = bootstrap_rmse(far)
        assert low <= float(np.sqrt(np.mean(far**2))) <= high
    assert np.ptp(bootstrap_rmse(long)) < np.ptp(bootstrap_rmse(short))
