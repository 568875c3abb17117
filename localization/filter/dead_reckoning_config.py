"""Settings of dead reckoning: the errors of wheels and inertial units.

Where no source is named, the number was chosen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DeadReckoningConfig:
    """Errors of wheels and inertial units, one sigma each; none is fitted to a robot. The gyro's are `EkfConfig`'s."""

    distance_scale: float = 0.02
    """Constant error of the wheels' distance, as a share of it: a tyre's rolling radius changes with wear, pressure and
    load, and with the ground."""
    wheel_turn_scale: float = 0.5
    """Constant error of the turns that wheels measure, as a share of them: skid-steered bases measure 0.5 to 1.9 times
    the true turn, so that twice the measured one is two sigma."""
    rest_noise: float = math.radians(0.02)
    """Error of the gyro's mean over a second at rest, against its bias [rad/s]."""
    tilt_sigma: float = math.radians(1.0)
    """Error of roll and pitch of a reported orientation, if the unit does not give it [rad]."""
    heading_sigma: float = math.radians(5.0)
    """Error of the heading of a reported orientation, if the unit does not give it [rad]: that of a compass beside
    motors."""
    heading_drift: float = math.radians(0.05)
    """Random walk of the error of reported headings [rad/sqrt(s)]: 0.4 degrees in a minute, 3 in an hour, since most
    units have no compass or ignore it."""
    ground_sigma: float = math.radians(2.0)
    """Slope of the ground where nobody reports the tilt [rad]."""
