"""What registers sweeps can be chosen, left out, or handed in."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import FixedCovariance, Matcher, match_at, matcher_of
from localization.matching.registration import RegistrationConfig, register, residuals
from localization.motion.kiss_icp import KissConfig
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND, Estimate, Hint, Match, Pose, Sweep
from tests.support_rooms import HALL, MOUNTS, Drive, apart

START = Pose.planar(3.5, 2.0, 0.3)
PRIOR = np.diag(np.square([0.03, 0.03, 0.01, 0.005, 0.005, 0.01]))


def drive_of(seconds: float = 4.0) -> Drive:
    return Drive(HALL, START, (1.0, 0.0, 0.0), (seconds, 0.3, 0.25), seed=3)


def localized(drive: Drive, localizer: Localizer) -> list[Estimate]:
    estimates = []
    hinted = False
    for reading in drive.readings():
        if not hinted and reading.stamp >= SECOND // 2:
            hinted = True
            localizer.add(Hint(reading.stamp, START, np.zeros((6, 6))))
        estimates.append(localizer.add(reading))
    return estimates


@pytest.mark.parametrize("kind", [Matcher.PLANE, Matcher.KISS])
def test_every_matcher_draws_a_pose_towards_the_true_one(hall: PreparedMap, kind: Matcher) -> None:
    match = matcher_of(kind, hall, RegistrationConfig(), KissConfig(), FixedCovariance())
    sweep = HALL.sweep(START, noise=0.01, seed=1)
    prior = START @ Pose.planar(0.04, -0.03, 0.01)
    found = match(sweep, prior, PRIOR)
    assert found.inlier_ratio > 0.9
    far, turned = apart(found.map_from_base, START)
    assert far < 0.02
    assert turned < 0.01


def test_kiss_is_taken_to_know_what_its_configuration_says(hall: PreparedMap) -> None:
    fixed = FixedCovariance(position=0.1, angle=0.2)
    match = matcher_of(Matcher.KISS, hall, RegistrationConfig(), KissConfig(), fixed)
    found = match(HALL.sweep(START), START, PRIOR)
    assert np.diag(np.linalg.inv(found.information)) == pytest.approx([0.01] * 3 + [0.04] * 3)
    assert np.array_equal(found.observable_directions, np.eye(6))


def test_kiss_without_points_knows_nothing(hall: PreparedMap) -> None:
    match = matcher_of(Matcher.KISS, hall, RegistrationConfig(), KissConfig(), FixedCovariance())
    nothing = Sweep(0, np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=bool))
    found = match(nothing, START, PRIOR)
    assert not found.information.any()
    assert found.observable_directions.shape == (0, 6)
    assert found.inlier_ratio == 0.0


def test_match_of_another_matcher_reports_the_share_explained_at_its_pose(
    hall: PreparedMap,
) -> None:
    sweep = HALL.sweep(START)
    there = match_at(sweep, hall, START, np.eye(6), np.eye(6))
    beside = match_at(sweep, hall, START @ Pose.planar(0.3, 0.2, 0.0), np.eye(6), np.eye(6))
    assert there.inlier_ratio > 0.95
    assert beside.inlier_ratio < 0.6


def test_walls_are_not_matched_from_behind_but_with_the_facing_gate_off(hall: PreparedMap) -> None:
    outside = Pose.planar(-1.0, 3.0, 0.0)
    points = np.stack([np.full(50, 0.98), np.linspace(-1.0, 1.0, 50), np.full(50, 1.8)], axis=1)
    sweep = Sweep(0, points, np.zeros((50, 3)), np.ones(50, dtype=bool))
    assert not residuals(sweep, hall, outside).valid.any()
    assert residuals(sweep, hall, outside, backface_culling=False).valid.all()
    assert register(sweep, hall, outside, PRIOR).inlier_ratio == 0.0


def test_without_a_matcher_the_robot_goes_by_its_own_motion_and_is_never_searched_for(
    hall: PreparedMap,
) -> None:
    drive = drive_of()
    config = LocalizerConfig(matcher=Matcher.NONE, kiss_odometry=False)
    estimates = localized(drive, Localizer(hall, MOUNTS, config))
    placed = [e for e in estimates if e.map_from_base is not None]
    assert placed
    assert all(e.match is None for e in estimates)
    spread = [float(e.covariance[0, 0]) for e in placed]
    assert spread[-1] > spread[0]
    assert placed[-1].map_from_base is not None
    far, _ = apart(placed[-1].map_from_base, drive.pose(drive.end))
    assert far < 0.1


def test_the_parts_that_the_ablation_leaves_out_leave_a_localiser_that_works(
    hall: PreparedMap,
) -> None:
    drive = drive_of(2.0)
    config = LocalizerConfig(
        kiss_odometry=False,
        good_inlier_ratio=2.0,
        registration=RegistrationConfig(debias=0.0),
    )
    last = localized(drive, Localizer(hall, MOUNTS, config))[-1]
    assert last.map_from_base is not None
    assert apart(last.map_from_base, drive.pose(drive.end))[0] < 0.03


def test_a_matcher_that_is_handed_in_is_the_one_that_is_asked(hall: PreparedMap) -> None:
    asked: list[int] = []

    def ours(sweep: Sweep, prior: Pose, covariance: np.ndarray) -> Match:
        asked.append(sweep.stamp)
        return register(sweep, hall, prior, covariance)

    drive = drive_of(1.0)
    estimates = localized(drive, Localizer(hall, MOUNTS, matcher=ours))
    assert asked == [e.match.stamp for e in estimates if e.match is not None]
    assert asked


def test_nonsense_is_refused(hall: PreparedMap) -> None:
    with pytest.raises(ValueError, match="'plane', 'kiss', 'none'"):
        LocalizerConfig(matcher="icp")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="registers nothing"):
        matcher_of(Matcher.NONE, hall, RegistrationConfig(), KissConfig(), FixedCovariance())
