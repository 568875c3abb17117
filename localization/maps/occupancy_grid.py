"""ROS occupancy maps: a ``map.yaml`` with the image of a grid beside it."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from localization.geometry import FloatArray
from localization.maps.grid_image import FREE, OCCUPIED, Borderline, ImageRule, read_cells
from localization.maps.map_yaml import GridOrigin, OccupancyError, read_entries
from localization.types import BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyMap:
    """A grid of square cells, each occupied, free or unknown."""

    name: str
    """The place's name: that of the file, or of its folder if the file is called ``map.yaml``."""
    resolution: float
    """Side of a cell [m]."""
    origin: GridOrigin
    """Pose of the outer corner of cell (0, 0) in ``map``."""
    occupied: BoolArray
    """Which cells are occupied (rows, columns), the first row at the grid's smallest y."""
    free: BoolArray
    """Which cells are free (rows, columns)."""
    sha256: str = ""
    """Hex digest of the bytes of both files."""
    borderline: tuple[Borderline, ...] = ()
    """Cells whose pixels are so close to a threshold that another threshold would make them something else."""

    def in_map(self, points: FloatArray) -> FloatArray:
        """Return points (..., 2) [m], given in the grid's frame, in the frame ``map``."""
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        turned: FloatArray = points @ np.array([[c, s], [-s, c]])
        return turned + (self.origin.x, self.origin.y)

    def in_grid(self, points: FloatArray) -> FloatArray:
        """Return points (..., 2) [m], given in the frame ``map``, in the grid's frame."""
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        turned: FloatArray = (points - (self.origin.x, self.origin.y)) @ np.array([[c, -s], [s, c]])
        return turned


def read_occupancy_map(path: str | Path) -> OccupancyMap:
    """Read a map and its image.

    Raises:
        OccupancyError: If the file or its image cannot be read, or an entry is missing or invalid; the
            message names the entry and what would work.
    """
    path = Path(path)
    try:
        entries = read_entries(path)
        mode = entries.mode()
        resolution = entries.number("resolution")
        if resolution <= 0.0:
            raise OccupancyError(f"resolution must be > 0 m per cell, got {resolution:g}")
        low, high = entries.number("free_thresh"), entries.number("occupied_thresh")
        if not 0.0 <= low < high <= 1.0:
            raise OccupancyError(
                "thresholds must be 0 <= free_thresh < occupied_thresh <= 1,"
                f" got free_thresh {low:g} and occupied_thresh {high:g}"
            )
        origin, negate = entries.origin(), entries.flag("negate")
        image = path.parent / entries.image()
        cells = read_cells(image, ImageRule(mode, negate, low, high))
        identity = hashlib.sha256(path.read_bytes() + image.read_bytes()).hexdigest()
    except OccupancyError as error:
        raise OccupancyError(f"map {str(path)!r}: {error}") from None
    # The first row of an image is its top, that of a grid its bottom.
    name = path.stem if path.stem != "map" else path.resolve().parent.name
    codes = cells.codes[::-1]
    return OccupancyMap(
        name, resolution, origin, codes == OCCUPIED, codes == FREE, identity, cells.borderline()
    )
