from __future__ import annotations

import numpy as np
import pytest

from localization.config import LocalizerConfig
from localization.filter.ekf import initial_state
from localization.motion.slip_detection import SlipDetector
from localization.types import Pose

COVARIANCE = np.diag(np.square([0.0057, 0.0049, 0.002]))
"""What KISS-ICP's motion of one sweep is worth in an office: x, y [m], yaw [rad]."""


@pytest.mark.parametrize(
    ("before", "rolled", "seen", "slip"),
    [
        (0.016, 0.021, 0.041, False),  # pulls away, and KISS-ICP lets go of where it stood
        (-0.016, -0.021, -0.041, False),
        (0.021, 0.041, 0.021, True),  # the wheels spin up and the robot stays behind
        (0.021, 0.021, 0.041, True),  # it outruns wheels that turn evenly: they hold it back
        (0.041, 0.021, 0.041, True),  # they brake and it slides on
        (0.050, 0.050, 0.051, False),
    ],
)
def test_no_tyre_lets_a_robot_outrun_wheels_that_speed_up(
    before: float, rolled: float, seen: float, slip: bool
) -> None:
    config = LocalizerConfig()
    detector = SlipDetector(config)
    for distance, observed in ((before, before), (rolled, seen)):
        detector = detector.restarted().rolled_on(distance)
        detector = detector.observed(Pose.planar(observed, 0.0, 0.0), 0.1)
        assert detector.complete
    assert detector.contradicted(COVARIANCE, initial_state(config.ekf)) is slip
