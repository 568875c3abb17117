"""Drawing of what the robot's camera sees: its frustum in the map, the picture in it, depth, and how old both are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from localization.display.colours import WHITE
from localization.display.entity_paths import BASE
from localization.display.rerun_sink import Canvas
from localization.types import SECOND
from teleop.operator.message_decoding import Message

PICTURE: Final = f"{BASE}/camera_rgb_optical_frame"
"""The picture, in the frame in which ``/tf_static`` places the camera."""
DEPTH: Final = "camera/depth"
"""Depth as a picture; as points it would cover the map."""

_FRUSTUM: Final = 0.4
"""Distance from the camera at which its picture is drawn in the map [m]."""
_FARTHEST: Final = 10.0
"""Depth at the end of the colours [m]."""


class CameraDrawing:
    """Draws the camera's messages; until its calibration comes, there is nothing to see."""

    def __init__(self, canvas: Canvas, show: Callable[[], None]) -> None:
        """Draw nothing yet.

        Args:
            canvas: Where to draw.
            show: Called when the camera's calibration comes first, to make room for its pictures.
        """
        self._canvas, self._show = canvas, show
        self._calibration: tuple[Any, ...] | None = None
        self._newest: dict[str, int] = {}
        self._ages: dict[str, str] = {}

    def info(self, message: Message, stamp: int) -> None:
        """Take the calibration, which places the picture in the map."""
        k = np.asarray(message["k"], dtype=float).reshape(3, 3)
        width, height = int(message["width"]), int(message["height"])
        calibration = (width, height, *k.ravel())
        if calibration == self._calibration:
            return
        if self._calibration is None:
            self._show()
        self._calibration = calibration
        self._canvas.draw(
            PICTURE,
            rr.Pinhole(
                image_from_camera=k,
                resolution=[width, height],
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=_FRUSTUM,
            ),
            static=True,
        )

    def picture(self, message: Message, stamp: int) -> None:
        """Draw a picture."""
        self._canvas.draw(
            f"{PICTURE}/image",
            rr.EncodedImage(contents=bytes(message["data"]), media_type="image/jpeg"),
        )
        self._newest[PICTURE] = stamp

    def depth(self, message: Message, stamp: int) -> None:
        """Draw depth, from blue near to red far."""
        self._canvas.draw(
            f"{DEPTH}/image",
            rr.EncodedDepthImage(
                blob=bytes(message["data"]),
                media_type="image/png",
                meter=1000.0,
                depth_range=[0.0, 1000.0 * _FARTHEST],
            ),
        )
        self._newest[DEPTH] = stamp

    def age(self, now: int) -> None:
        """Write into both pictures how old they are at a robot time [ns]."""
        for entity, stamp in self._newest.items():
            text = f"{max(now - stamp, 0) / SECOND:.1f} s old"
            if self._ages.get(entity) != text:
                self._ages[entity] = text
                label = rr.Points2D(
                    [[60.0, 20.0]], labels=[text], colors=[WHITE], radii=rr.Radius.ui_points(0.5)
                )
                self._canvas.draw(f"{entity}/age", label)


def camera_views() -> rrb.Vertical:
    """Return the views of the picture and of depth."""
    return rrb.Vertical(
        rrb.Spatial2DView(origin=PICTURE, name="Camera"),
        rrb.Spatial2DView(origin=DEPTH, name="Depth"),
    )
