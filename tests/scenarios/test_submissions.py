"""Poses of others on real logs: the file's format, its errors, and the scans that its lines belong to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.real.submissions import SubmissionError, _lines, read_submission

PLAIN = "100.5 1 2 0 0 0 0.70710678 0.70710678"


def written(folder: Path, *lines: str) -> Path:
    path = folder / "theirs.tum"
    path.write_text("# a comment\n\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_line_of_eight_columns_is_a_pose_without_a_covariance(tmp_path: Path) -> None:
    found = read_submission(written(tmp_path, PLAIN))
    assert found.times.tolist() == [100.5]
    np.testing.assert_allclose(found.poses[0].position, [1.0, 2.0, 0.0])
    assert found.poses[0].yaw == pytest.approx(np.pi / 2)
    assert np.isnan(found.covariances).all()


def test_line_of_fourteen_columns_holds_the_covariance_of_x_y_and_heading(tmp_path: Path) -> None:
    found = read_submission(written(tmp_path, PLAIN + " 0.04 0.01 0.002 0.09 0.003 0.0025"))
    matrix = found.covariances[0]
    planar = matrix[np.ix_((0, 1, 5), (0, 1, 5))]
    assert planar.tolist() == [[0.04, 0.01, 0.002], [0.01, 0.09, 0.003], [0.002, 0.003, 0.0025]]
    assert np.count_nonzero(matrix) == 9


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("100.5 1 2 0 0 0 1", "line 4: a line needs 8 columns"),
        ("100.5 1 2 0 0 0 0 1 0.04", "got 9"),
        ("100.5 1 two 0 0 0 0 1", r"line 4, column 3 \(y\): a finite number is wanted, got 'two'"),
        ("100.5 nan 2 0 0 0 0 1", r"column 2 \(x\)"),
        ("100.5 1 2 0 0 0 0 0", "columns 5 to 8"),
        (PLAIN + " 0.04 0 0 -1 0 0.01", r"column 12 \(yy\): a variance must be > 0, got -1"),
        (PLAIN + " 0.04 0.05 0 0.04 0 0.01", "columns 9 to 14"),
    ],
)
def test_line_that_is_no_pose_is_named_with_its_column(
    tmp_path: Path, line: str, message: str
) -> None:
    with pytest.raises(SubmissionError, match=message):
        read_submission(written(tmp_path, PLAIN, line))


def test_file_without_poses_or_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(SubmissionError, match=r"theirs\.tum: holds no poses"):
        read_submission(written(tmp_path))
    with pytest.raises(SubmissionError, match="No such file"):
        read_submission(tmp_path / "none.tum")


def test_lines_belong_to_the_scans_printed_with_the_nearest_time() -> None:
    scans = np.array([1.0, 1.2, 1.4, 1.6])
    assert _lines(scans, np.array([1.401, 1.0, 3.0])).tolist() == [1, -1, 0, -1]
    # Two scans printed with one time have their lines in the order of the file.
    assert _lines(np.array([2.5, 2.5, 2.6]), np.array([2.5, 2.6, 2.5])).tolist() == [0, 2, 1]
