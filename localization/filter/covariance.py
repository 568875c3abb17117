"""Covariances of poses: made symmetric, finite, with a floor of variance in every direction, and read as one sigma.

A covariance without an inverse claims exact knowledge. Operators, logs and other matchers send such: rows of
zeros, a sigma of zero, rounding that leaves an eigenvalue of -1e-19.
"""

from __future__ import annotations

import math

import numpy as np

from localization.errors import LocalizationError
from localization.geometry import FloatArray

SUREST_POSITION = 1e-5
"""Floor of the error of a position, one sigma [m]."""
SUREST_ANGLE = 1e-6
"""Floor of the error of an angle, one sigma [rad]: 1 cm in 10 km."""
_INDEFINITE = 1e-6
"""An eigenvalue this far below zero, as a share of the largest, is not a rounding error."""


class CovarianceError(LocalizationError, ArithmeticError):
    """A matrix that is not a valid covariance or information; the message names it and says why."""


def pose_covariance(matrix: FloatArray, name: str) -> FloatArray:
    """Return the covariance of a pose, made symmetric, with the floor of variance in every direction.

    Args:
        matrix: (6, 6) of position [m] and rotation [rad]; may be singular.
        name: what it belongs to, for the message.

    Raises:
        CovarianceError: if it is not finite, or has a negative variance in some direction.
    """
    return floored(matrix, np.repeat([SUREST_POSITION, SUREST_ANGLE], 3), name)


def with_map_error(
    covariance: FloatArray, rotation: FloatArray, position: float, heading: float
) -> FloatArray:
    """Return the covariance (6, 6) of a pose, with the error of the map in which it was found.

    Args:
        covariance: of the position in the map [m] and the rotation in the base [rad], relative to the mapped surfaces.
        rotation: (3, 3) ``map`` from base.
        position: error of these surfaces, one sigma along x and y [m].
        heading: the same of their direction, about the map's vertical [rad].
    """
    whole = covariance.copy()
    whole[[0, 1], [0, 1]] += position**2
    up = rotation[2]
    whole[3:, 3:] += heading**2 * np.outer(up, up)
    return whole


def horizontal_sigma(covariance: FloatArray) -> float:
    """Return one sigma [m] of the horizontal position along its least certain direction.

    The larger eigenvalue of a symmetric 2 x 2 matrix in closed form; ``numpy.linalg`` has ten times the
    overhead.
    """
    xx, yy, xy = float(covariance[0, 0]), float(covariance[1, 1]), float(covariance[0, 1])
    return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))


def planar_covariance(matrix: FloatArray, name: str) -> FloatArray:
    """Return the covariance (3, 3) of x, y [m] and yaw [rad], as ``pose_covariance`` does."""
    return floored(matrix, np.array([SUREST_POSITION, SUREST_POSITION, SUREST_ANGLE]), name)


def inverse(matrix: FloatArray, name: str) -> FloatArray:
    """Return the inverse (N, N) of a covariance or an information.

    Raises:
        CovarianceError: if it is not finite, or some direction in it has no weight or a negative one.
    """
    if not np.isfinite(matrix).all():
        raise CovarianceError(f"{name} is non-finite")
    try:
        # Inversion alone would accept what only rounding keeps from being singular, and what is negative.
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        raise CovarianceError(f"{name} is singular: some direction in it has no weight") from None
    return np.asarray(np.linalg.inv(matrix), dtype=float)


def at_least(matrix: FloatArray, floor: FloatArray) -> FloatArray:
    """Return a covariance (N, N) with at least the variance of another one, positive definite, in every direction."""
    root = _root(floor)
    half = np.linalg.solve(root, 0.5 * (matrix + matrix.T))
    values, vectors = np.linalg.eigh(np.linalg.solve(root, half.T))
    if values[0] >= 1.0:
        return matrix
    spread = root @ vectors
    return np.asarray((spread * np.maximum(values, 1.0)) @ spread.T, dtype=float)


def _root(matrix: FloatArray) -> FloatArray:
    """Return a root R (N, N) of a covariance R R', that has an inverse even where rounding made the covariance indefinite."""
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=float)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(matrix)
        least = np.finfo(float).eps * values[-1]
        return np.asarray(vectors * np.sqrt(np.maximum(values, least)), dtype=float)


def floored(matrix: FloatArray, surest: FloatArray, name: str) -> FloatArray:
    """Return a covariance (N, N), made symmetric, with a floor of variance in every direction.

    Args:
        matrix: the covariance; may be singular.
        surest: (N,) the floor, one sigma in the unit of each row.
        name: what it belongs to, for the message.

    Raises:
        CovarianceError: if it is not finite, or has a negative variance in some direction.
    """
    if not np.isfinite(matrix).all():
        raise CovarianceError(f"{name} is non-finite")
    symmetric = np.asarray(0.5 * (matrix + matrix.T), dtype=float)
    unit = np.outer(surest, surest)
    values, vectors = np.linalg.eigh(symmetric / unit)
    if values[0] >= 1.0:
        return symmetric
    if values[0] < -max(1.0, _INDEFINITE * values[-1]):
        raise CovarianceError(
            f"{name} is not a covariance: it has a negative variance in some direction"
        )
    raised = (vectors * np.maximum(values, 1.0)) @ vectors.T * unit
    return np.asarray(0.5 * (raised + raised.T), dtype=float)
