"""What is stored beside a photograph: in its own file (EXIF), and as JSON next to it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any, Final

from PIL import ExifTags, Image

_MARKER: Final = b"\xff\xd8"
"""First bytes of a JPEG (SOI)."""

_APP1: Final = b"\xff\xe1"
"""Marker of the segment that holds EXIF data."""

_UNICODE: Final = b"ASCII\x00\x00\x00"
"""Character code at the beginning of ``UserComment`` (EXIF 2.32, 4.6.5)."""


@dataclass(frozen=True, slots=True)
class PhotoPose:
    """Where the robot was."""

    stamp: int
    """Robot time of the estimate [ns]."""
    position: tuple[float, float, float]
    """Position of ``base_link`` in ``map``: x, y, z [m]."""
    orientation: tuple[float, float, float, float]
    """Orientation of ``base_link`` in ``map``: x, y, z, w."""
    covariance: tuple[float, ...]
    """Covariance of x, y, z [m] and rotation about x, y, z [rad], 36 numbers by rows, as in ROS."""
    health: str
    """State of the localiser."""


@dataclass(frozen=True, slots=True)
class PhotoRecord:
    """Everything that is known about a photograph."""

    stamp: int
    """Robot time at which the camera saw it [ns]."""
    taken_at: str
    """Date and time of the computer's clock, in UTC."""
    frame: str
    """Optical frame of the camera."""
    width: int
    """Width [pixels]."""
    height: int
    """Height [pixels]."""
    by: str
    """Client that took it."""
    pose: PhotoPose | None
    """Where the robot was; None before there was an estimate."""
    map_name: str
    """Name of the map in which the pose is."""
    map_sha256: str
    """Hash of the map's file."""

    def as_dict(self) -> dict[str, Any]:
        """Return the record as JSON values."""
        return asdict(self)

    def json(self) -> bytes:
        """Return the record as the content of a file."""
        return (json.dumps(self.as_dict(), indent=2) + "\n").encode()


def with_exif(jpeg: bytes, record: PhotoRecord) -> bytes:
    """Return a JPEG with its record in the EXIF data; the picture itself is not encoded again.

    Raises:
        ValueError: If it is no JPEG.
    """
    if not jpeg.startswith(_MARKER):
        raise ValueError("the picture is no JPEG")
    exif = Image.Exif()
    date, _, rest = record.taken_at.partition("T")
    moment = f"{date.replace('-', ':')} {rest[:8]}"
    exif[ExifTags.Base.Software] = "farsteer"
    exif[ExifTags.Base.DateTime] = moment
    exif[ExifTags.Base.ImageDescription] = _description(record)
    inner = exif.get_ifd(ExifTags.IFD.Exif)
    inner[ExifTags.Base.DateTimeOriginal] = moment
    inner[ExifTags.Base.OffsetTimeOriginal] = "+00:00"
    inner[ExifTags.Base.UserComment] = _UNICODE + json.dumps(record.as_dict()).encode()
    data = exif.tobytes()
    return _MARKER + _APP1 + (len(data) + 2).to_bytes(2, "big") + data + jpeg[len(_MARKER) :]


def _description(record: PhotoRecord) -> str:
    """Return a line for people."""
    if record.pose is None:
        return f"robot time {record.stamp / 1e9:.3f} s, no pose"
    x, y, _ = record.pose.position
    return f"robot time {record.stamp / 1e9:.3f} s, x {x:.3f} m, y {y:.3f} m in {record.map_name}"
