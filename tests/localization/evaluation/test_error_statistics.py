from __future__ import annotations

import numpy as np
import pytest

from localization.evaluation.error_statistics import EvaluationError, Statistics


def test_statistics_of_known_errors() -> None:
    s = Statistics.of([3.0, -4.0, 0.0, 0.0])
    assert (s.count, s.rmse, s.mean, s.median, s.max) == (4, 2.5, 1.75, 1.5, 4.0)
    assert Statistics.of(np.arange(101.0)).p95 == 95.0


@pytest.mark.parametrize("bad", [[], [np.nan]])
def test_statistics_of_no_errors_are_rejected(bad: list[float]) -> None:
    with pytest.raises(EvaluationError):
        Statistics.of(bad)
