"""Colours of the display, distinguishable for colour-blind people and on a dark background.

States and objects use the palette of Okabe and Ito ("Color Universal Design", 2008). Distances use the upper
part of Matplotlib's viridis (Smith and van der Walt), whose lightness increases monotonically; its dark end would
be invisible over the grey map.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from localization.geometry import FloatArray

Colour: TypeAlias = tuple[int, int, int]
"""Red, green and blue, each 0 to 255."""
Colours: TypeAlias = npt.NDArray[np.uint8]

ORANGE: Final[Colour] = (230, 159, 0)
SKY: Final[Colour] = (86, 180, 233)
GREEN: Final[Colour] = (0, 158, 115)
YELLOW: Final[Colour] = (240, 228, 66)
VERMILION: Final[Colour] = (213, 94, 0)
GREY: Final[Colour] = (150, 150, 150)
WHITE: Final[Colour] = (235, 235, 235)
RED: Final[Colour] = (226, 50, 40)

DISTANCE_FULL: Final = 0.2
"""Distance from the map at which the colour scale ends [m]."""

UNMAPPED: Final[Colour] = (255, 90, 200)
"""Colour of points without a mapped surface near."""

HEALTH: Final[dict[str, Colour]] = {
    "waiting": GREY,
    "tracking": GREEN,
    "degraded": YELLOW,
    "slipping": ORANGE,
    "suspect": VERMILION,
    "lost": RED,
    "relocalising": SKY,
}
"""Colours of the field ``health`` of ``LocalizationStatus``."""

CONTROL: Final[dict[str, Colour]] = {
    "idle": GREY,
    "armed": GREEN,
    "disarmed": ORANGE,
    "estop": RED,
}
"""Colours of the field ``state`` of ``TeleopState``."""

STALE: Final[Colour] = (95, 95, 100)
"""Colour of the state "stale" of any lane."""

VERDICT: Final[dict[str, Colour]] = {
    "accepted": GREEN,
    "kept": SKY,
    "ambiguous": ORANGE,
    "rejected": RED,
}
"""Colours of the field ``verdict`` of ``HintVerdict``."""

LINK: Final[dict[str, Colour]] = {"connected": GREEN, "silent": STALE, "lost": RED}
MAP: Final[dict[str, Colour]] = {
    "awaited": GREY,
    "verified": GREEN,
    "unverified": ORANGE,
    "other map": RED,
}
DEADMAN: Final[dict[str, Colour]] = {"held": GREEN, "released": GREY}

_VIRIDIS_UPPER: Final = np.array(
    [
        (33, 145, 140),
        (32, 163, 134),
        (53, 183, 121),
        (94, 201, 98),
        (144, 215, 67),
        (199, 224, 32),
        (253, 231, 37),
    ],
    dtype=float,
)


def distance_colours(distances: npt.ArrayLike) -> Colours:
    """Return colours (N, 3) of signed distances (N,) to the map [m]: teal at 0, yellow at 0.2 m.

    NaN, for points without a mapped surface near, gives ``UNMAPPED``.
    """
    distance = np.abs(np.asarray(distances, dtype=float))
    known = np.isfinite(distance)
    share = np.minimum(np.where(known, distance, 0.0) / DISTANCE_FULL, 1.0)
    at = share * (len(_VIRIDIS_UPPER) - 1)
    steps = np.arange(len(_VIRIDIS_UPPER))
    mixed = np.stack([np.interp(at, steps, channel) for channel in _VIRIDIS_UPPER.T], axis=-1)
    mixed[~known] = UNMAPPED
    colours: Colours = np.rint(mixed).astype(np.uint8)
    return colours


def height_greys(heights: FloatArray) -> Colours:
    """Return greys (N, 3) of heights (N,) [m]: the higher, the lighter."""
    low, high = float(heights.min()), float(heights.max())
    share = (heights - low) / max(high - low, 1e-9)
    grey = np.rint(78.0 + 92.0 * share).astype(np.uint8)
    return np.repeat(grey[:, None], 3, axis=1)
