from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.evaluation.consistency import consistency, health_shares, nees
from localization.evaluation.statistics import EvaluationError, Statistics
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import (
    align,
    associate,
    ate,
    errors,
    rpe,
    transformed,
)
from localization.geometry import so3_exp
from localization.types import SECOND, Health, Pose
from tests.support import floats, poses


def line(n: int = 11, *, step: float = 1.0, side: float = 0.0, yaw: float = 0.0) -> Trajectory:
    """A drive along x, a step [m] and a second at a time."""
    return Trajectory.from_poses((i * SECOND, Pose.planar(i * step, side, yaw)) for i in range(n))


def wander(seed: int, n: int = 40) -> Trajectory:
    """A path that turns in all directions."""
    rng = np.random.default_rng(seed)
    pose = Pose.identity()
    stamped = []
    for i in range(n):
        stamped.append((i * SECOND, pose))
        pose = pose @ Pose.from_rotation(rng.uniform(-1, 1, 3), so3_exp(rng.uniform(-1, 1, 3)))
    return Trajectory.from_poses(stamped)


def test_statistics_of_known_errors() -> None:
    s = Statistics.of([3.0, -4.0, 0.0, 0.0])
    assert (s.count, s.rmse, s.mean, s.median, s.max) == (4, 2.5, 1.75, 1.5, 4.0)
    assert Statistics.of(np.arange(101.0)).p95 == 95.0


@pytest.mark.parametrize("bad", [[], [np.nan]])
def test_statistics_of_nothing_are_refused(bad: list[float]) -> None:
    with pytest.raises(EvaluationError):
        Statistics.of(bad)


def test_parallel_drive_is_off_by_its_distance() -> None:
    result = ate(line(side=0.3, yaw=0.1), line())
    assert result.position.rmse == pytest.approx(0.3)
    assert result.horizontal.max == pytest.approx(0.3)
    assert result.heading.median == pytest.approx(0.1)


def test_height_counts_in_space_but_not_in_the_plane() -> None:
    up = transformed(line(), Pose.from_euler([0.0, 0.4, 0.3]))
    result = ate(up, line())
    assert result.position.mean == pytest.approx(0.5)
    assert result.horizontal.mean == pytest.approx(0.4)


def test_errors_are_truth_minus_estimate_in_the_axes_of_the_covariance() -> None:
    base = Pose.from_euler([1.0, 2.0, 0.0], yaw=np.pi / 2)
    turn = np.array([0.1, -0.2, 0.3])
    true = Pose.from_rotation(
        base.position + np.array([0.5, 0.0, 0.0]), base.rotation @ so3_exp(turn)
    )
    e = errors(Trajectory.from_poses([(0, base)]), Trajectory.from_poses([(0, true)]))
    assert e.vectors[0] == pytest.approx([0.5, 0.0, 0.0, *turn])


def test_heading_error_does_not_jump_at_half_a_turn() -> None:
    e = errors(line(yaw=np.pi - 0.1), line(yaw=-np.pi + 0.1))
    assert e.headings == pytest.approx(np.full(11, 0.2))


def test_equal_stamps_are_compared_as_they_are_and_others_interpolated() -> None:
    truth = line(3)
    kept, at = associate(truth, truth)
    assert at.positions.tobytes() == truth.positions.tobytes()
    between = Trajectory(
        truth.stamps[:2] + SECOND // 4, truth.positions[:2], truth.quaternions_wxyz[:2]
    )
    kept, at = associate(between, truth)
    assert len(kept) == 2
    assert at.positions[:, 0] == pytest.approx([0.25, 1.25])


def test_estimates_outside_the_truth_are_left_out_and_no_overlap_refused() -> None:
    kept, _ = associate(line(11), line(4))
    assert len(kept) == 4
    late = Trajectory(np.array([100 * SECOND]), np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]))
    with pytest.raises(EvaluationError, match=r"100\.000 to 100\.000 s.*0\.000 to 10\.000 s"):
        ate(late, line())
    with pytest.raises(EvaluationError, match="the estimate holds no poses"):
        ate(Trajectory.from_poses([]), line())


@given(seed=st.integers(0, 1000), motion=poses(50.0))
@settings(max_examples=40)
def test_ate_does_not_depend_on_where_the_map_begins(seed: int, motion: Pose) -> None:
    estimate, truth = wander(seed), wander(seed + 1)
    before = ate(estimate, truth).position
    after = ate(transformed(estimate, motion), transformed(truth, motion)).position
    assert after.rmse == pytest.approx(before.rmse, rel=1e-9)
    assert after.max == pytest.approx(before.max, rel=1e-9)


@given(seed=st.integers(0, 1000), motion=poses(50.0))
@settings(max_examples=40)
def test_alignment_finds_the_motion_between_two_frames(seed: int, motion: Pose) -> None:
    truth = wander(seed)
    moved = transformed(truth, motion.inverse())
    assert align(moved, truth).rotation == pytest.approx(motion.rotation, abs=1e-6)
    assert ate(moved, truth, aligned=True).position.max < 1e-6


