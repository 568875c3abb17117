"""Another map of a scene than its own: one made without truth, or of an older state."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import load_cloud
from localization.maps.prepared_map import default_cache
from robot_sim import World

_FRAME: Final = "map"
_BESIDE: Final = 1.0
"""Distance from the bounds of a map within which the spawn may lie [m]."""


def load_other_map(path: Path, world: World) -> Cloud:
    """Load a map for a robot in a world, in the coordinates of that world.

    Raises:
        CloudError: If it cannot be read, is in another frame than ``map``, or is not a map of this place: the
            robot starts outside it.
    """
    if path.suffix.lower() != ".ply":
        # Operators get the file as /map.ply.
        raise CloudError(
            f"map must be a cloud as `farsteer map` writes it, a .ply file, got {str(path)!r}"
        )
    cloud = load_cloud(path, cache=default_cache())
    if cloud.frame != _FRAME:
        raise CloudError(f"map {path} is in frame {cloud.frame!r}; the robot's is {_FRAME!r}")
    low, high = cloud.bounds
    x, y = map(float, world.spawn.position[:2])
    if not (
        low[0] - _BESIDE <= x <= high[0] + _BESIDE and low[1] - _BESIDE <= y <= high[1] + _BESIDE
    ):
        raise CloudError(
            f"map {path} is not a map of {world.name}: the robot starts at x {x:.1f}, y {y:.1f}, and the map"
            f" reaches from {low[0]:.1f}, {low[1]:.1f} to {high[0]:.1f}, {high[1]:.1f}"
        )
    return cloud
