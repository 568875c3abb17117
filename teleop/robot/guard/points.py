"""What the guard knows around the robot: points, and what knows them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from localization.geometry import FloatArray

HORIZONTAL: Final = 0
"""Number of the horizontal scanner among the sources of points."""
VERTICAL: Final = 1
"""Number of the vertical one."""
MEMORY: Final = 2
"""Number of what neither sees now."""
UNSEEN: Final = 3
"""Number of what is taken to go on where no scanner looks."""
SOURCES: Final = ("laser_horizontal", "laser_vertical", "memory", "unseen")
"""Names of the sources."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Points around the robot."""

    xy: FloatArray
    """(N, 2) in ``base_link`` [m]."""
    sources: FloatArray
    """(N,) numbers of what knows them."""
    moving: NDArray[np.bool_]
    """(N,) whether they have just come to where there was nothing, as a person does."""
    loose: FloatArray
    """(N,) by how much nearer they may be than they seem [m]: they have drifted, or the robot leans."""

    most: FloatArray | None = None
    """(N,) distance that is enough in any case [m], however near: the robot came by so near to them; None without a limit."""

    def of(self, which: NDArray[np.bool_]) -> Points:
        """Return those that are chosen (N,)."""
        most = None if self.most is None else self.most[which]
        kept = (self.xy[which], self.sources[which], self.moving[which], self.loose[which])
        return Points(*kept, most)
