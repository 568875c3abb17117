"""Range bias of the scanners: one constant for those that are level and one for the others, learned from sweeps.

Ranges of a scanner are off by one length b in all its beams, by up to 3 cm. Walls on both sides show it; a wall on one
side alone moves the pose instead, however many sweeps are registered there. So b is learned from what a sweep says of
it whatever its pose is, ranges are corrected by it, and no direction of the pose is known better than b leaves it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from localization.geometry import FloatArray
from localization.types import RangeFit, Sweep

_SUREST = 0.001
"""The bias is known no better than this, one sigma [m]: it changes with temperature and surface; chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class RangeBias:
    """What is known of the bias of level scanners, and of the others."""

    mean: FloatArray
    """(2,) measured less true range [m]."""
    covariance: FloatArray
    """(2, 2) of its error [m^2]."""

    @classmethod
    def unknown(cls, sigma: float) -> RangeBias:
        """Return what data sheets say of it: nothing but its size, one sigma [m]."""
        return cls(np.zeros(2), sigma**2 * np.eye(2))

    def learned(self, fit: RangeFit) -> RangeBias:
        """Return it after a sweep: a Kalman filter in information form."""
        covariance = np.linalg.inv(np.linalg.inv(self.covariance) + fit.information)
        mean = self.mean + covariance @ fit.gradient
        values, vectors = np.linalg.eigh(covariance)
        return RangeBias(mean, (vectors * np.maximum(values, _SUREST**2)) @ vectors.T)

    def error_of(self, fit: RangeFit) -> FloatArray:
        """Return the covariance (6, 6) that it leaves to the pose of a match, as in ``Match``."""
        error: FloatArray = fit.shift @ self.covariance @ fit.shift.T
        return error

    def removed(self, sweep: Sweep) -> Sweep:
        """Return a sweep with its points moved towards their scanners by the bias."""
        if not self.mean.any():
            return sweep
        beams = sweep.points - sweep.origins
        share = np.where(sweep.horizontal, *self.mean) / sweep.beam_lengths()
        return replace(sweep, points=sweep.points - share[:, None] * beams)
