"""Reader of point files: PLY, PCD and plain text.

The text may be an XYZ file or a PTS file, parted by blanks or commas.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyParseError

from localization.maps.cloud import CloudError
from localization.maps.pcd_file import LONGEST_HEADER, read_pcd
from localization.maps.point_table import POINT_FIELDS, PointTable, normals_or_none

_NORMAL = ("nx", "ny", "nz")


def read_points(path: Path, raw: bytes) -> PointTable:
    """Read a file of points; its content decides the format, not its name.

    Args:
        path: File to read.
        raw: Bytes of the file.

    Raises:
        CloudError: If the file is of an unknown format, or damaged.
    """
    try:
        if raw.startswith(b"ply"):
            return _read_ply(path)
        if b"\nFIELDS" in raw[:LONGEST_HEADER] or raw.startswith(b"FIELDS"):
            return read_pcd(path, raw)
        return _read_text(path, raw)
    except (PlyParseError, KeyError, ValueError, EOFError, IndexError, UnicodeDecodeError) as error:
        if isinstance(error, CloudError):
            raise
        raise CloudError(f"cloud {path} is damaged: {error}") from None


def _read_ply(path: Path) -> PointTable:
    # From the file, not from bytes: plyfile maps files, but reads streams number by number.
    ply = PlyData.read(str(path))
    vertex = ply["vertex"]
    names = {p.name for p in vertex.properties}
    if missing := [c for c in POINT_FIELDS if c not in names]:
        raise CloudError(f"cloud {path} lacks the vertex properties {' '.join(missing)}")
    points = np.stack([np.asarray(vertex[c], dtype=float) for c in POINT_FIELDS], axis=1)
    normals = None
    if names.issuperset(_NORMAL):
        normals = np.stack([np.asarray(vertex[c], dtype=float) for c in _NORMAL], axis=1)
    comments = dict(c.split(" ", 1) for c in ply.comments if " " in c)
    return PointTable(points, normals_or_none(normals), comments)


def _read_text(path: Path, raw: bytes) -> PointTable:
    first, _, rest = raw.partition(b"\n")
    words = first.replace(b",", b" ").split()
    # The first line of a .pts file is the number of its points, that of a table often its columns' names.
    body = rest if rest and (len(words) == 1 or not any(map(_is_number, words))) else raw
    if not body.strip():
        return PointTable(np.zeros((0, 3)), None)
    try:
        comma = b"," in body[:LONGEST_HEADER]
        rows = np.loadtxt(io.BytesIO(body), delimiter="," if comma else None, ndmin=2)
        if rows.size and rows.shape[1] < 3:
            raise ValueError("lines need x y z at least")
    except (ValueError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())
        raise CloudError(
            f"{path} is not a cloud; PLY, PCD and texts with lines x y z can be read ({reason})"
        ) from None
    points = rows[:, :3] if rows.size else np.zeros((0, 3))
    # Columns 4 to 6 may hold colours instead of normals.
    normals = rows[:, 3:6] if rows.size and rows.shape[1] == 6 else None
    if normals is not None and (np.abs(np.linalg.norm(normals, axis=1) - 1.0) > 0.01).any():
        normals = None
    return PointTable(points, normals)


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
