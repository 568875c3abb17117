"""Files of maps: point clouds and occupancy grids read, clouds written.

Our own file is a binary little-endian PLY with ``x y z nx ny nz`` as float32 and its name, frame and origin
as comments, and the noise of a map made without truth (``position_noise`` [m], ``heading_noise`` [rad]); any
point-cloud tool opens it. Its identity is the SHA-256 of its bytes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from plyfile import PlyData, PlyElement

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud, CloudError
from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.cloud_normals import require_relief, with_normals
from localization.maps.occupancy_grid import read_occupancy_map
from localization.maps.point_files import read_points
from localization.types import Pose

_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")
_LARGEST_EXTENT = 5_000.0
"""Extent [m] beyond which a cloud is rejected: it is almost surely in millimetres or geodetic coordinates."""
_SMALL = 1000
"""Number of points up to which a cloud with normals may be a single surface: it is somebody's example."""
_LARGE = 300.0
"""Extent [m] beyond which a cloud must be as dense as a scanned place."""


def load_cloud(
    path: str | Path, *, inside: npt.ArrayLike | None = None, cache: Path | None = None
) -> Cloud:
    """Read a cloud from a PLY file, a PCD file, or a text with lines ``x y z``.

    If the file has no normals, they are computed: each point's from its neighbours, turned towards a place
    from which it can be seen. Those places are on the mapping drive, if a TUM file of the same name lies
    beside the cloud; otherwise they are all places on its floor where a robot could stand.

    Args:
        path: File to read.
        inside: A place in the open (3,) [m], for a cloud without normals, drive and floor.
        cache: Folder for clouds with computed normals, which take seconds; None keeps no file.

    Raises:
        CloudError: If the file is missing, damaged or of an unknown kind; if its coordinates cannot be a
            place in metres; if it is one plane; or if it has no normals and no place from which it could be seen.
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise CloudError(f"cannot read cloud {path}: {error.strerror}") from None
    table = read_points(path, raw)
    sha256 = hashlib.sha256(raw).hexdigest()
    _check(table.points, table.normals, path)
    if table.normals is None:
        return with_normals(path, table.points, sha256, inside=inside, cache=cache)
    if len(table.points) > _SMALL:
        require_relief(path, table.points, table.normals)
    normals = table.normals / _lengths(table.normals)[:, None]
    return Cloud(
        table.points,
        normals,
        name=table.comments.get("name", path.stem),
        frame=table.comments.get("frame", "map"),
        sha256=sha256,
        position_noise=_noise(table.comments, "position_noise", path),
        heading_noise=_noise(table.comments, "heading_noise", path),
    )


def load_grid(path: str | Path) -> Cloud:
    """Read an occupancy map as a cloud with upright walls in the occupied cells.

    Raises:
        OccupancyError: If the map or its image cannot be read, as in ``read_occupancy_map``.
        CloudError: If no wall of it can be seen.
    """
    grid = read_occupancy_map(path)
    origin = Pose.planar(grid.origin.x, grid.origin.y, grid.origin.yaw)
    cloud = cloud_from_grid(grid.occupied, grid.free, grid.resolution, origin, name=grid.name)
    return replace(cloud, sha256=grid.sha256)


def load_map(
    path: str | Path, *, inside: npt.ArrayLike | None = None, cache: Path | None = None
) -> Cloud:
    """Read a map of either kind: a cloud, or a ROS occupancy grid by its ``map.yaml``.

    Args:
        path: File to read.
        inside: See ``load_cloud``.
        cache: See ``load_cloud``.

    Raises:
        CloudError: If the file cannot be read, or cannot serve as a map.
    """
    if Path(path).suffix in (".yaml", ".yml"):
        return load_grid(path)
    return load_cloud(path, inside=inside, cache=cache)


def save_cloud(cloud: Cloud, path: str | Path) -> Cloud:
    """Write a cloud as PLY and return it as the file holds it, rounded to float32 and with its hash."""
    dtype = [(c, "<f4") for c in _COLUMNS]
    table: npt.NDArray[np.void] = np.empty(len(cloud.points), dtype=dtype)
    for i, c in enumerate(_COLUMNS):
        table[c] = (cloud.points if i < 3 else cloud.normals)[:, i % 3]
    comments = [f"name {cloud.name}", f"frame {cloud.frame}", "origin 0 0 0", "unit metre"]
    # A map with known poses has no such lines, so that its bytes stay the same.
    noises = {"position_noise": cloud.position_noise, "heading_noise": cloud.heading_noise}
    comments += [f"{name} {noise:.6f}" for name, noise in noises.items() if noise > 0.0]
    element = PlyElement.describe(table, "vertex")
    PlyData([element], text=False, byte_order="<", comments=comments).write(str(path))
    return load_cloud(path)


def _noise(comments: Mapping[str, str], name: str, path: Path) -> float:
    """Return a noise from the comments of a file, 0 if it has none.

    Raises:
        CloudError: If it is no number >= 0.
    """
    text = comments.get(name, "0")
    try:
        noise = float(text)
    except ValueError:
        noise = -1.0
    if not (np.isfinite(noise) and noise >= 0.0):
        raise CloudError(f"cloud {path}: the comment {name} must be a number >= 0, got {text!r}")
    return noise


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def _check(points: FloatArray, normals: FloatArray | None, path: Path) -> None:
    if len(points) == 0:
        raise CloudError(f"cloud {path} is empty")
    finite = np.isfinite(points).all() and (normals is None or np.isfinite(normals).all())
    if not finite:
        columns = points if normals is None else np.hstack([points, normals])
        bad = int((~np.isfinite(columns)).any(axis=1).sum())
        raise CloudError(f"cloud {path} has {bad} points that are not finite; leave them out")
    if normals is not None and (np.abs(_lengths(normals) - 1.0) > 0.1).any():
        raise CloudError(
            f"cloud {path} has normals that are not of unit length; a cloud without normals gets computed ones"
        )
    extent = float(np.ptp(points, axis=0).max())
    if extent > _LARGEST_EXTENT:
        raise CloudError(
            f"cloud {path} spans {extent:.0f} m; coordinates must be metres (is it in millimetres?)"
        )
    # A cloud both large and thin is not in metres: a room of 4 m is 4000 mm.
    if extent > _LARGE and len(points) < 2 * len(np.unique(np.floor(points), axis=0)):
        raise CloudError(
            f"cloud {path} spans {extent:.0f} m with its points a metre apart; coordinates must be metres"
            " (is it in millimetres?)"
        )
