"""What a sweep leaves open of a place stays open in the covariance of the placement."""

from __future__ import annotations

import numpy as np
import pytest

from localization.relocalization.search_window import Window
from localization.relocalization.verification import unseen_within
from localization.types import Match, Pose

WINDOW = Window(2.0, 3.0, 0.0, half_width=0.6, half_yaw=0.2)


def match(information: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Match:
    """Return a registration with such information on x and y."""
    full = np.diag([0.0, 0.0, 1e6, 1e6, 1e6, 1e6])
    full[:2, :2] = information
    return Match(0, Pose.identity(), full, np.eye(6), np.zeros(5), 1.0)


def test_place_that_is_seen_on_all_sides_is_not_open() -> None:
    assert unseen_within(match(np.diag([1e4, 1e4])), WINDOW) is None


@pytest.mark.parametrize("heading", [0.0, 0.6, np.pi / 2.0])
def test_place_in_a_bare_corridor_is_open_along_it_over_the_window(heading: float) -> None:
    along = np.array([np.cos(heading), np.sin(heading)])
    across = np.array([-along[1], along[0]])
    covariance = unseen_within(match(1e4 * np.outer(across, across)), WINDOW)
    assert covariance is not None
    # An even distribution over 1.2 m has a variance of a twelfth of its square.
    assert along @ covariance[:2, :2] @ along == pytest.approx(1.2**2 / 12.0)
    assert across @ covariance[:2, :2] @ across == pytest.approx(0.0, abs=1e-12)
    assert not covariance[2:].any()
