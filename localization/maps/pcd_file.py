"""Reader of PCD files, the format of the Point Cloud Library.

No base dependency reads PCD, and Open3D, which does, is an extra of several hundred megabytes. The header is
a few lines of text and the data a plain table, so both are read here; only compressed data needs Open3D.
Format: https://pointclouds.org/documentation/tutorials/pcd_file_format.html
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt

from localization.extras import install_command
from localization.geometry import FloatArray
from localization.maps.cloud import CloudError
from localization.maps.open3d_import import import_open3d
from localization.maps.point_table import POINT_FIELDS, PointTable, normals_or_none

_NORMAL_FIELDS = ("normal_x", "normal_y", "normal_z")
_KINDS = {"F": "f", "I": "i", "U": "u"}
LONGEST_HEADER = 4096
"""Length of a header at most [bytes]."""


def read_pcd(path: Path, raw: bytes) -> PointTable:
    """Read a PCD file: ascii, binary, or by Open3D binary_compressed.

    Args:
        path: File to read.
        raw: Bytes of the file.

    Raises:
        CloudError: If it lacks coordinates or points, or is compressed and Open3D is missing.
        ValueError: If the header or the data is damaged; also KeyError and IndexError.
    """
    header: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in header:
        end = raw.index(b"\n", at, at + LONGEST_HEADER)
        words = raw[at:end].decode("ascii").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            header[words[0]] = words[1:]
    count = int(header["POINTS"][0])
    names = header["FIELDS"]
    counts = [int(c) for c in header.get("COUNT", ["1"] * len(names))]
    kind = header["DATA"][0]
    if missing := [c for c in POINT_FIELDS if c not in names]:
        raise CloudError(f"cloud {path} lacks the fields {' '.join(missing)}")
    table: dict[str, npt.NDArray[np.generic]]
    if kind == "binary_compressed":
        table = _by_open3d(path)
    elif kind == "ascii":
        columns = np.cumsum([0, *counts])
        rows = np.loadtxt(io.BytesIO(raw[at:]), ndmin=2)
        table = {name: rows[:, c] for name, c in zip(names, columns, strict=False)}
    else:
        formats = [
            (f"<{_KINDS[t]}{size}", c)
            for t, size, c in zip(header["TYPE"], header["SIZE"], counts, strict=True)
        ]
        # Padding fields share the name "_".
        unique = [n if n != "_" else f"_{i}" for i, n in enumerate(names)]
        records = np.frombuffer(
            raw, np.dtype([(n, f, c) for n, (f, c) in zip(unique, formats, strict=True)]), count, at
        )
        table = {name: records[name].reshape(count, -1)[:, 0] for name in unique}
    if len(table["x"]) != count:
        raise CloudError(f"cloud {path} is cut short: {len(table['x'])} of {count} points")
    points = np.stack([np.asarray(table[c], dtype=float) for c in POINT_FIELDS], axis=1)
    # Images of scanners hold points that are not finite where no echo came back.
    seen = np.isfinite(points).all(axis=1)
    normals = None
    if set(names).issuperset(_NORMAL_FIELDS):
        normals = np.stack([np.asarray(table[c], dtype=float) for c in _NORMAL_FIELDS], axis=1)[
            seen
        ]
    return PointTable(points[seen], normals_or_none(normals))


def _by_open3d(path: Path) -> dict[str, npt.NDArray[np.generic]]:
    """Return coordinates and normals by field; the normals are zeros if the file has none."""
    try:
        # Without a format the name would decide.
        cloud = import_open3d().io.read_point_cloud(str(path), format="pcd")
    except ImportError as error:
        raise CloudError(
            f"cloud {path} is compressed: save it as binary or ascii, or install Open3D: "
            f"{install_command('map')}"
        ) from error
    points: FloatArray = np.array(cloud.points)
    normals = np.array(cloud.normals) if cloud.has_normals() else np.zeros_like(points)
    columns = np.hstack([points, normals]).T
    return dict(zip((*POINT_FIELDS, *_NORMAL_FIELDS), columns, strict=True))
