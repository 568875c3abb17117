"""Occupancy maps as ROS keeps them: a ``map.yaml`` with the image of a grid beside it.

What a pixel means is what nav2's map_server makes of it: how dark it is says how occupied its cell is,
and thresholds, or the pixel's own value in mode ``raw``, part occupied, free and unknown.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from PIL import Image, UnidentifiedImageError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from localization.geometry import FloatArray
from localization.maps.cloud import CloudError
from localization.maps.cloud_from_grid import BoolArray

MODES: Final = ("trinary", "scale", "raw")
_NEEDED: Final = ("image", "resolution", "origin", "occupied_thresh", "free_thresh", "negate")
_EXAMPLE: Final = "as in `resolution: 0.05`, `origin: [0.0, 0.0, 0.0]`"


class OccupancyError(CloudError):
    """A ``map.yaml`` or an image that cannot be read; the message names the entry and what would do."""


@dataclass(frozen=True, slots=True)
class GridOrigin:
    """Where a grid's frame lies in ``map``."""

    x: float
    """[m]."""
    y: float
    """[m]."""
    yaw: float = 0.0
    """[rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyMap:
    """A grid of square cells, some occupied, some free, the others unknown."""

    name: str
    resolution: float
    """Side of a cell [m]."""
    origin: GridOrigin
    """Where the outer corner of cell (0, 0) lies in ``map``, and how the grid is turned."""
    occupied: BoolArray
    """(rows, columns), the first row at the grid's smallest y."""
    free: BoolArray
    """(rows, columns)."""
    sha256: str = ""
    """Of the bytes of both files."""

    def in_map(self, points: FloatArray) -> FloatArray:
        """Return points (..., 2) of the grid's frame in ``map`` [m]."""
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        turned: FloatArray = points @ np.array([[c, s], [-s, c]])
        return turned + (self.origin.x, self.origin.y)

    def in_grid(self, points: FloatArray) -> FloatArray:
        """Return points (..., 2) of ``map`` in the grid's frame [m]."""
        c, s = math.cos(self.origin.yaw), math.sin(self.origin.yaw)
        turned: FloatArray = (points - (self.origin.x, self.origin.y)) @ np.array([[c, -s], [s, c]])
        return turned


def read_occupancy_map(path: str | Path) -> OccupancyMap:
    """Read a map and its image.

    Raises:
        OccupancyError: the file or its image cannot be read, or an entry is missing or impossible; the
            message names it and what would do.
    """
    path = Path(path)
    try:
        entries = _Entries(_parsed(path))
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
    # Images begin at the top, grids at the bottom.
    name = path.stem if path.stem != "map" else path.resolve().parent.name
    return OccupancyMap(name, resolution, origin, occupied[::-1], free[::-1], identity)


def _parsed(path: Path) -> Mapping[str, Any]:
    try:
        entries = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise OccupancyError(f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise OccupancyError("is not a text file; give the map's .yaml, not its image") from None
    except MarkedYAMLError as error:
        line = f" in line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise OccupancyError(f"is not YAML: {error.problem or 'it does not parse'}{line}") from None
    except YAMLError as error:
        raise OccupancyError(f"is not YAML: {' '.join(str(error).split())}") from None
    if not isinstance(entries, Mapping):
        raise OccupancyError(f"must hold the entries {', '.join(_NEEDED)}, {_EXAMPLE}")
    return entries


class _Entries:
    """The entries of a map file, read one by one."""

    def __init__(self, entries: Mapping[str, Any]) -> None:
        self._entries = entries

    def _entry(self, key: str) -> Any:
        if key not in self._entries:
            raise OccupancyError(f"lacks the entry {key!r}; it needs {', '.join(_NEEDED)}")
        return self._entries[key]

    def number(self, key: str) -> float:
        return _number(key, self._entry(key))

    def flag(self, key: str) -> bool:
        value = self._entry(key)
        if value not in (0, 1):
            raise OccupancyError(f"{key} must be 0 or 1, got {value!r}")
        return bool(value)

    def image(self) -> str:
        value = self._entry("image")
        if not isinstance(value, str) or not value:
            raise OccupancyError(f"image must be the name of a file, got {value!r}")
        return value

    def mode(self) -> str:
        mode = self._entries.get("mode", MODES[0])
        if mode not in MODES:
            raise OccupancyError(f"mode must be one of {', '.join(MODES)}, got {mode!r}")
        return str(mode)

    def origin(self) -> GridOrigin:
        value = self._entry("origin")
        if not isinstance(value, list) or len(value) != 3:
            raise OccupancyError(f"origin must be [x, y, yaw] in metres and radians, got {value!r}")
        x, y, yaw = (_number("origin", v) for v in value)
        return GridOrigin(x, y, yaw)


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise OccupancyError(f"{key} must be a number, got {value!r}")
    if not math.isfinite(value):
        raise OccupancyError(f"{key} must be finite, got {value}")
    return float(value)


def _pixels(path: Path) -> FloatArray:
    """Return an image as (rows, columns, 4) red, green, blue, alpha, each from 0 to 1."""
    try:
        with Image.open(path) as image:
            if image.mode.startswith("I"):
                grey = np.asarray(image, dtype=float) / 65535.0
                return np.stack([grey, grey, grey, np.ones_like(grey)], axis=2)
            return np.asarray(image.convert("RGBA"), dtype=float) / 255.0
    except UnidentifiedImageError:
        raise OccupancyError(f"image {str(path)!r} is no image; PGM and PNG will do") from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise OccupancyError(f"image {str(path)!r} cannot be read: {reason}") from None


def _cells(
    pixels: FloatArray, mode: str, *, negate: bool, low: float, high: float
) -> tuple[BoolArray, BoolArray]:
    """Return which cells (rows, columns) are occupied and which are free."""
    opaque = pixels[:, :, 3] == 1.0
    # Where nothing is transparent, averaging the alpha channel in would only brighten.
    channels = 4 if mode == "trinary" and not opaque.all() else 3
    shade = pixels[:, :, :channels].mean(axis=2)
    if mode == "raw":
        # The pixel's value is the occupancy in percent; what is beyond 100 is unknown.
        value = np.round(255.0 * shade)
        return (value >= 100.0 * high) & (value <= 100.0), value <= 100.0 * low
    occupancy = shade if negate else 1.0 - shade
    occupied, free = occupancy > high, occupancy < low
    if mode == "scale":
        return occupied & opaque, free & opaque
    return occupied, free
