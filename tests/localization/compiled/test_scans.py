from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from localization.compiled.scans import are_near, carried, interpolated
from localization.geometry import FloatArray, so3_exp, so3_log
from localization.types import Pose
from tests.support import floats, rotation_vectors, vectors

Track = tuple[np.ndarray, list[Pose]]


@st.composite
def tracks(draw: st.DrawFn) -> Track:
    times = sorted(draw(st.lists(st.integers(0, 10**12), min_size=2, max_size=6, unique=True)))
    n = len(times)
    positions = draw(hnp.arrays(float, (n, 3), elements=floats(-10.0, 10.0)))
    turns = [so3_exp(draw(rotation_vectors(3.0))) for _ in range(n)]
    return np.array(times), list(map(Pose.from_rotation, positions, turns))


def poses_at(stamps: np.ndarray, track: Track) -> list[Pose]:
    return list(map(Pose, *interpolated(stamps, *arrays(track))))


def arrays(track: Track) -> tuple[np.ndarray, FloatArray, FloatArray]:
    times, poses = track
    return (
        times,
        np.array([p.position for p in poses]),
        np.array([p.quaternion_wxyz for p in poses]),
    )


@pytest.mark.slow
@given(track=tracks())
def test_interpolation_passes_through_its_knots_and_is_clamped_to_its_ends(track: Track) -> None:
    times, knots = track
    found = poses_at(np.array([times[0] - 5, *times, times[-1] + 5]), track)
    for pose, expected in zip(found, [knots[0], *knots, knots[-1]], strict=True):
        assert pose.position == pytest.approx(expected.position, abs=1e-12)
        assert pose.rotation == pytest.approx(expected.rotation, abs=1e-12)


@pytest.mark.slow
@given(track=tracks(), seed=st.integers(0, 100))
def test_interpolated_poses_move_and_turn_evenly_from_knot_to_knot(track: Track, seed: int) -> None:
    times, knots = track
    rng = np.random.default_rng(seed)
    k = rng.integers(0, len(times) - 1, 30)
    share = rng.integers(0, times[k + 1] - times[k]) / (times[k + 1] - times[k])
    found = poses_at(times[k] + np.round(share * (times[k + 1] - times[k])).astype(int), track)
    for pose, j, f in zip(found, k, share, strict=True):
        begin, end = knots[j], knots[j + 1]
        turned = so3_exp(f * so3_log(begin.rotation.T @ end.rotation))
        assert pose.rotation == pytest.approx(begin.rotation @ turned, abs=1e-9)
        assert pose.position == pytest.approx(begin.position + f * (end.position - begin.position))


@given(a=rotation_vectors(), w=rotation_vectors(3.0), start=vectors(3), end=vectors(3))
def test_halfway_is_half_the_way_and_half_the_turn(
    a: FloatArray, w: FloatArray, start: FloatArray, end: FloatArray
) -> None:
    first = so3_exp(a)
    knots = [Pose.from_rotation(start, first), Pose.from_rotation(end, first @ so3_exp(w))]
    (pose,) = poses_at(np.array([5]), (np.array([0, 10]), knots))
    assert pose.position == pytest.approx(0.5 * (start + end), abs=1e-12)
    assert pose.rotation == pytest.approx(first @ so3_exp(0.5 * w), abs=1e-9)


def test_nanoseconds_after_years_are_distinguished() -> None:
    start = 2**62
    knots = [Pose.planar(0.0, 0.0, 0.0), Pose.planar(10.0, 0.0, 0.0)]
    (pose,) = poses_at(np.array([start + 3]), (np.array([start, start + 10]), knots))
    assert pose.position[0] == pytest.approx(3.0)


@pytest.mark.slow
@given(track=tracks(), seed=st.integers(0, 100))
def test_carried_points_are_where_the_base_saw_them(track: Track, seed: int) -> None:
    rng = np.random.default_rng(seed)
    times, _ = track
    stamps = rng.integers(times[0], times[-1], 20)
    points = rng.uniform(-5.0, 5.0, (2, 20, 3))
    now = Pose.from_euler([3.0, -1.0, 0.2], roll=0.1, pitch=-0.2, yaw=2.0)
    found = carried(points, stamps, *arrays(track), now.position, now.quaternion_wxyz)
    for i, pose in enumerate(poses_at(stamps, track)):
        expected = now.inverse().apply(pose.apply(points[:, i]))
        assert found[:, i] == pytest.approx(expected, abs=1e-10)


def test_points_are_near_whatever_the_order_of_the_others() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [9.0, 0.0]])
    others = np.array([[2.1, 0.0], [0.0, 0.1], [0.9, 0.0], [0.95, 0.0]])
    for order in (others, others[::-1].copy()):
        assert are_near(points, order, 0.2).tolist() == [True, True, True, False]
