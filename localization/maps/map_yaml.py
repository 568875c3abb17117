"""Entries of a ROS ``map.yaml``, checked one by one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from localization.maps.cloud import CloudError

MODES: Final = ("trinary", "scale", "raw")
_NEEDED: Final = ("image", "resolution", "origin", "occupied_thresh", "free_thresh", "negate")
_EXAMPLE: Final = "as in `resolution: 0.05`, `origin: [0.0, 0.0, 0.0]`"


class OccupancyError(CloudError):
    """A ``map.yaml`` or an image that cannot be read; the message names the entry and what would work."""


@dataclass(frozen=True, slots=True)
class GridOrigin:
    """Planar pose of a grid's frame in ``map``."""

    x: float
    """The frame's x coordinate [m]."""
    y: float
    """The frame's y coordinate [m]."""
    yaw: float = 0.0
    """The frame's heading [rad]."""


def read_entries(path: Path) -> MapEntries:
    """Read the entries of a ``map.yaml``.

    Raises:
        OccupancyError: If the file cannot be read, or is not YAML with entries.
    """
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
    return MapEntries(entries)


class MapEntries:
    """Entries of a ``map.yaml``; each method raises ``OccupancyError`` if its entry is missing or invalid."""

    def __init__(self, entries: Mapping[str, Any]) -> None:
        self._entries = entries

    def _entry(self, key: str) -> Any:
        if key not in self._entries:
            raise OccupancyError(f"lacks the entry {key!r}; it needs {', '.join(_NEEDED)}")
        return self._entries[key]

    def number(self, key: str) -> float:
        """Return an entry that must be a finite number."""
        return _number(key, self._entry(key))

    def flag(self, key: str) -> bool:
        """Return an entry that must be 0 or 1."""
        value = self._entry(key)
        if value not in (0, 1):
            raise OccupancyError(f"{key} must be 0 or 1, got {value!r}")
        return bool(value)

    def image(self) -> str:
        """Return the name of the image's file."""
        value = self._entry("image")
        if not isinstance(value, str) or not value:
            raise OccupancyError(f"image must be the name of a file, got {value!r}")
        return value

    def mode(self) -> str:
        """Return the mode in which pixels are interpreted, one of ``MODES``."""
        mode = self._entries.get("mode", MODES[0])
        if mode not in MODES:
            raise OccupancyError(f"mode must be one of {', '.join(MODES)}, got {mode!r}")
        return str(mode)

    def origin(self) -> GridOrigin:
        """Return the grid's pose in ``map``."""
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
