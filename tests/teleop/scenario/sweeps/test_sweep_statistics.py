from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.stats import binomtest

from teleop.scenario.sweeps.cells import runs_of
from teleop.scenario.sweeps.sweep_statistics import Share, by_value, quantiles, share_passed
from tests.teleop.scenario.sweeps.support import cells, result


@given(count=st.integers(1, 5000), share=st.floats(0.0, 1.0))
def test_the_interval_is_that_of_wilson(count: int, share: float) -> None:
    passed = round(share * count)
    low, high = Share(passed, count).interval
    expected = binomtest(passed, count).proportion_ci(0.95, method="wilson")
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert low <= passed / count <= high


def test_nothing_is_known_of_no_runs() -> None:
    assert math.isnan(Share(0, 0).value)
    assert Share(0, 0).interval == (0.0, 1.0)


def test_runs_that_could_not_begin_count_as_not_passed() -> None:
    runs = runs_of(cells("link.delay=0,1"), 2)
    words = ("passed", "missed", "bad input", "passed")
    rows = [(run, result(run, verdict=word)) for run, word in zip(runs, words, strict=True)]
    assert share_passed(rows) == Share(2, 4)
    assert [(value, share_passed(part)) for value, part in by_value(rows, "link.delay")] == [
        (0.0, Share(1, 2)),
        (1.0, Share(1, 2)),
    ]


def test_quantiles_leave_out_what_was_not_measured() -> None:
    runs = runs_of(cells("link.delay=0"), 7)
    figures = [0.0, 1.0, 2.0, 3.0, 4.0, math.nan, math.inf]
    rows = [(r, result(r, figures={"way": f})) for r, f in zip(runs, figures, strict=True)]
    np.testing.assert_allclose(quantiles(rows, "way"), [0.2, 1.0, 2.0, 3.0, 3.8])
    assert np.isnan(quantiles(rows, "other")).all()