@given(seed=st.integers(0, 1000))
@settings(max_examples=20)
def test_alignment_never_makes_it_worse_nor_mirrors(seed: int) -> None:
    estimate, truth = wander(seed), wander(seed + 1)
    assert np.linalg.det(align(estimate, truth).rotation) == pytest.approx(1.0)
    raw, aligned = ate(estimate, truth), ate(estimate, truth, aligned=True)
    assert aligned.position.rmse <= raw.position.rmse * (1 + 1e-12)


def test_straight_path_can_be_aligned() -> None:
    moved = transformed(line(), Pose.planar(3.0, 1.0, 0.5))
    assert ate(moved, line(), aligned=True).position.max < 1e-9


def test_rpe_of_a_wrong_scale_is_its_share_of_the_stretch() -> None:
    result = rpe(line(step=1.02), line(), distance=5.0)
    assert result.translation.count == 6
    assert result.translation.max == pytest.approx(0.1)
    assert result.rotation.max == pytest.approx(0.0, abs=1e-12)


def test_rpe_of_a_steady_turn_grows_with_time() -> None:
    turning = Trajectory.from_poses(
        (i * SECOND, Pose.planar(float(i), 0.0, 0.01 * i)) for i in range(11)
    )
    assert rpe(turning, line(), duration=2 * SECOND).rotation.mean == pytest.approx(0.02)


@given(seed=st.integers(0, 1000), motion=poses(50.0))
@settings(max_examples=20)
def test_rpe_does_not_care_where_the_estimate_began(seed: int, motion: Pose) -> None:
    truth = wander(seed)
    assert rpe(transformed(truth, motion), truth, distance=2.0).translation.max < 1e-9


def test_rpe_of_too_short_a_way_is_refused() -> None:
    with pytest.raises(EvaluationError, match="the whole way, 10, is shorter than a stretch, 20"):
        rpe(line(), line(), distance=20.0)
    with pytest.raises(EvaluationError, match="longer than nothing"):
        rpe(line(), line(), distance=0.0)
    with pytest.raises(EvaluationError, match="either a distance"):
        rpe(line(), line())


@given(seed=st.integers(0, 1000))
@settings(max_examples=10)
def test_nees_of_errors_drawn_from_the_covariance_averages_six(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 4000
    roots = rng.standard_normal((n, 6, 6)) + 3.0 * np.eye(6)
    drawn = np.einsum("nij,nj->ni", roots, rng.standard_normal((n, 6)))
    values = nees(drawn, roots @ roots.transpose(0, 2, 1))
    # Six standard deviations of the mean of n chi-square variables, and of a share of 95 %.
    assert values.mean() == pytest.approx(6.0, abs=6 * np.sqrt(12 / n))
    result = consistency(values, 6)
    assert result.mean_ratio == pytest.approx(1.0, abs=np.sqrt(12 / n))
    assert result.inside == pytest.approx(0.95, abs=6 * np.sqrt(0.95 * 0.05 / n))


def test_nees_of_known_errors() -> None:
    e = np.array([[2.0, 0.0, 0.0, 0.0, 0.0, 3.0]])
    p = np.diag([4.0, 1.0, 1.0, 1.0, 1.0, 9.0])[None]
    assert nees(e, p).tolist() == [2.0]
    assert nees(e, p, axes=(0, 1)).tolist() == [1.0]


def test_nees_wants_covariances_that_can_be() -> None:
    with pytest.raises(EvaluationError, match="covariance 1 must be positive definite"):
        nees(np.zeros((2, 6)), np.stack([np.eye(6), np.zeros((6, 6))]))
    with pytest.raises(EvaluationError, match="2 errors want as many"):
        nees(np.zeros((2, 6)), np.eye(6)[None])


@given(scale=floats(0.1, 10.0))
@settings(max_examples=20)
def test_overconfidence_shows_as_its_square(scale: float) -> None:
    e = np.random.default_rng(0).standard_normal((100, 6))
    honest = consistency(nees(e, np.repeat(np.eye(6)[None], 100, axis=0)), 6)
    shrunk = consistency(nees(e, np.repeat(np.eye(6)[None] / scale**2, 100, axis=0)), 6)
    assert shrunk.mean_ratio == pytest.approx(scale**2 * honest.mean_ratio)


def test_nis_is_judged_by_each_registrations_own_freedom() -> None:
    result = consistency([3.0, 6.0, 0.0, 30.0], [3, 6, 0, 6])
    assert result.count == 3
    assert result.mean_ratio == pytest.approx((1.0 + 1.0 + 5.0) / 3)
    assert result.inside == pytest.approx(2 / 3)
    with pytest.raises(EvaluationError, match="no values"):
        consistency([0.0], [0])


def test_each_state_holds_until_the_next_estimate() -> None:
    stamps = np.array([0, 1, 4, 10]) * SECOND
    states = [Health.WAITING, Health.TRACKING, Health.LOST, Health.TRACKING]
    shares = health_shares(stamps, states)
    assert shares[Health.WAITING] == pytest.approx(0.1)
    assert shares[Health.TRACKING] == pytest.approx(0.3)
    assert shares[Health.LOST] == pytest.approx(0.6)
    assert sum(shares.values()) == pytest.approx(1.0)
    assert health_shares(stamps[:1], states[:1])[Health.WAITING] == 1.0
    with pytest.raises(EvaluationError, match="as many stamps"):
        health_shares(stamps, states[:2])
