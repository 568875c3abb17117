from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.evaluation.error_statistics import EvaluationError
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
from localization.types import SECOND, Pose
from tests.support import poses


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


def test_estimates_outside_the_truth_are_left_out_and_no_overlap_rejected() -> None:
    kept, _ = associate(line(11), line(4))
    assert len(kept) == 4
    late = Trajectory(np.array([100 * SECOND]), np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]))
    with pytest.raises(EvaluationError, match=r"100\.000 to 100\.000 s.*0\.000 to 10\.000 s"):
        ate(late, line())
    with pytest.raises(EvaluationError, match="the estimate holds no poses"):
        ate(Trajectory.from_poses([]), line())


@given(seed=st.integers(0, 1000), motion=poses(50.0))
@settings(max_examples=40)
def test_ate_does_not_depend_on_the_origin_of_the_map(seed: int, motion: Pose) -> None:
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


def test_rpe_of_a_wrong_scale_is_its_share_of_the_segment() -> None:
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
def test_rpe_does_not_depend_on_the_estimates_origin(seed: int, motion: Pose) -> None:
    truth = wander(seed)
    assert rpe(transformed(truth, motion), truth, distance=2.0).translation.max < 1e-9


def test_rpe_of_too_short_a_way_is_rejected() -> None:
    with pytest.raises(EvaluationError, match="the whole path, 10, is shorter than a segment, 20"):
        rpe(line(), line(), distance=20.0)
    with pytest.raises(EvaluationError, match="positive length"):
        rpe(line(), line(), distance=0.0)
    with pytest.raises(EvaluationError, match="either a distance"):
        rpe(line(), line())
