"""Covariance of a planar motion observed by scan alignment, from the surfaces in the scan.

KISS-ICP reports none, and point-to-point residuals would claim knowledge along a featureless wall (Bonnabel
et al. 2014); the normals of neighbouring points do not.
"""

from __future__ import annotations

import numpy as np

from localization.compiled.scans import surface_information
from localization.geometry import FloatArray
from localization.motion.kiss_icp import KissConfig

_JUMP = 0.5
"""Neighbouring beams that end farther apart than this meet different surfaces [m]."""
_NOISY_SHARE = 0.1
"""Share of the whole information that noisy normals and slightly bent walls may fake along a wall."""


def alignment_covariance(flat: FloatArray, config: KissConfig) -> FloatArray:
    """Return the covariance (3, 3) of x, y [m] and yaw [rad] that a scan supports.

    Args:
        flat: (N, 3) points of a horizontal scan in ``base_link``, in the order of its beams [m].
        config: noise and floors.
    """
    c = config
    information, count = surface_information(flat[:, :2], c.piece_length, _JUMP)
    information *= min(1.0, c.effective_points / max(count, 1.0)) / c.point_noise**2
    believed = information - _NOISY_SHARE * np.trace(information[:2, :2]) * np.diag([1.0, 1.0, 0.0])
    values, vectors = np.linalg.eigh(believed)
    safe = np.maximum(values, 1e-2)
    floor = np.diag(np.square([c.sigma_floor, c.sigma_floor, c.sigma_floor_angle]))
    covariance: FloatArray = (vectors / safe) @ vectors.T + floor
    return covariance
