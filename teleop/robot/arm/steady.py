"""A hand's pose made steady: the slower the hand, the more of its noise is taken away.

The filter is of first order, and its cut-off frequency rises with the speed (Casiez, Roussel and Vogel, "1 Euro filter",
CHI 2012): a hand at rest is steady, and one that reaches lags little.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray, so3_exp, so3_log
from localization.types import Pose

_SLOWEST: Final = 1.0
"""Cut-off frequency of a hand at rest [Hz]."""
_RISE: Final = 100.0
"""By so much it rises with the speed [Hz s/m]. A hand at rest with a noise of 1.5 mm and 0.5 degrees leaves 1.3 mm at the
tip, without the filter 2.6; one that moves, 3.9 mm instead of 4.7."""
_SPEED: Final = 3.0
"""Cut-off frequency of the speed itself [Hz]."""
_LEVER: Final = 0.15
"""Length at which a turn counts as a way [m]: of a hand."""


class SteadyPose:
    """Owns the steady pose and its speed."""

    def __init__(self, pose: Pose) -> None:
        """Begin with a pose at rest."""
        self.position, self.rotation = pose.position, pose.rotation
        """(3,) [m] and (3, 3) of the steady pose."""
        self._raw = pose
        self._velocity, self._spin = np.zeros(3), np.zeros(3)

    def take(self, pose: Pose, passed: float) -> None:
        """Take a new pose, a time [s] after the last."""
        raw, self._raw = self._raw, pose
        share = _share(_SPEED, passed)
        self._velocity += share * ((pose.position - raw.position) / passed - self._velocity)
        turned = _LEVER * so3_log(pose.rotation @ raw.rotation.T)
        self._spin += share * (turned / passed - self._spin)
        way, turn = _followed(self._velocity, passed), _followed(self._spin, passed)
        missing = so3_log(pose.rotation @ self.rotation.T)
        self.rotation = so3_exp(turn * missing) @ self.rotation
        self.position = self.position + way * (pose.position - self.position)


def _followed(velocity: FloatArray, passed: float) -> float:
    """Return the share of a change that is followed at a velocity (3,) [m/s]."""
    return _share(_SLOWEST + _RISE * math.sqrt(velocity @ velocity), passed)


def _share(frequency: float, passed: float) -> float:
    """Return the share of a change that a filter of first order lets through in a time [s]."""
    return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * frequency * passed))
