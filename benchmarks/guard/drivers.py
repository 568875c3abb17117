"""Drivers that mean to hit something: each holds sticks for a while, which take effect late."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND

_OLDEST: Final = 2.0
"""Age of the oldest commands [s]; those of more than a second are refused, as any driver's are."""
_THERE: Final = 0.6
"""Distance from the scanner at which a driver has come to a wall [m]: the robot's front is 0.25 m before it; chosen."""


class Nearest(NamedTuple):
    """What is nearest in a horizontal scan."""

    bearing: float
    """Where it is [rad]."""
    distance: float
    """How far from the scanner [m]."""

    @staticmethod
    def of(ranges: FloatArray, angles: FloatArray) -> Nearest | None:
        """Return it of ranges (B,) [m] at angles (B,) [rad]; None if nothing is seen."""
        seen = np.isfinite(ranges)
        if not seen.any():
            return None
        i = int(np.argmin(np.where(seen, ranges, np.inf)))
        return Nearest(float(angles[i]), float(ranges[i]))


@dataclass(frozen=True, slots=True)
class Stick:
    """What is held, for so long, and how old it is when it takes effect."""

    forward: float
    """Forward speed [m/s]."""
    turn: float
    """Turn rate [rad/s]."""
    ticks: int
    """For so many ticks."""
    age: int = 0
    """Its age [ns]."""


Draw = Callable[[np.random.Generator, Nearest | None], Stick]
"""Draws the next stick, knowing what is nearest."""


def _random(rng: np.random.Generator, nearest: Nearest | None) -> Stick:
    forward = float(rng.choice([0.7, 0.7, 0.5, -0.4, -0.7, 0.0]))
    turn = float(rng.choice([0.0, 0.0, rng.uniform(-1.2, 1.2), rng.uniform(-2.4, 2.4)]))
    late = rng.uniform(0.0, _OLDEST) if rng.random() < 0.3 else 0.0
    return Stick(forward, turn, int(rng.integers(10, 200)), round(late * SECOND))


def _at_the_wall(rng: np.random.Generator, nearest: Nearest | None) -> Stick:
    """Steer for what is nearest, at up to full speed, and along it; now and then turn away from it, and come again."""
    if nearest is None:
        return _random(rng, nearest)
    if nearest.distance < _THERE and rng.random() < 0.2:
        forward, turn = float(rng.choice([-0.3, 0.0, 0.5])), float(rng.uniform(-1.5, 1.5))
        return Stick(forward, turn, int(rng.integers(30, 120)))
    turn = float(np.clip(2.0 * nearest.bearing * rng.choice([1.0, 1.0, -0.3]), -1.5, 1.5))
    late = rng.uniform(0.0, 1.0) if rng.random() < 0.3 else 0.0
    return Stick(
        float(rng.choice([0.7, 0.3])), turn, int(rng.integers(5, 40)), round(late * SECOND)
    )


def _bursts(rng: np.random.Generator, nearest: Nearest | None) -> Stick:
    forward, turn = float(rng.choice([0.7, -0.7, 0.0])), float(rng.choice([0.0, 2.4, -2.4]))
    return Stick(forward, turn, int(rng.integers(2, 15)))


def _backwards(rng: np.random.Generator, nearest: Nearest | None) -> Stick:
    forward = float(rng.choice([-0.7, -0.7, -0.15, 0.5]))
    return Stick(forward, float(rng.uniform(-1.0, 1.0)), int(rng.integers(20, 300)))


DRIVERS: Final[Mapping[str, Draw]] = {
    "random": _random,
    "at the wall": _at_the_wall,
    "bursts": _bursts,
    "backwards": _backwards,
}
"""The drivers by name."""
