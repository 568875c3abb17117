from __future__ import annotations

from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest
from hypothesis import given

from localization.geometry import FloatArray
from localization.types import (
    Candidate,
    Estimate,
    Health,
    Hint,
    HintVerdict,
    Inertial,
    InvalidReadingError,
    Pose,
    Scan,
    Sweep,
    Twist,
    Verdict,
    WheelSpeeds,
)
from tests.support import a_scan, bits, floats, poses, scans, vectors

HINT = Hint(5, Pose.identity(), np.zeros((6, 6)))
SWEEP = Sweep(1, np.zeros((2, 3)), np.zeros((2, 3)), np.array([True, False]))
ESTIMATE = Estimate(0, None, Pose.identity(), np.eye(6), Twist.planar(0.0, 0.0), Health.WAITING)
VALUES = [
    Pose.identity(),
    Twist.planar(1.0, 0.5),
    a_scan(),
    WheelSpeeds(0, 0.5, 0.5),
    Inertial(0, np.zeros(3), np.zeros(3)),
    HINT,
    SWEEP,
    ESTIMATE,
    HintVerdict(1, HINT, Verdict.KEPT, "fits", (Candidate(Pose.identity(), 0.9),)),
]


def assert_near(a: Pose, b: Pose, tolerance: float = 1e-10) -> None:
    assert a.position == pytest.approx(b.position, abs=tolerance)
    assert a.rotation == pytest.approx(b.rotation, abs=tolerance)


@given(a=poses())
def test_identity_changes_nothing(a: Pose) -> None:
    assert_near(a @ Pose.identity(), a)
    assert_near(Pose.identity() @ a, a)


@given(a=poses())
def test_inverse_undoes(a: Pose) -> None:
    assert_near(a @ a.inverse(), Pose.identity())
    assert_near(a.inverse() @ a, Pose.identity())


def test_rotation_stays_one_however_often_poses_are_composed() -> None:
    step, pose = Pose.from_euler([0.01, 0.0, 0.0], roll=0.3, pitch=-0.2, yaw=0.7), Pose.identity()
    for _ in range(20_000):
        pose = pose @ step
    assert pose.quaternion_wxyz @ pose.quaternion_wxyz == pytest.approx(1.0, abs=2e-12)
    assert pose.rotation.T @ pose.rotation == pytest.approx(np.eye(3), abs=1e-11)


@given(a=poses(), b=poses(), points=vectors(12))
def test_composition_applies_the_right_hand_motion_first(
    a: Pose, b: Pose, points: FloatArray
) -> None:
    cloud = points.reshape(4, 3)
    assert (a @ b).apply(cloud) == pytest.approx(a.apply(b.apply(cloud)), abs=1e-9)
    assert a.apply(cloud)[0] == pytest.approx(a.apply(cloud[0]), abs=1e-9)


@given(x=floats(-9.0, 9.0), y=floats(-9.0, 9.0), yaw=floats(-3.1, 3.1))
def test_planar_pose_is_its_euler_angles(x: float, y: float, yaw: float) -> None:
    pose = Pose.planar(x, y, yaw)
    assert pose.yaw == pytest.approx(yaw)
    assert_near(pose, Pose.from_euler([x, y, 0.0], yaw=yaw))


@given(a=poses())
def test_pose_rebuilt_from_its_fields_is_the_same_pose(a: Pose) -> None:
    assert bits(Pose(a.position, a.quaternion_wxyz)) == bits(a)


def test_quaternion_is_brought_to_unit_norm() -> None:
    assert Pose(np.zeros(3), np.array([2.0, 0, 0, 0])).quaternion_wxyz.tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize(
    ("position", "quaternion", "expected"),
    [
        ([0.0, 0.0], [1.0, 0.0, 0.0, 0.0], r"position must have shape \(3,\), got \(2,\)"),
        ([0.0, np.nan, 0.0], [1.0, 0.0, 0.0, 0.0], "position must be finite"),
        ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], r"quaternion must have shape \(4,\)"),
        ([0.0, 0.0, 0.0], [np.inf, 0.0, 0.0, 0.0], "quaternion must be finite"),
        ([0.0, 0.0, 0.0], [1e200, 0.0, 0.0, 0.0], r"must have unit norm, got \[1e\+200"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], "try 1 0 0 0"),
    ],
)
def test_impossible_pose_is_refused_by_name(
    position: list[float], quaternion: list[float], expected: str
) -> None:
    with pytest.raises(InvalidReadingError, match=expected):
        Pose(np.array(position), np.array(quaternion))


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_values_are_frozen_and_their_arrays_read_only(value: object) -> None:
    arrays = 0
    for field in fields(value):  # type: ignore[arg-type]
        content = getattr(value, field.name)
        with pytest.raises((FrozenInstanceError, AttributeError)):
            setattr(value, field.name, content)
        if isinstance(content, np.ndarray) and content.size:
            arrays += 1
            with pytest.raises(ValueError, match="read-only"):
                content[...] = 0
    assert arrays > 0 or isinstance(value, WheelSpeeds | HintVerdict)


