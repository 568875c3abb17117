"""A path that grows with the drive."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr

from localization.display.colours import Colour
from localization.display.rerun_sink import Canvas
from localization.geometry import FloatArray

STEP: Final = 0.05
"""A path gets a new piece when the robot has moved this far [m]."""
JUMP: Final = 0.5
"""Farther than this between two poses the estimate jumped, and no line is drawn [m]."""


class Trail:
    """Draws each piece of a path once, so that a message costs the same after an hour.

    The blueprint's views look back to the beginning, which joins the pieces.
    """

    def __init__(
        self, canvas: Canvas, entity: str, colour: Colour, *, width: float, lift: float
    ) -> None:
        """Begin a path.

        Args:
            canvas: where to.
            entity: its path.
            colour: of the line.
            width: half of it, in pixels.
            lift: how high above the floor it is drawn [m].
        """
        self._canvas, self._entity = canvas, entity
        self._lift = np.array([0.0, 0.0, lift])
        self._last: FloatArray | None = None
        # Colour and width are said once; the pieces are points only.
        style = rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(width))
        canvas.draw(entity, style, static=True)

    def add(self, position: FloatArray) -> None:
        """Go on to a position (3,) in ``map`` [m]."""
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
