"""A small part of ``python -m benchmarks localization``, with limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.localization.alarms import FLAGGED, Watch
from benchmarks.localization.drives import SLIPS
from benchmarks.localization.searching import hint_trial, kidnap_trial, searcher_of
from benchmarks.replay.matchers import SmallGicp, plain
from benchmarks.replay.recordings import Recording, record
from benchmarks.replay.replaying import Run, bootstrap_rmse, replay, replay_monte_carlo, score
from localization.evaluation.fault_injection import (
    Clutter,
    Span,
    end_of,
    kidnapped,
    occluded,
    slipping,
)
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.matchers import Matcher
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health
from robot_sim import MOUNTS, World
from robot_sim.building_generator import generate
from robot_sim.worlds.from_floorplan import build_world
from teleop.world_building.station_survey import survey_from_stations

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


pytestmark = pytest.mark.slow


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


def test_peers_localise_on_the_same_sweeps_that_we_are_measured_on(
    recording: Recording, world: PreparedMap, nominal: Run
) -> None:
    """Each peer must localise, for else the comparison in the benchmarks would say nothing."""
    ours = score(nominal)
    assert ours.rmse <= 0.01
    kiss = replay(recording, Localizer(world, recording.mounts, plain(Matcher.KISS)))
    gicp = replay(
        recording,
        Localizer(world, recording.mounts, plain(Matcher.PLANE), matcher=SmallGicp(world)),
    )
    particles = replay_monte_carlo(nominal, world, height=HEIGHT)
    for peer, farthest in ((kiss, 0.15), (gicp, 0.15), (particles, 0.5)):
        result = score(peer)
        assert result.sweeps == ours.sweeps
        assert result.rmse <= farthest


def test_hints_far_off_are_found_and_none_is_taken_wrongly(
    nominal: Run, world: PreparedMap
) -> None:
    searcher, rng = searcher_of(world, HEIGHT), np.random.default_rng(1)
    trials = [hint_trial(searcher, nominal.moments[i], rng) for i in range(20, 116, 8)]
    assert sum(t.right for t in trials) >= len(trials) - 1
    assert not [t.story for t in trials if t.wrong]
    trial = kidnap_trial(searcher, nominal.moments[20:])
    assert trial.right
    assert not trial.wrong


def test_the_goal_for_slipping_wheels_is_kept(recording: Recording, world: PreparedMap) -> None:
    spans = [Span(round(t * SECOND), round((t + 1.0) * SECOND)) for t in (SLIPS[0], SLIPS[0] + 3.0)]
    slipped = recording.with_fault("slip", tuple(slipping(recording.readings, spans)))
    result = score(replay(slipped, Localizer(world, recording.mounts)))
    assert result.sweeps > 90
    assert result.most <= 0.05


@pytest.mark.long
def test_generated_building_keeps_the_same_goals(cache: Path) -> None:
    plan = generate(801, 60.0).plan
    house = build_world(plan)
    map_ = prepare(survey_from_stations(house), cache=cache)
    drive = record(house, name="house", seed=6, seconds=12.0)
    run = replay(drive, Localizer(map_, drive.mounts))
    result = score(run)
    assert result.sweeps > 70
    assert result.rmse <= 0.01
    assert result.most <= 0.05
    assert result.yaw <= np.deg2rad(0.2)
    searcher = searcher_of(map_, HEIGHT)
    trial = kidnap_trial(searcher, run.moments[20:])
    assert not trial.wrong


def test_robot_that_is_carried_away_says_so_and_finds_itself(
    recording: Recording, world: PreparedMap, office: World
) -> None:
    there = record(office, name="there", seed=5, seconds=44.0)
    elsewhere = [r for r in there.readings if end_of(r) > 30 * SECOND]
    begun = [r for r in recording.readings if end_of(r) < 8 * SECOND]
    run = replay(
        recording.with_fault("carried", tuple(kidnapped(begun, elsewhere))),
        Localizer(world, recording.mounts),
    )
    after = [w for w in run.words if w.stamp > 8 * SECOND]
    doubted = [w for w in after if w.health in (Health.SUSPECT, *FLAGGED)]
    assert doubted
    assert doubted[0].stamp <= 10 * SECOND
    last = after[-1]
    shift = last.stamp - max(end_of(r) for r in elsewhere)
    truth = there.truth[min(there.truth, key=lambda s: abs(s + shift - last.stamp))]
    assert last.estimate is not None
    assert last.health not in FLAGGED
    assert float(np.linalg.norm(last.estimate.position - truth.position)) <= 0.10


def test_false_alarms_are_counted_at_their_onset() -> None:
    seen = Watch()
    states = [
        (0.0, Health.TRACKING),
        (0.01, Health.LOST),  # false
        (0.01, Health.RELOCALISING),  # the same one
        (0.01, Health.TRACKING),
        (0.9, Health.LOST),  # true
        (0.01, Health.SUSPECT),  # a false doubt
    ]
    for i, (far, health) in enumerate(states):
        seen.see(i * SECOND // 10, far, 0.0, health, "")
    assert (seen.lost, seen.suspect, seen.missed) == (1, 1, 0)
    for i in range(30):
        seen.see((i + 6) * SECOND // 10, 0.9, 0.0, Health.TRACKING, "")
    assert seen.missed == 1
    assert seen.seconds == pytest.approx(3.5)


def test_bootstrapped_bounds_hold_the_error_between_them_and_narrow_with_more_of_it() -> None:
    rng = np.random.default_rng(2)
    short, long = np.abs(rng.standard_normal(300)), np.abs(rng.standard_normal(9000))
    for far in (short, long):
        low, high = bootstrap_rmse(far)
        assert low <= float(np.sqrt(np.mean(far**2))) <= high
    assert np.ptp(bootstrap_rmse(long)) < np.ptp(bootstrap_rmse(short))
