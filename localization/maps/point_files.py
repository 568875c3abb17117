"""Files that hold points: PLY, PCD and plain text, whoever wrote them.

PCD has no library that is both small and well kept: its header is a handful of lines of text, which are read
here; what it compresses is left to Open3D.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
from plyfile import PlyData, PlyParseError

from localization.geometry import FloatArray

_POINT = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_PCD_NORMAL = ("normal_x", "normal_y", "normal_z")
_PCD_KINDS = {"F": "f", "I": "i", "U": "u"}
_LONGEST_HEADER = 4096
"""Of a PCD file [bytes]."""


class CloudError(ValueError):
    """A cloud that cannot serve as a map; the message says why and what would."""


@dataclass(frozen=True, slots=True, eq=False)
class PointTable:
    """What a file holds."""

    points: FloatArray
    """(N, 3)."""
    normals: FloatArray | None
    """(N, 3), if it has some."""
    notes: dict[str, str] = field(default_factory=dict)
    """Its comments, by their first words."""


def read_points(path: Path, raw: bytes) -> PointTable:
    """Read a file of points; what is in it decides how, not its name.

    Args:
        path: of the file.
        raw: its bytes.

    Raises:
        CloudError: if it is of no kind that is known, or damaged.
    """
    try:
        if raw.startswith(b"ply"):
            return _read_ply(path)
        if b"\nFIELDS" in raw[:_LONGEST_HEADER] or raw.startswith(b"FIELDS"):
            return _read_pcd(path, raw)
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
    if missing := [c for c in _POINT if c not in names]:
        raise CloudError(f"cloud {path} lacks the vertex properties {' '.join(missing)}")
    points = np.stack([np.asarray(vertex[c], dtype=float) for c in _POINT], axis=1)
    normals = None
    if names.issuperset(_NORMAL):
        normals = np.stack([np.asarray(vertex[c], dtype=float) for c in _NORMAL], axis=1)
    notes = dict(c.split(" ", 1) for c in ply.comments if " " in c)
    return PointTable(points, _told(normals), notes)


def _read_pcd(path: Path, raw: bytes) -> PointTable:
    header: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in header:
        end = raw.index(b"\n", at, at + _LONGEST_HEADER)
        words = raw[at:end].decode("ascii").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            header[words[0]] = words[1:]
    count = int(header["POINTS"][0])
    names = header["FIELDS"]
    counts = [int(c) for c in header.get("COUNT", ["1"] * len(names))]
    kind = header["DATA"][0]
    if missing := [c for c in _POINT if c not in names]:
        raise CloudError(f"cloud {path} lacks the fields {' '.join(missing)}")
    if kind == "binary_compressed":
        return PointTable(_by_open3d(path), None)
    table: dict[str, npt.NDArray[np.generic]]
    if kind == "ascii":
        columns = np.cumsum([0, *counts])
        rows = np.loadtxt(io.BytesIO(raw[at:]), ndmin=2)
        table = {name: rows[:, c] for name, c in zip(names, columns, strict=False)}
    else:
        formats = [
            (f"<{_PCD_KINDS[t]}{size}", c)
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
    points = np.stack([np.asarray(table[c], dtype=float) for c in _POINT], axis=1)
    # Scanners' images have points in no place where nothing came back.
    seen = np.isfinite(points).all(axis=1)
    normals = None
    if set(names).issuperset(_PCD_NORMAL):
        normals = np.stack([np.asarray(table[c], dtype=float) for c in _PCD_NORMAL], axis=1)[seen]
    return PointTable(points[seen], _told(normals))


def _by_open3d(path: Path) -> FloatArray:
    from localization.mapping.cloud_builder import import_open3d

    try:
        cloud = import_open3d().io.read_point_cloud(str(path))
    except ImportError as error:
        raise CloudError(
            f"cloud {path} is compressed: save it as binary or ascii, or pip install 'farsteer[map]'"
        ) from error
    points: FloatArray = np.array(cloud.points)
    return points


def _read_text(path: Path, raw: bytes) -> PointTable:
    lines = raw.split(b"\n", 1)
    try:
        first = lines[0].decode("ascii").split()
    except UnicodeDecodeError:
        first = []
    # A .pts file begins with the number of its points.
    body = lines[1] if len(first) == 1 and len(lines) == 2 else raw
    if not body.strip():
        return PointTable(np.zeros((0, 3)), None)
    try:
        comma = b"," in body[:_LONGEST_HEADER]
        rows = np.loadtxt(io.BytesIO(body), delimiter="," if comma else None, ndmin=2)
        if rows.size and rows.shape[1] < 3:
            raise ValueError("lines want x y z at least")
    except (ValueError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())
        raise CloudError(
            f"{path} is no cloud: PLY, PCD and texts with lines x y z are read ({reason})"
        ) from None
    points = rows[:, :3] if rows.size else np.zeros((0, 3))
    # Six columns may as well be colours.
    normals = rows[:, 3:6] if rows.size and rows.shape[1] == 6 else None
    if normals is not None and (np.abs(np.linalg.norm(normals, axis=1) - 1.0) > 0.01).any():
        normals = None
    return PointTable(points, normals)


def _told(normals: FloatArray | None) -> FloatArray | None:
    """Normals that are all zero were never computed."""
    return None if normals is None or not normals.any() else normals
