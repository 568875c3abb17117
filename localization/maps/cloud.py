"""The prebuilt global cloud: load, check and save the PLY that robot and operator both hold.

Our own file is a binary little-endian PLY with ``x y z nx ny nz`` as float32 and its name, frame and origin
as comments; any point-cloud tool opens it. Its identity is the SHA-256 of its bytes.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from plyfile import PlyData, PlyElement

from localization.geometry import FloatArray
from localization.maps.point_files import CloudError as CloudError, read_points

_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")
_LARGEST_EXTENT = 5_000.0
"""[m]. A larger cloud is almost surely in millimetres or in geodetic coordinates."""
_LARGE = 300.0
"""[m]. A cloud that is larger is asked whether it is as dense as a scanned place."""


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """Points of a mapped place with unit normals that point to where the surface was seen from."""

    points: FloatArray
    """(N, 3) [m], in ``frame``."""
    normals: npt.NDArray[np.floating]
    """(N, 3), unit length; kept as float32, for what that rounds off is far below any normal's noise."""
    name: str
    frame: str = "map"
    sha256: str = ""
    """Hex digest of the file's bytes; empty for a cloud that was never saved."""

    def __post_init__(self) -> None:
        for name, kind in (("points", np.float64), ("normals", np.float32)):
            array = np.array(getattr(self, name), dtype=kind)
            if array.ndim != 2 or array.shape[1] != 3:
                raise CloudError(f"cloud {name} must have shape (N, 3), got {array.shape}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if len(self.points) != len(self.normals):
            raise CloudError(f"cloud has {len(self.points)} points but {len(self.normals)} normals")

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest coordinates, (3,) each [m]."""
        return self.points.min(axis=0), self.points.max(axis=0)


def load_cloud(
    path: str | Path, *, inside: npt.ArrayLike | None = None, cache: Path | None = None
) -> Cloud:
    """Read a cloud from a PLY, a PCD, or a text with lines x y z.

    Where it has no normals they are made: each point's from its neighbours, turned to where it can be seen
    from. That is the drive by which it was mapped, if a TUM file of the same name lies beside it; else
    wherever somebody could stand on its floor.

    Args:
        path: of the file.
        inside: a place in the open (3,) [m], for a cloud without normals, without a drive and without a
            floor.
        cache: folder for clouds whose normals had to be made, which takes seconds; None keeps no file.

    Raises:
        CloudError: if the file is missing, damaged, or of no kind that is known; if it holds coordinates
            that cannot be a place in metres; or if it has no normals and nobody could see it.
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
        # Derived from all of these; the reader of a cache must not mistake one for another.
        from localization.maps.cloud_normals import with_normals

        return with_normals(path, table.points, sha256, inside=inside, cache=cache)
    normals = table.normals / _lengths(table.normals)[:, None]
    return Cloud(
        table.points,
        normals,
        name=table.notes.get("name", path.stem),
        frame=table.notes.get("frame", "map"),
        sha256=sha256,
    )


def load_map(
    path: str | Path, *, inside: npt.ArrayLike | None = None, cache: Path | None = None
) -> Cloud:
    """Read a map of either kind: a cloud, or a ROS occupancy grid by its ``map.yaml``.

    Args:
        path: of the file.
        inside: see ``load_cloud``.
        cache: see ``load_cloud``.

    Raises:
        CloudError: if it cannot be read, or cannot serve as a map.
    """
    if Path(path).suffix in (".yaml", ".yml"):
        # Grids need libraries for images and YAML, and are built on clouds.
        from localization.maps.occupancy_grid import load_grid

        return load_grid(path)
    return load_cloud(path, inside=inside, cache=cache)


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def _check(points: FloatArray, normals: FloatArray | None, path: Path) -> None:
    if len(points) == 0:
        raise CloudError(f"cloud {path} is empty")
    finite = np.isfinite(points).all() and (normals is None or np.isfinite(normals).all())
    if not finite:
        told = points if normals is None else np.hstack([points, normals])
        bad = int((~np.isfinite(told)).any(axis=1).sum())
        raise CloudError(f"cloud {path} has {bad} points that are not finite; leave them out")
    if normals is not None and (np.abs(_lengths(normals) - 1.0) > 0.1).any():
        raise CloudError(
            f"cloud {path} has normals that are not of unit length; leave all of them out, and they are made"
        )
    extent = float(np.ptp(points, axis=0).max())
    if extent > _LARGEST_EXTENT:
        raise CloudError(
            f"cloud {path} spans {extent:.0f} m; coordinates must be metres (is it in millimetres?)"
        )
    # What is large and yet thin was not measured in metres: a room of 4 m is 4000 mm.
    if extent > _LARGE and len(points) < 2 * len(np.unique(np.floor(points), axis=0)):
        raise CloudError(
            f"cloud {path} spans {extent:.0f} m with its points a metre apart; coordinates must be metres"
            " (is it in millimetres?)"
        )


def save_cloud(cloud: Cloud, path: str | Path) -> Cloud:
    """Write a cloud as PLY and return it as it now stands in the file, with its hash."""
    dtype = [(c, "<f4") for c in _COLUMNS]
    table: npt.NDArray[np.void] = np.empty(len(cloud.points), dtype=dtype)
    for i, c in enumerate(_COLUMNS):
        table[c] = (cloud.points if i < 3 else cloud.normals)[:, i % 3]
    comments = [f"name {cloud.name}", f"frame {cloud.frame}", "origin 0 0 0", "unit metre"]
    element = PlyElement.describe(table, "vertex")
    PlyData([element], text=False, byte_order="<", comments=comments).write(str(path))
    return load_cloud(path)
