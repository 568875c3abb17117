"""Points and normals as a file holds them."""

from __future__ import annotations

from dataclasses import dataclass, field

from localization.geometry import FloatArray

POINT_FIELDS = ("x", "y", "z")
"""Names of a point's coordinates in PLY and PCD files."""


@dataclass(frozen=True, slots=True, eq=False)
class PointTable:
    """Content of a file of points."""

    points: FloatArray
    """Coordinates (N, 3) in the file's unit, which should be metres."""
    normals: FloatArray | None
    """Normals (N, 3), or None if the file has none."""
    comments: dict[str, str] = field(default_factory=dict)
    """The file's comments by their first words."""


def normals_or_none(normals: FloatArray | None) -> FloatArray | None:
    """Return normals (N, 3), or None if all are zero, which marks normals that were never computed."""
    return None if normals is None or not normals.any() else normals
