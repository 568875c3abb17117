"""A camera's frame in the formats that viewers want, each encoded once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, replace
from io import BytesIO
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from PIL import Image

from robot_sim.cameras import CameraFrame, CameraModel, points
from robot_sim.robot.camera_mount import DEPTH_FRAME, RGB_FRAME
from teleop.pictures.picture import Picture, PictureFormat

DEFAULT_QUALITY: Final = 80
"""Quality of a JPEG unless a viewer asks for another: that of ROS's ``compressed_image_transport``."""

MOST_POINT_BYTES: Final = 1_000_000
"""Largest size of the points of a frame [bytes]."""

_PNG_LEVEL: Final = 1
"""zlib level of PNG files: higher ones take several times as long."""

_DARKEST: Final = 32
"""Grey of the farthest measured depth; 0 is left for what was not measured."""


def is_depth(wanted: PictureFormat) -> bool:
    """Return whether a format shows depth."""
    return wanted.topic.startswith("/camera/depth/")


def pictures_of(
    frame: CameraFrame, camera: CameraModel, wanted: Iterable[PictureFormat]
) -> list[Picture]:
    """Return a frame in the wanted formats, in an order that depends on nothing but them.

    Formats that differ in nothing but the name of the topic share their bytes. Sizes above the camera's own are
    reduced to it. A format that does not exist, such as raw colours of depth, gives no picture.
    """
    encoder = _Encoder(frame, camera)
    found = (encoder.picture(each) for each in sorted(wanted, key=astuple))
    return [picture for picture in found if picture is not None]


class _Encoder:
    """Encodes one frame, and remembers what it has encoded."""

    def __init__(self, frame: CameraFrame, camera: CameraModel) -> None:
        self._frame, self._camera = frame, camera
        self._encoded: dict[tuple[bool, PictureFormat], tuple[int, int, bytes] | None] = {}

    def picture(self, wanted: PictureFormat) -> Picture | None:
        """Return the frame in one format."""
        depth = is_depth(wanted)
        width = min(wanted.width or self._camera.width, self._camera.width)
        height = min(wanted.height or self._camera.height, self._camera.height)
        quality = wanted.quality if wanted.encoding == "jpeg" else 0
        plain = replace(wanted, topic="", width=width, height=height, quality=quality)
        key = depth, plain
        if key not in self._encoded:
            self._encoded[key] = self._encode(plain, depth=depth)
        encoded = self._encoded[key]
        if encoded is None:
            return None
        name = DEPTH_FRAME if depth else RGB_FRAME
        return Picture(wanted, self._frame.stamp, name, *encoded)

    def _encode(self, wanted: PictureFormat, *, depth: bool) -> tuple[int, int, bytes] | None:
        size = wanted.width, wanted.height
        match wanted.encoding, depth:
            case "points", True:
                return self._points()
            case "16UC1", True:
                return *size, np.asarray(self._depth(size), "<u2").tobytes()
            case "rgb8", False:
                return *size, self._colours(size).tobytes()
            case "jpeg", _:
                image = self._grey(size) if depth else self._colours(size)
                if wanted.inverted:
                    image = image.transpose(Image.Transpose.ROTATE_180)
                quality = wanted.quality or DEFAULT_QUALITY
                return *size, _file(image, "JPEG", quality=quality)
            case "png", _:
                image = Image.fromarray(self._depth(size)) if depth else self._colours(size)
                return *size, _file(image, "PNG", compress_level=_PNG_LEVEL)
            case _:
                return None

    def _points(self) -> tuple[int, int, bytes]:
        places, colours = points(self._frame, self._camera, limit_bytes=MOST_POINT_BYTES)
        return len(places), 1, np.column_stack([places, colours]).astype("<f4").tobytes()

    def _colours(self, size: tuple[int, int]) -> Image.Image:
        image = Image.fromarray(self._frame.rgb)
        if size == image.size:
            return image
        return image.resize(size, Image.Resampling.BILINEAR, reducing_gap=2.0)

    def _depth(self, size: tuple[int, int]) -> npt.NDArray[np.uint16]:
        """Return depth in millimetres; of a smaller image each pixel is one of the camera's, never a mixture."""
        millimetres = self._frame.depth_mm
        rows, columns = millimetres.shape
        width, height = size
        if (columns, rows) == size:
            return millimetres
        row = (np.arange(height) * 2 + 1) * rows // (2 * height)
        column = (np.arange(width) * 2 + 1) * columns // (2 * width)
        return np.ascontiguousarray(millimetres[row[:, None], column])

    def _grey(self, size: tuple[int, int]) -> Image.Image:
        """Return depth for eyes: white at the nearest measured depth, dark grey at the farthest, else black."""
        near, far = self._camera.near * 1e3, self._camera.far * 1e3
        millimetres = self._depth(size)
        share = (millimetres - np.float32(near)) / np.float32(far - near)
        grey = 255.0 - (255.0 - _DARKEST) * np.clip(share, 0.0, 1.0)
        return Image.fromarray(np.where(millimetres == 0, 0, np.rint(grey)).astype(np.uint8))


def _file(image: Image.Image, kind: str, **options: Any) -> bytes:
    file = BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()
