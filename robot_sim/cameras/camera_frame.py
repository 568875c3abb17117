"""One frame of a camera, and its depth in the forms of ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True, eq=False)
class CameraFrame:
    """Colours and depth of one instant, pixel by pixel of the same rays."""

    stamp: int
    """Time since the start of the simulation [ns]."""
    rgb: npt.NDArray[np.uint8]
    """Colours, (height, width, 3), rows from the top: encoding ``rgb8``."""
    depth: npt.NDArray[np.float32]
    """Distance along the optical axis [m], (height, width); NaN where nothing is measured: encoding ``32FC1``."""

    @property
    def depth_mm(self) -> npt.NDArray[np.uint16]:
        """Depth in whole millimetres, 0 where nothing is measured: encoding ``16UC1`` (REP 118)."""
        millimetres = np.nan_to_num(self.depth * np.float32(1000.0) + np.float32(0.5), nan=0.0)
        whole: npt.NDArray[np.uint16] = np.minimum(millimetres, 65535.0).astype(np.uint16)
        return whole


def measured_depth(
    depth: npt.NDArray[np.float32], near: float, far: float, step: float
) -> npt.NDArray[np.float32]:
    """Return what a sensor measures of true depths.

    Args:
        depth: True depths [m], any shape.
        near: Least depth that is measured [m].
        far: Greatest depth that is measured [m].
        step: Step of the inverse depth [1/m] that a sensor resolves; 0 for no rounding.

    Returns:
        Rounded depths [m], NaN outside the range.
    """
    unseen = (depth < near) | (depth > far)
    if step > 0.0:
        scale = np.float32(step)
        steps = np.rint(1.0 / (np.maximum(depth, np.float32(0.01)) * scale))
        depth = (1.0 / (np.maximum(steps, np.float32(1.0)) * scale)).astype(np.float32)
    return np.where(unseen, np.float32(np.nan), depth)
