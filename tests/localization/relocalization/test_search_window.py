from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import window_of
from localization.types import Pose
from tests.support import floats


def test_hint_without_covariance_opens_the_default_window() -> None:
    c = SearchConfig()
    window = window_of(Pose.planar(1.0, 2.0, 0.5), np.zeros((6, 6)))
    assert (window.x, window.y) == (1.0, 2.0)
    assert window.yaw == pytest.approx(0.5)
    assert window.half_width == pytest.approx(3.0 * c.default_sigma)
    assert window.half_yaw == pytest.approx(3.0 * c.default_sigma_yaw)


@given(sigma_x=floats(0.0, 5.0), sigma_y=floats(0.0, 5.0), sigma_yaw=floats(0.0, 7.0))
def test_window_is_three_sigma_within_its_limits(
    sigma_x: float, sigma_y: float, sigma_yaw: float
) -> None:
    c = SearchConfig()
    # Something in z keeps the covariance from meaning "default".
    covariance = np.diag(np.square([sigma_x, sigma_y, 1.0, 0.0, 0.0, sigma_yaw]))
    window = window_of(Pose.identity(), covariance)
    wide = 3.0 * max(sigma_x, sigma_y)
    assert window.half_width == pytest.approx(min(max(wide, c.smallest_window), c.largest_window))
    assert window.half_yaw == pytest.approx(min(max(3.0 * sigma_yaw, c.smallest_window_yaw), np.pi))
