"""Covariance of a planar motion observed by scan alignment, from the surfaces in the scan.

KISS-ICP reports none, and point-to-point residuals would claim knowledge along a featureless wall (Bonnabel
et al. 2014); the normals of neighbouring points do not.
"""

from __future__ import annotations

import numpy as np

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
    at, normal, count = surface_pieces(flat[:, :2], c.piece_length)
    rows = np.column_stack([normal, at[:, 0] * normal[:, 1] - at[:, 1] * normal[:, 0]])
    share = min(1.0, c.effective_points / max(float(count.sum()), 1.0))
    information = (rows * count[:, None]).T @ rows * share / c.point_noise**2
    believed = information - _NOISY_SHARE * np.trace(information[:2, :2]) * np.diag([1.0, 1.0, 0.0])
    values, vectors = np.linalg.eigh(believed)
    safe = np.maximum(values, 1e-2)
    floor = np.diag(np.square([c.sigma_floor, c.sigma_floor, c.sigma_floor_angle]))
    covariance: FloatArray = (vectors / safe) @ vectors.T + floor
    return covariance


def surface_pieces(flat: FloatArray, length: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return short pieces of the surfaces that a scan's points (N, 2) lie on.

    Args:
        flat: points in the order of the beams [m].
        length: length of a piece [m].

    Returns:
        Middles (M, 2) [m] of pieces that have a neighbour on both sides, their normals (M, 2), and the
        number of points (M,) of each.
    """
    steps = np.linalg.norm(np.diff(flat, axis=0), axis=1)
    # A longer step leads to another surface.
    jump = steps > _JUMP
    along = np.concatenate([[0.0], np.cumsum(np.where(jump, 0.0, steps))])
    surface = np.concatenate([[0], np.cumsum(jump)])
    # Far away, a step may be longer than a piece: what counts is the order of the pieces.
    begun = jump | (np.diff(along // length) != 0.0)
    piece = np.concatenate([[0], np.cumsum(begun)])
    count = np.bincount(piece).astype(float)
    middle = np.column_stack([np.bincount(piece, flat[:, k]) / count for k in (0, 1)])
    of = np.zeros(len(count), dtype=int)
    of[piece] = surface
    inner = np.zeros(len(count), dtype=bool)
    inner[1:-1] = (of[2:] == of[1:-1]) & (of[:-2] == of[1:-1])
    across = middle[np.flatnonzero(inner) + 1] - middle[np.flatnonzero(inner) - 1]
    norm = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.maximum(norm, 1e-9)
    return middle[inner], np.column_stack([-across[:, 1], across[:, 0]]), count[inner]