def test_values_do_not_follow_the_arrays_they_were_made_from() -> None:
    position, ranges = np.zeros(3), np.ones(3)
    pose = Pose(position, np.array([1.0, 0.0, 0.0, 0.0]))
    scan = replace(a_scan(), ranges=ranges)
    position[0] = ranges[0] = 7.0
    assert pose.position[0] == 0.0
    assert scan.ranges[0] == 1.0
    assert position.flags.writeable


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"stamp": -1}, r"scan\.stamp must be >= 0 ns, got -1"),
        ({"angles": np.zeros(2)}, r"scan\.angles must have shape \(3,\), got \(2,\)"),
        ({"intensities": np.zeros(2)}, r"scan\.intensities must have shape \(3,\)"),
        ({"offsets": np.array([0, 2, 1])}, r"scan\.offsets must be .* non-decreasing"),
        ({"offsets": np.array([0])}, r"scan\.offsets must be"),
    ],
)
def test_impossible_scan_is_refused_by_name(change: dict[str, object], expected: str) -> None:
    with pytest.raises(InvalidReadingError, match=expected):
        replace(a_scan(), **change)  # type: ignore[arg-type]


@given(scan=scans())
def test_scan_has_float32_resolution_and_ends_with_its_last_beam(scan: Scan) -> None:
    for name in ("ranges", "intensities"):
        values = getattr(scan, name)
        assert np.array_equal(values.astype(np.float32).astype(float), values, equal_nan=True)
    assert scan.end_stamp >= scan.stamp
    if len(scan.offsets):
        assert scan.offsets[0] == 0
        assert scan.end_stamp - scan.stamp == scan.offsets[-1]


def test_scan_keeps_what_is_no_point() -> None:
    scan = a_scan(ranges=[np.inf, np.nan, 1.0])
    assert np.isposinf(scan.ranges[0])
    assert np.isnan(scan.ranges[1])


@pytest.mark.parametrize(
    ("covariance", "expected"),
    [
        (np.zeros((3, 3)), r"hint\.covariance must have shape \(6, 6\)"),
        (np.full((6, 6), np.inf), r"hint\.covariance must be finite"),
        (-np.eye(6), r"hint\.covariance must have a diagonal >= 0"),
    ],
)
def test_impossible_hint_is_refused_by_name(covariance: FloatArray, expected: str) -> None:
    with pytest.raises(InvalidReadingError, match=expected):
        Hint(0, Pose.identity(), covariance)


def test_other_wrong_shapes_are_refused_by_name() -> None:
    with pytest.raises(InvalidReadingError, match=r"inertial\.specific_force must have shape"):
        Inertial(0, np.zeros(3), np.zeros(2))
    with pytest.raises(InvalidReadingError, match="angular must have shape"):
        Twist(np.zeros(3), np.zeros(1))
    with pytest.raises(InvalidReadingError, match=r"sweep\.origins must have shape \(2, 3\)"):
        replace(SWEEP, origins=np.zeros((1, 3)))
    with pytest.raises(InvalidReadingError, match=r"estimate\.covariance must have shape"):
        replace(ESTIMATE, covariance=np.zeros((3, 3)))


def test_hint_that_no_map_can_reach_is_refused() -> None:
    with pytest.raises(InvalidReadingError, match="metres"):
        Hint(0, Pose.planar(1e300, 0.0, 0.0), np.zeros((6, 6)))


def test_a_scan_shares_arrays_that_nobody_writes_to_and_copies_the_others() -> None:
    frozen, times = np.arange(5.0), np.arange(5)
    frozen.flags.writeable = times.flags.writeable = False
    own = np.ones(5)
    view = own[:]
    view.flags.writeable = False
    scan = Scan(0, "laser_horizontal", frozen, own, view, times, 0.1, 30.0)
    assert scan.angles is frozen
    assert scan.offsets is times
    own[:] = 7.0
    np.testing.assert_array_equal(scan.ranges, np.ones(5))
    np.testing.assert_array_equal(scan.intensities, np.ones(5))
