from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.evaluation.trajectory import Trajectory, TrajectoryError
from localization.evaluation.tum_file import TumWriter, read_tum, write_tum
from localization.types import Pose
from tests.support import bits, poses


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    stamps = draw(st.lists(st.integers(-(10**12), 2**62), min_size=1, max_size=10, unique=True))
    return Trajectory.from_poses((stamp, draw(poses(1e6))) for stamp in sorted(stamps))


def everything(trajectory: Trajectory) -> list[object]:
    return [bits(getattr(trajectory, name)) for name in Trajectory.__slots__]


@pytest.mark.slow
@given(trajectory=trajectories())
@settings(max_examples=50)
def test_trajectory_is_restored_from_its_file_bit_for_bit(trajectory: Trajectory) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "path.tum"
        write_tum(path, trajectory)
        assert everything(read_tum(path)) == everything(trajectory)


def test_trajectory_that_is_written_pose_by_pose_is_on_the_disk_at_once_and_the_same(
    tmp_path: Path,
) -> None:
    trajectory = Trajectory.from_poses([(20, Pose.identity()), (40, Pose.planar(1.0, 2.0, 0.3))])
    writer = TumWriter(tmp_path / "written.tum")
    for number, stamp in enumerate(trajectory.stamps.tolist()):
        writer.write(stamp, trajectory.pose(number))
        assert len(read_tum(tmp_path / "written.tum")) == number + 1
    write_tum(tmp_path / "whole.tum", trajectory)
    assert (tmp_path / "written.tum").read_bytes() == (tmp_path / "whole.tum").read_bytes()
    writer.close()


def test_file_is_what_other_tools_expect(tmp_path: Path) -> None:
    pose = Pose([1.0, -2.0, 0.5], [0.0, 1.0, 0.0, 0.0])  # type: ignore[arg-type]
    write_tum(tmp_path / "a.tum", Trajectory.from_poses([(1_000_000_020, pose)]))
    text = (tmp_path / "a.tum").read_text()
    assert text.splitlines()[1] == "1.000000020 1.0 -2.0 0.5 1.0 0.0 0.0 0.0"
    assert np.loadtxt(tmp_path / "a.tum").shape == (8,)


def test_foreign_file_is_read_with_its_mark_and_rounded_quaternions(tmp_path: Path) -> None:
    path = tmp_path / "freiburg.txt"
    path.write_text(
        "\ufeff# ground truth\n\n1305031098.6659 1.3 0.6 1.6 0.6 0 0 -0.8001\n1.3051e9 1 2 3 0 0 0 1\n",
        encoding="utf-8",
    )
    trajectory = read_tum(path)
    assert trajectory.stamps.tolist() == [1305031098665900000, 1305100000000000000]
    assert np.linalg.norm(trajectory.quaternions_wxyz, axis=1) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("1 2 3", "a line needs 8 numbers, .* got 3"),
        ("0.5 0 0 0 0 0 0 x", "a line needs 8 numbers"),
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


def test_file_without_poses_and_no_file_are_rejected(tmp_path: Path) -> None:
    (tmp_path / "empty.tum").write_text("# nothing\n")
    (tmp_path / "binary.tum").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrajectoryError, match=r"empty\.tum: holds no poses"):
        read_tum(tmp_path / "empty.tum")
    with pytest.raises(TrajectoryError, match=r"binary\.tum: is not a text file"):
        read_tum(tmp_path / "binary.tum")
    with pytest.raises(TrajectoryError, match=r"none\.tum: No such file"):
        read_tum(tmp_path / "none.tum")
