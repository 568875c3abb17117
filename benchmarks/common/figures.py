"""Measured figures: each with its count, its 95 % bounds and its goal."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

OURS = "Farsteer"
"""What our own localiser is called beside its peers."""


def say(*lines: str) -> None:
    """Print at once, for some parts take minutes."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


@dataclass(frozen=True, slots=True)
class Figure:
    """One number, and what it rests on."""

    case: str
    method: str
    quantity: str
    value: float
    unit: str = ""
    n: int = 0
    """How many sweeps, trials or events it was counted over."""
    low: float | None = None
    """95 % bounds."""
    high: float | None = None
    least: float | None = None
    """What it should be at least ..."""
    most: float | None = None
    """... and at most."""

    @property
    def verdict(self) -> str:
        """Whether the goal is met, and whether the bounds prove it; nothing without a goal."""
        if self.least is None and self.most is None:
            return ""
        least = -math.inf if self.least is None else self.least
        most = math.inf if self.most is None else self.most
        if not least <= self.value <= most:
            return "missed"
        if self.low is None or self.high is None:
            return "met"
        return "met" if least <= self.low and self.high <= most else "met, not proved"

    @property
    def goal(self) -> str:
        """The goal in words."""
        unit = spaced(self.unit)
        if self.least is not None and self.most is not None:
            return f"{self.least:g} to {self.most:g}{unit}"
        if self.least is not None:
            return f">= {self.least:g}{unit}"
        return f"<= {self.most:g}{unit}" if self.most is not None else ""

    @property
    def text(self) -> str:
        """The number with its bounds and unit."""
        bounds = ""
        if self.low is not None and self.high is not None:
            bounds = f" ({digits(self.low)}-{digits(self.high)})"
        return f"{digits(self.value)}{bounds}{spaced(self.unit)}"


def digits(value: float) -> str:
    """Return a number with about three digits that count, and none beyond a thousandth."""
    if not math.isfinite(value):
        return "-"
    places = 3 if abs(value) < 0.1 else 2 if abs(value) < 10.0 else 1
    text = f"{value:.{places}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def spaced(unit: str) -> str:
    """Return a unit as it follows a number."""
    return f" {unit}" if unit else ""


def share(
    case: str,
    method: str,
    quantity: str,
    good: int,
    n: int,
    *,
    least: float | None = None,
    most: float | None = None,
) -> Figure:
    """Return a share of trials [%] with Wilson's bounds; its goals are in per cent too."""
    low, high = wilson(good, n)
    value = 100.0 * good / max(n, 1)
    return Figure(
        case, method, quantity, value, "%", n, 100.0 * low, 100.0 * high, least=least, most=most
    )


def wilson(good: int, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % bounds of a share."""
    if not count:
        return 0.0, 1.0
    z2 = 1.96**2
    part = good / count
    middle = (part + z2 / (2 * count)) / (1 + z2 / count)
    half = np.sqrt(part * (1 - part) * z2 / count + z2**2 / (4 * count**2)) / (1 + z2 / count)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def poisson(events: int) -> tuple[float, float]:
    """Return Garwood's exact 95 % bounds of how many events were to be expected."""
    low = 0.5 * float(chi2.ppf(0.025, 2 * events)) if events else 0.0
    return low, 0.5 * float(chi2.ppf(0.975, 2 * events + 2))
