"""ROS occupancy maps: a ``map.yaml`` with the image of a grid beside it.

Pixels are interpreted as by nav2's map_server: the darker a pixel, the more occupied its cell; thresholds, or
the pixel's own value in mode ``raw``, separate occupied, free and unknown cells.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from localization.geometry import FloatArray
from localization.maps.map_yaml import GridOrigin, OccupancyError, read_entries

BoolArray = npt.NDArray[np.bool_]


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
        pixels = _pixels(image)
        identity = hashlib.sha256(path.read_bytes() + image.read_bytes()).hexdigest()
    except OccupancyError as error:
        raise OccupancyError(f"map {str(path)!r}: {error}") from None
    occupied, free = _cells(pixels, mode, negate=negate, low=low, high=high)
    # The first row of an image is its top, that of a grid its bottom.
    name = path.stem if path.stem != "map" else path.resolve().parent.name
    return OccupancyMap(name, resolution, origin, occupied[::-1], free[::-1], identity)


def _pixels(path: Path) -> FloatArray:
    """Return an image as (rows, columns, 4) red, green, blue, alpha, each from 0 to 1."""
    try:
        with Image.open(path) as image:
            if image.mode.startswith("I"):
                grey = np.asarray(image, dtype=float) / 65535.0
                return np.stack([grey, grey, grey, np.ones_like(grey)], axis=2)
            return np.asarray(image.convert("RGBA"), dtype=float) / 255.0
    except UnidentifiedImageError:
        raise OccupancyError(f"image {str(path)!r} is not an image; use PGM or PNG") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise OccupancyError(f"image {str(path)!r} cannot be read: {reason}") from None


def _cells(
    pixels: FloatArray, mode: str, *, negate: bool, low: float, high: float
) -> tuple[BoolArray, BoolArray]:
    """Return which cells (rows, columns) are occupied and which are free."""
    opaque = pixels[:, :, 3] == 1.0
    # In an opaque image the alpha channel would only brighten the mean.
    channels = 4 if mode == "trinary" and not opaque.all() else 3
    shade = pixels[:, :, :channels].mean(axis=2)
    if mode == "raw":
        # The pixel's value is the occupancy in percent; values above 100 mean unknown.
        value = np.round(255.0 * shade)
        return (value >= 100.0 * high) & (value <= 100.0), value <= 100.0 * low
    occupancy = shade if negate else 1.0 - shade
    occupied, free = occupancy > high, occupancy < low
    if mode == "scale":
        return occupied & opaque, free & opaque
    return occupied, free
