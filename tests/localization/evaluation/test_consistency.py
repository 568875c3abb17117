from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.evaluation.consistency import consistency, health_shares, nees
from localization.evaluation.error_statistics import EvaluationError, Statistics
from localization.types import SECOND, Health
from tests.support import floats


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


def test_nees_rejects_invalid_covariances() -> None:
    with pytest.raises(EvaluationError, match="covariance 1 must be positive definite"):
        nees(np.zeros((2, 6)), np.stack([np.eye(6), np.zeros((6, 6))]))
    with pytest.raises(EvaluationError, match="2 errors need as many"):
        nees(np.zeros((2, 6)), np.eye(6)[None])


@given(scale=floats(0.1, 10.0))
@settings(max_examples=20)
def test_nees_grows_with_the_square_of_overconfidence(scale: float) -> None:
    e = np.random.default_rng(0).standard_normal((100, 6))
    honest = consistency(nees(e, np.repeat(np.eye(6)[None], 100, axis=0)), 6)
    shrunk = consistency(nees(e, np.repeat(np.eye(6)[None] / scale**2, 100, axis=0)), 6)
    assert shrunk.mean_ratio == pytest.approx(scale**2 * honest.mean_ratio)


def test_nis_uses_each_registrations_degrees_of_freedom() -> None:
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


def test_statistics_of_known_errors() -> None:
    s = Statistics.of([3.0, -4.0, 0.0, 0.0])
    assert (s.count, s.rmse, s.mean, s.median, s.max) == (4, 2.5, 1.75, 1.5, 4.0)
    assert Statistics.of(np.arange(101.0)).p95 == 95.0


@pytest.mark.parametrize("bad", [[], [np.nan]])
def test_statistics_of_no_errors_are_rejected(bad: list[float]) -> None:
    with pytest.raises(EvaluationError):
        Statistics.of(bad)
