"""Covariance of the odometry between key frames."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray
from localization.mapping.odometry_front_end import OdometrySweep


class EdgeCovariance:
    """Accumulates the uncertainty of the odometry from one key frame to the next."""

    def __init__(self) -> None:
        self._predicted: list[tuple[float, FloatArray]] = []
        self._seen: list[FloatArray] = []

    def add(self, step: OdometrySweep) -> None:
        """Add the motion that led to a sweep."""
        self._predicted.append((float(step.at[2]), step.predicted))
        self._seen.append(_turned(step.seen, float(step.at[2])))

    def covariance(self, last: OdometrySweep, floor: tuple[float, float]) -> FloatArray:
        """Return the covariance (3, 3) of x, y, yaw in the axes of the last sweep.

        The wheels' errors accumulate. KISS-ICP's do not over so short a distance, because it matches each sweep
        with the same local map: its information counts once, as the mean over the sweeps.

        Args:
            last: The sweep at the second key frame.
            floor: Lower bound of the error, one sigma [m, rad].
        """
        wheels = np.sum([_turned(p, yaw) for yaw, p in self._predicted], axis=0)
        seen = np.mean(self._seen, axis=0)
        least = np.diag(np.square([floor[0], floor[0], floor[1]]))
        both = np.linalg.inv(np.linalg.inv(wheels) + seen)
        covariance: FloatArray = _turned(both, -float(last.at[2])) + least
        return covariance


def _turned(matrix: FloatArray, yaw: float) -> FloatArray:
    """Return a matrix (3, 3) of x, y, yaw, given in axes turned by ``yaw``, in the axes before the turn."""
    turn = np.eye(3)
    c, s = np.cos(yaw), np.sin(yaw)
    turn[:2, :2] = [[c, -s], [s, c]]
    turned: FloatArray = turn @ matrix @ turn.T
    return turned
