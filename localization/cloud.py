"""The prebuilt global cloud: load, check and save the PLY that robot and operator both hold.

The file is a binary little-endian PLY with ``x y z nx ny nz`` as float32 and its name, frame and origin
as comments; any point-cloud tool opens it. Its identity is the SHA-256 of its bytes.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from plyfile import PlyData, PlyElement, PlyParseError

from localization.geometry import FloatArray

_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")
_LARGEST_EXTENT = 5_000.0
"""[m]. A larger cloud is almost surely in millimetres or in geodetic coordinates."""


class CloudError(ValueError):
    """A cloud that cannot serve as a map; the message says why and what would."""


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """Points of a mapped place with unit normals that point to where the surface was seen from."""

    points: FloatArray
    """(N, 3) [m], in ``frame``."""
    normals: FloatArray
    """(N, 3), unit length."""
    name: str
    frame: str = "map"
    sha256: str = ""
    """Hex digest of the file's bytes; empty for a cloud that was never saved."""

    def __post_init__(self) -> None:
        for name in ("points", "normals"):
            array = np.array(getattr(self, name), dtype=float)
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


def load_cloud(path: str | Path) -> Cloud:
    """Read a cloud from a PLY file.

    Raises:
        CloudError: if the file is missing, damaged, not a PLY, has no normals, or holds coordinates
            that cannot be a place in metres.
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise CloudError(f"cannot read cloud {path}: {error.strerror}") from None
    if not raw.startswith(b"ply"):
        raise CloudError(f"{path} is not a PLY file (it does not start with 'ply')")
    try:
        # From the file, not from `raw`: plyfile maps files, but reads streams number by number.
        ply = PlyData.read(str(path))
        vertex = ply["vertex"]
    except (PlyParseError, KeyError, ValueError, EOFError, UnicodeDecodeError) as error:
        raise CloudError(f"cloud {path} is damaged: {error}") from None
    names = {p.name for p in vertex.properties}
    missing = [c for c in _COLUMNS if c not in names]
    if missing:
        raise CloudError(
            f"cloud {path} lacks the vertex properties {' '.join(missing)}: a map needs points "
            "with normals (x y z nx ny nz); `farsteer map` makes one"
        )
    table = np.stack([np.asarray(vertex[c], dtype=float) for c in _COLUMNS], axis=1)
    points, normals = table[:, :3], table[:, 3:]
    _check(points, normals, path)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    notes = dict(c.split(" ", 1) for c in ply.comments if " " in c)
    return Cloud(
        points,
        normals,
        name=notes.get("name", path.stem),
        frame=notes.get("frame", "map"),
        sha256=hashlib.sha256(raw).hexdigest(),
    )


def load_map(path: str | Path) -> Cloud:
    """Read a map of either kind: a cloud, or a ROS occupancy grid by its ``map.yaml``.

    Raises:
        CloudError: if it cannot be read, or cannot serve as a map.
    """
    if Path(path).suffix in (".yaml", ".yml"):
        # Grids need libraries for images and YAML, and are built on clouds.
        from localization.occupancy import load_grid

        return load_grid(path)
    return load_cloud(path)


def _check(points: FloatArray, normals: FloatArray, path: Path) -> None:
    if len(points) == 0:
        raise CloudError(f"cloud {path} is empty")
    bad = int((~np.isfinite(points) | ~np.isfinite(normals)).any(axis=1).sum())
    if bad:
        raise CloudError(f"cloud {path} has {bad} points that are not finite")
    if (np.abs(np.linalg.norm(normals, axis=1) - 1.0) > 0.1).any():
        raise CloudError(f"cloud {path} has normals that are not of unit length")
    extent = float(np.ptp(points, axis=0).max())
    if extent > _LARGEST_EXTENT:
        raise CloudError(
            f"cloud {path} spans {extent:.0f} m; coordinates must be metres (is it in millimetres?)"
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
