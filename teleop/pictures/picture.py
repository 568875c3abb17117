"""A picture of a camera, and the forms in which viewers ask for one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Encoding: TypeAlias = Literal["rgb8", "16UC1", "jpeg", "png", "points"]
"""Raw colours, raw depth in millimetres (0: nothing measured), either as a file, or both as coloured points."""


@dataclass(frozen=True, slots=True)
class PictureFormat:
    """What a viewer asks for; equal formats are encoded once."""

    topic: str
    """Topic of the raw image, such as ``/camera/rgb/image_raw``."""
    encoding: Encoding
    """Form of the bytes."""
    width: int = 0
    """Width [pixels]; 0 for the camera's own."""
    height: int = 0
    """Height [pixels]; 0 for the camera's own."""
    quality: int = 0
    """Quality of a JPEG, 1 to 100; 0 for the default."""
    inverted: bool = False
    """Whether a JPEG is turned by half a turn, for a camera that hangs upside down."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One frame in one format."""

    format: PictureFormat
    """What was asked for."""
    stamp: int
    """Robot time at which the camera saw it [ns]."""
    frame: str
    """Optical frame of the camera (REP 103)."""
    width: int
    """Width [pixels]."""
    height: int
    """Height [pixels]."""
    data: bytes
    """Rows from the top, without padding, or the bytes of the file; of points x, y, z and rgb of each, in one row."""
