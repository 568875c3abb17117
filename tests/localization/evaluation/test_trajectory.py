from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.evaluation.trajectory import Trajectory, TrajectoryError
from localization.evaluation.tum_file import read_tum, write_tum
from localization.types import Estimate, Health, Pose, Twist
from tests.support import bits, poses


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    stamps = draw(st.lists(st.integers(-(10**12), 2**62), min_size=1, max_size=10, unique=True))
    return Trajectory.from_poses((stamp, draw(poses(1e6))) for stamp in sorted(stamps))


def everything(trajectory: Trajectory) -> list[object]:
    return [bits(getattr(trajectory, name)) for name in Trajectory.__slots__]


@given(trajectory=trajectories())
@settings(max_examples=50)
def test_trajectory_survives_the_file_bit_for_bit(trajectory: Trajectory) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "path.tum"
        write_tum(path, trajectory)
        assert everything(read_tum(path)) == everything(trajectory)


def test_file_is_what_other_tools_expect(tmp_path: Path) -> None:
    pose = Pose([1.0, -2.0, 0.5], [0.0, 1.0, 0.0, 0.0])  # type: ignore[arg-type]
    write_tum(tmp_path / "a.tum", Trajectory.from_poses([(1_000_000_020, pose)]))
    text = (tmp_path / "a.tum").read_text()
    assert text.splitlines()[1] == "1.000000020 1.0 -2.0 0.5 1.0 0.0 0.0 0.0"
    assert np.loadtxt(tmp_path / "a.tum").shape == (8,)


def test_foreign_file_is_read_with_its_rounded_quaternions(tmp_path: Path) -> None:
    path = tmp_path / "freiburg.txt"
    path.write_text(
        "# ground truth\n\n1305031098.6659 1.3 0.6 1.6 0.6 0 0 -0.8001\n1.3051e9 1 2 3 0 0 0 1\n"
    )
    trajectory = read_tum(path)
    assert trajectory.stamps.tolist() == [1305031098665900000, 1305100000000000000]
    assert np.linalg.norm(trajectory.quaternions_wxyz, axis=1) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("1 2 3", "want 8 numbers, .* got 3"),
        ("0.5 0 0 0 0 0 0 x", "want 8 numbers"),
        ("nan 0 0 0 0 0 0 1", "64-bit nanoseconds"),
        ("1e30 0 0 0 0 0 0 1", "64-bit nanoseconds"),
        ("1 0 0 inf 0 0 0 1", "must be finite"),
        ("1 0 0 0 0 0 0 0", "quaternion not zero"),
        ("0 0 0 0 0 0 0 1", "time must increase"),
    ],
)
def test_bad_line_is_named_by_its_number(tmp_path: Path, line: str, expected: str) -> None:
    path = tmp_path / "bad.tum"
    path.write_text(f"# header\n0 0 0 0 0 0 0 1\n{line}\n")
    with pytest.raises(TrajectoryError, match=rf"bad\.tum, line 3: .*{expected}"):
        read_tum(path)


def test_file_without_poses_and_no_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.tum").write_text("# nothing\n")
    (tmp_path / "binary.tum").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrajectoryError, match=r"empty\.tum: holds no poses"):
        read_tum(tmp_path / "empty.tum")
    with pytest.raises(TrajectoryError, match=r"binary\.tum: is not a text file"):
        read_tum(tmp_path / "binary.tum")
    with pytest.raises(TrajectoryError, match=r"none\.tum: No such file"):
        read_tum(tmp_path / "none.tum")


def test_impossible_trajectories_are_refused() -> None:
    one = np.array([[1.0, 0.0, 0.0, 0.0]])
    with pytest.raises(TrajectoryError, match="pose 1 is not after pose 0"):
        Trajectory(np.array([1, 1]), np.zeros((2, 3)), np.repeat(one, 2, axis=0))
    with pytest.raises(TrajectoryError, match=r"quaternions \(1, 4\)"):
        Trajectory(np.array([1]), np.zeros((1, 3)), np.zeros(4))
    with pytest.raises(TrajectoryError, match="pose 0 must be finite"):
        Trajectory(np.array([1]), np.full((1, 3), np.nan), one)


def test_arrays_are_read_only() -> None:
    trajectory = Trajectory.from_poses([(0, Pose.identity())])
    for name in Trajectory.__slots__:
        with pytest.raises(ValueError, match="read-only"):
            getattr(trajectory, name)[0] = 1


def test_estimates_without_a_pose_are_left_out_and_the_last_of_a_stamp_counts() -> None:
    def estimate(stamp: int, pose: Pose | None) -> Estimate:
        still = Twist.planar(0.0, 0.0)
        return Estimate(stamp, pose, Pose.identity(), np.eye(6), still, Health.TRACKING)

    some = [estimate(1, None), estimate(2, Pose.planar(1.0, 0.0, 0.0))]
    assert Trajectory.from_estimates(some).stamps.tolist() == [2]
    assert len(Trajectory.from_estimates(some[:1])) == 0
    some.append(estimate(2, Pose.planar(3.0, 0.0, 0.0)))
    assert Trajectory.from_estimates(some).positions.tolist() == [[3.0, 0.0, 0.0]]


def test_poses_in_between_are_interpolated_and_knots_returned_as_they_are() -> None:
    ends = [(0, Pose.planar(0.1, 0.2, 0.3)), (10, Pose.planar(0.7, 0.2, 1.3))]
    trajectory = Trajectory.from_poses(ends)
    positions, rotations = trajectory.at(np.array([0, 5, 10]))
    assert positions[[0, 2]].tobytes() == trajectory.positions.tobytes()
    assert rotations[[0, 2]].tobytes() == trajectory.rotations.tobytes()
    assert positions[1] == pytest.approx([0.4, 0.2, 0.0])
    assert rotations[1] == pytest.approx(Pose.planar(0.0, 0.0, 0.8).rotation)
