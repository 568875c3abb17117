"""Drawing of a path that grows with the drive."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr

from localization.display.colours import Colour
from localization.display.rerun_sink import Canvas
from localization.geometry import FloatArray

STEP: Final = 0.05
"""Length of a path segment [m]."""
JUMP: Final = 0.5
"""Distance between two poses beyond which the estimate jumped and no line is drawn [m]."""


class PathDrawing:
    """Draws each segment of a path once, so that the cost of a pose does not grow with time.

    The views cover the whole time, which joins the segments.
    """

    def __init__(
        self, canvas: Canvas, entity: str, colour: Colour, *, width: float, lift: float
    ) -> None:
        """Begin a path.

        Args:
            canvas: Canvas to draw on.
            entity: Entity path.
            colour: Colour of the line.
            width: Half width of the line in pixels.
            lift: Height above the poses at which it is drawn [m].
        """
        self._canvas, self._entity = canvas, entity
        self._lift = np.array([0.0, 0.0, lift])
        self._last: FloatArray | None = None
        # Colour and width are logged once; segments hold points only.
        style = rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(width))
        canvas.draw(entity, style, static=True)

    def add(self, position: FloatArray) -> None:
        """Extend the path to a position (3,) in ``map`` [m]."""
        if self._last is None:
            self._last = position
            return
        moved = float(np.linalg.norm(position - self._last))
        if moved < STEP:
            return
        if moved < JUMP:
            piece = np.stack([self._last, position]) + self._lift
            self._canvas.draw(self._entity, rr.LineStrips3D.from_fields(strips=[piece]))
        self._last = position
