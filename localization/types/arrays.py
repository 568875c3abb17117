"""Read-only arrays with checked shapes and values, of which the vocabulary's values are made."""

from __future__ import annotations

import math
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from localization.errors import LocalizationError
from localization.geometry import FloatArray

BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


class InvalidReadingError(LocalizationError):
    """A reading or a pose with invalid values; the message names the field and what would work."""


def read_only(value: npt.ArrayLike, shape: tuple[int, ...] | None, name: str) -> FloatArray:
    """Return a value as a read-only array, without a copy where that is safe.

    Raises:
        InvalidReadingError: if its shape differs; the message begins with the name.
    """
    array = value if is_shareable(value, np.float64) else np.array(value, dtype=float)
    if shape is not None and array.shape != shape:
        raise InvalidReadingError(f"{name} must have shape {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


def is_shareable(value: object, dtype: type[np.generic]) -> TypeGuard[npt.NDArray[Any]]:
    """Return whether ``value`` is a read-only array with its own memory, which can be shared."""
    return (
        type(value) is np.ndarray
        and not value.flags.writeable
        and value.base is None
        and value.dtype == dtype
    )


def require_finite(array: FloatArray, name: str) -> None:
    """Reject an array that is not finite.

    Raises:
        InvalidReadingError: with a message that begins with the name.
    """
    if not all(map(math.isfinite, array.ravel().tolist())):
        raise InvalidReadingError(f"{name} must be finite, got {array.tolist()}")
