"""Colours and output format of the report's figures."""

from __future__ import annotations

import io
from typing import Final

from matplotlib.figure import Figure

from localization.display.colours import HEALTH
from localization.types import Health

BLUE: Final = "#0072b2"
VERMILION: Final = "#d55e00"
PURPLE: Final = "#cc79a7"
GREY: Final = "#8a8a8a"
LINE_POINTS: Final = 20_000
"""Number of points of a curve at most; longer curves are thinned."""


def health_colour(state: Health) -> str:
    """Return the colour of a health state, such as ``#009e73``."""
    red, green, blue = HEALTH[state.value]
    return f"#{red:02x}{green:02x}{blue:02x}"


GREEN: Final = health_colour(Health.TRACKING)


def png(figure: Figure) -> bytes:
    """Return a figure as a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()
