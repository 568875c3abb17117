"""Axes of the report's time lines: from figures to shares of a panel's height, with ticks at round values."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from localization.geometry import FloatArray


@dataclass(frozen=True, slots=True)
class Linear:
    """An axis whose values are evenly spaced."""

    low: float
    """Value at the bottom."""
    high: float
    """Value at the top; larger than ``low``."""

    def share(self, values: FloatArray) -> FloatArray:
        """Return the height of values, 0 at the bottom and 1 at the top; values outside are held inside."""
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)

    def ticks(self, parts: int = 5) -> list[float]:
        """Return round values that divide the axis into at most so many parts."""
        step = round_step((self.high - self.low) / parts)
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        return [i * step for i in range(first, last + 1)]


@dataclass(frozen=True, slots=True)
class Logarithmic:
    """An axis of powers of ten."""

    low: float
    """Value at the bottom; positive."""
    high: float
    """Value at the top; larger than ``low``."""

    def share(self, values: FloatArray) -> FloatArray:
        """Return the height of values; see ``Linear``."""
        held = np.clip(values, self.low, self.high)
        return np.log(held / self.low) / math.log(self.high / self.low)

    def ticks(self, parts: int = 5) -> list[float]:
        """Return the powers of ten, only some if there are many."""
        first = math.ceil(math.log10(self.low) - 1e-9)
        last = math.floor(math.log10(self.high) + 1e-9)
        return [10.0**i for i in range(first, last + 1, 1 + (last - first) // parts)]


Scale = Linear | Logarithmic
"""Any axis."""


def linear_around(*figures: FloatArray, least: float) -> Linear:
    """Return an axis that holds all figures and zero, and is not shorter than ``least``."""
    low, high = _range(figures)
    low, high = min(low, 0.0), max(high, 0.0)
    if high - low < least:
        high = low + least
    margin = 0.05 * (high - low)
    return Linear(low - margin if low < 0.0 else 0.0, high + margin)


def logarithmic_around(
    *figures: FloatArray, low: float, high: float, highest: float = math.inf
) -> Logarithmic:
    """Return an axis from ``low`` to the power of ten above all figures, which is ``high`` to ``highest``."""
    largest = min(_range(figures)[1], highest)
    top = 10.0 ** math.ceil(math.log10(max(largest, high)) - 1e-9)
    return Logarithmic(low, top)


def round_step(length: float) -> float:
    """Return the smallest of 1, 2 and 5 times a power of ten that is not below a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= length * (1.0 - 1e-9))


def _range(figures: tuple[FloatArray, ...]) -> tuple[float, float]:
    """Return the least and the largest finite figure; zeros if there is none."""
    every = np.concatenate([np.ravel(f) for f in figures]) if figures else np.zeros(0)
    every = every[np.isfinite(every)]
    return (float(every.min()), float(every.max())) if every.size else (0.0, 0.0)
