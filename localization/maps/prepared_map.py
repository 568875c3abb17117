"""Cloud prepared for matching: a grid of nearest points, the height of the ground, its noise, ends and faces of walls.

All are derived from the cloud alone and are cached under the cloud's hash.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from localization.compiled.surfaces import CloudArrays, IndexArray, NearestGrid
from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.maps.ground_height import Ground, ground_of
from localization.maps.map_cache import default_cache as default_cache, load, store
from localization.maps.map_noise import MapNoise, measured_noise, normal_spread
from localization.maps.nearest_grid_building import build_grid
from localization.maps.thin_walls import other_faces

_VERSION = 6
"""Part of a cache file's name; it changes with the layout or the meaning of the file's content."""


@dataclass(frozen=True, slots=True, eq=False)
class PreparedMap:
    """The global cloud with what the localiser derives from it."""

    cloud: Cloud
    """Points and normals of the map."""
    grid: NearestGrid
    """Nearest point of any place near a surface."""
    ground: Ground
    """Height of the ground."""
    noise: MapNoise = field(default_factory=MapNoise)
    """Noise of its points and normals, as measured on the map."""
    spread: npt.NDArray[np.float32] = field(default_factory=lambda: np.zeros(0, dtype=np.float32))
    """(N,) by how much the normals around each point differ [rad]; empty if that is not known."""
    behind: IndexArray = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    """(N,) index of the nearest point of a thin wall's other face, -1 for other points; empty if there are no thin
    walls."""

    arrays: CloudArrays = field(init=False, repr=False)
    """What loops take of it."""

    def __post_init__(self) -> None:
        arrays = CloudArrays(self.grid, self.cloud.points, self.cloud.normals, self.behind)
        object.__setattr__(self, "arrays", arrays)

    def contains(self, x: float, y: float, *, margin: float = 0.0) -> bool:
        """Return whether (x, y) [m] lies in the cloud's bounds, grown by ``margin`` [m]."""
        low, high = self.cloud.bounds
        return bool(
            low[0] - margin <= x <= high[0] + margin and low[1] - margin <= y <= high[1] + margin
        )

    def cut_below(self, points: FloatArray) -> npt.NDArray[np.bool_]:
        """Return which points (N, 3) lie above all that is mapped: of them a map that was cut there says nothing."""
        above: npt.NDArray[np.bool_] = points[:, 2] > self.cloud.bounds[1][2] + _ABOVE
        return above


_ABOVE = 0.3
"""Height above the highest point of a map from which on it is taken to have been cut [m]: three times the distance within
which a point is explained."""


def prepare(
    cloud: Cloud, *, cell: float = 0.05, reach: float = 0.4, cache: Path | None = None
) -> PreparedMap:
    """Prepare a cloud for matching.

    Args:
        cloud: The global cloud.
        cell: Edge of a grid cell [m].
        reach: Distance from a surface up to which a nearest point is found [m].
        cache: Folder for derived files, read if it holds this cloud's; None keeps no file.
    """
    file = None
    if cache is not None and cloud.sha256:
        file = cache / f"{cloud.sha256[:24]}-{cell:g}-{reach:g}-v{_VERSION}.npz"
        kept = _load(file, cloud)
        if kept is not None:
            return kept
    grid = build_grid(cloud.points, cell, reach)
    world = PreparedMap(
        cloud,
        grid,
        ground_of(cloud),
        measured_noise(cloud),
        normal_spread(cloud),
        _if_any(other_faces(cloud)),
    )
    if file is not None:
        _store(file, world)
    return world


def _if_any(behind: IndexArray) -> IndexArray:
    """Return the indices (N,) of other faces, or an empty array if there are none."""
    return behind if (behind >= 0).any() else behind[:0]


def _load(file: Path, cloud: Cloud) -> PreparedMap | None:
    kept = load(file)
    try:
        if kept is None or int(kept["points"]) != len(cloud.points):
            return None
        grid = NearestGrid(
            kept["origin"],
            float(kept["cell"]),
            kept["directory"],
            kept["blocks"],
            kept["first"],
            kept["owners"],
        )
        level, seen = kept["ground_level"].tolist()
        ground = Ground(kept["ground_origin"], kept["ground_height"], level, seen)
        noise = MapNoise(*kept["noise"].tolist())
        spread = kept["spread"].reshape(len(cloud.points))
        behind = kept["behind"]
        if len(behind) not in (0, len(cloud.points)):
            return None
    except (KeyError, TypeError, ValueError):
        return None
    return PreparedMap(cloud, grid, ground, noise, spread, behind)


def _store(file: Path, world: PreparedMap) -> None:
    grid, ground = world.grid, world.ground
    arrays = {
        "points": np.int64(len(world.cloud.points)),
        "origin": grid.origin,
        "cell": np.float64(grid.cell),
        "directory": grid.directory,
        "blocks": grid.blocks,
        "first": grid.first,
        "owners": grid.owners,
        "ground_origin": ground.origin,
        "ground_height": ground.height,
        "ground_level": np.array([ground.level, ground.seen]),
        "noise": np.array([world.noise.distance, world.noise.normal]),
        "spread": world.spread,
        "behind": world.behind,
    }
    store(file, {name: np.asarray(value) for name, value in arrays.items()})
