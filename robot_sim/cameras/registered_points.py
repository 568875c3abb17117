"""Points of a depth image with their colours, as ``sensor_msgs/PointCloud2`` has them."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from robot_sim.cameras.camera_frame import CameraFrame
from robot_sim.cameras.camera_models import CameraModel

POINT_BYTES: Final = 16
"""Bytes of one point: x, y, z and ``rgb``, four bytes each."""


def points(
    frame: CameraFrame, model: CameraModel, *, limit_bytes: int = 1_000_000
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Return the points that a frame measured, thinned evenly over the image so that they fit a message.

    Args:
        frame: The frame.
        model: The camera that took it.
        limit_bytes: Most bytes of all points together; every n-th pixel of every n-th row is taken, with the
            least n that keeps the whole image within it.

    Returns:
        Points (N, 3) [m] in the optical frame (z forward, x right, y down), row by row, and their colours (N,):
        0x00RRGGBB in the bits of a float32, which is the field ``rgb``.
    """
    height, width = frame.depth.shape
    step = stride(width, height, limit_bytes)
    # The taken pixels are centred, so that no edge is preferred.
    first_row, first_column = ((side - 1) % step // 2 for side in (height, width))
    rows, columns = slice(first_row, None, step), slice(first_column, None, step)
    depth = frame.depth[rows, columns]
    (fx, fy), (cx, cy) = model.focal_lengths, model.principal_point
    x = ((np.arange(width)[columns] - cx) / fx).astype(np.float32)
    y = ((np.arange(height)[rows] - cy) / fy).astype(np.float32)
    measured = np.isfinite(depth)
    cloud = np.stack([depth * x[None, :], depth * y[:, None], depth], axis=-1)[measured]
    colours = frame.rgb[rows, columns][measured].astype(np.uint32)
    packed = colours[:, 0] << 16 | colours[:, 1] << 8 | colours[:, 2]
    return cloud, packed.view(np.float32)


def stride(width: int, height: int, limit_bytes: int) -> int:
    """Return the least n for which every n-th pixel of every n-th row fits into ``limit_bytes``.

    Raises:
        ValueError: Not even one point fits.
    """
    if limit_bytes < POINT_BYTES:
        raise ValueError(f"limit_bytes must be at least {POINT_BYTES}, got {limit_bytes}")
    step = max(1, math.isqrt(width * height * POINT_BYTES // limit_bytes))
    while math.ceil(width / step) * math.ceil(height / step) * POINT_BYTES > limit_bytes:
        step += 1
    return step
