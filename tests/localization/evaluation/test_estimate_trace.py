from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.evaluation.estimate_trace import TraceError, TraceRow, read_trace, write_trace
from localization.types import Estimate, Health, Match, Pose, ScanConsistency, Twist
from tests.support import bits, vectors


@st.composite
def rows(draw: st.DrawFn) -> TraceRow:
    number = st.none() | st.floats(allow_nan=False) | st.just(float("nan"))
    return TraceRow(
        draw(st.integers(0, 2**62)),
        draw(st.sampled_from(Health)),
        draw(vectors(36)).reshape(6, 6),
        draw(number),
        draw(st.none() | st.integers(0, 6)),
        draw(number),
        draw(number),
        tuple(draw(st.lists(st.text(st.characters(exclude_categories=["Cs"])), max_size=3))),
    )


def everything(row: TraceRow) -> list[object]:
    return [bits(getattr(row, name)) for name in TraceRow.__slots__]


@given(written=st.lists(rows(), max_size=5))
@settings(max_examples=50)
def test_trace_is_restored_from_its_file_bit_for_bit(written: list[TraceRow]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trace.csv"
        write_trace(path, written)
        again = read_trace(path)
    assert [everything(row) for row in again] == [everything(row) for row in written]


def test_row_holds_the_estimates_quality() -> None:
    covariance = np.diag(np.arange(1.0, 7.0))
    match = Match(1, Pose.identity(), np.eye(6), np.eye(6)[:3], np.zeros(5), 0.75)
    estimate = Estimate(
        9,
        None,
        Pose.identity(),
        covariance,
        Twist.planar(0.0, 0.0),
        Health.SUSPECT,
        ("a, b", "c"),
        match,
        nis=2.5,
        consistency=ScanConsistency(0.2, 0.1, 0.1, 0.0),
    )
    row = TraceRow.of(estimate)
    assert (row.stamp, row.health, row.reasons) == (9, Health.SUSPECT, ("a, b", "c"))
    assert (row.nis, row.observable_directions, row.inlier_ratio, row.unexplained) == (
        2.5,
        3,
        0.75,
        0.2,
    )
    assert row.covariance.tolist() == covariance.tolist()


def test_file_opens_as_a_table(tmp_path: Path) -> None:
    write_trace(tmp_path / "t.csv", [TraceRow(5, Health.LOST, np.eye(6), reasons=("no match",))])
    header, line = (tmp_path / "t.csv").read_text().splitlines()
    assert header.startswith("stamp_ns,health,cov_x_x,cov_x_y,")
    assert header.endswith("cov_rz_rz,nis,observable_directions,inlier_ratio,unexplained,reasons")
    assert line.startswith("5,lost,1.0,0.0,")
    assert line.endswith(',1.0,,,,,"[""no match""]"')


def test_invalid_trace_is_rejected_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    with pytest.raises(TraceError, match=r"t\.csv: No such file"):
        read_trace(path)
    path.write_text("a,b\n")
    with pytest.raises(TraceError, match=r"t\.csv: is not a trace"):
        read_trace(path)
    write_trace(path, [TraceRow(5, Health.LOST, np.eye(6))])
    good = path.read_text()
    for before, after, expected in (
        ("lost", "fine", "line 2: 'fine'"),
        (",[]", "", "line 2: a row needs 28 cells, got 27"),
        ("[]", "3", "line 2: reasons must be a JSON list"),
        ("1.0", "one", "line 2: could not convert"),
    ):
        path.write_text(good.replace(before, after))
        with pytest.raises(TraceError, match=expected):
            read_trace(path)
