"""What can be spawned into a world that is built for it."""

from typing import Final

SPARE_BOXES: Final = ((0.4, 0.4, 0.4), (0.6, 0.6, 1.0), (1.2, 0.6, 0.8), (2.0, 0.2, 2.0))
"""Sizes of the boxes [m]: a carton, a rack, a table and a closed door."""
SPARE_PEOPLE: Final = 2
"""Number of people."""
