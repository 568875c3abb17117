"""Models of cameras: image size, field of view, rate, and what their depth image measures.

(M) marks figures quoted from memory of a data sheet, not checked against it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from localization.types import Pose
from robot_sim.errors import CameraError

_LARGEST: Final = 4096
"""Greatest width and height of an image [pixels]."""
_WIDEST: Final = 2.8
"""Greatest field of view [rad], 160 degrees: beyond it a flat image is nearly all margin."""
_FASTEST: Final = 60.0
"""Greatest rate [Hz]."""
_FARTHEST: Final = 100.0
"""Greatest depth [m]; in millimetres 16 bits hold 65.5 m."""


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A pinhole camera for colours and depth, both seen from one point, so that depth is registered.

    Raises:
        CameraError: A number is out of range; the message names it and the valid range.
    """

    name: str
    """Name of the model."""
    width: int = 640
    """Width of the image [pixels]."""
    height: int = 480
    """Height of the image [pixels]."""
    horizontal_fov: float = math.radians(57.0)
    """Angle from the left to the right edge of the image [rad]."""
    vertical_fov: float = math.radians(43.0)
    """Angle from the upper to the lower edge of the image [rad]."""
    rate: float = 15.0
    """Frames per second [Hz]."""
    near: float = 0.5
    """Least depth that is measured [m]."""
    far: float = 10.0
    """Greatest depth that is measured [m]."""
    depth_step: float = 0.0
    """Step of the inverse depth [1/m] to which a triangulating sensor rounds; 0 if depth is not rounded."""
    aside: float = 0.0
    """Distance to the left of the robot's usual place for a camera (``SkidSteer.camera_mount``) [m]."""
    down: float = 0.0
    """Angle by which it looks down [rad]."""
    turned: float = 0.0
    """Angle by which it looks to the left of straight ahead [rad]."""
    source: str = "chosen"
    """Source of the numbers."""

    def __post_init__(self) -> None:
        for key in ("width", "height"):
            value = getattr(self, key)
            if not (isinstance(value, int) and 16 <= value <= _LARGEST):
                raise CameraError(
                    f"camera {self.name!r}: {key} must be 16 to {_LARGEST} pixels, got {value}"
                )
        for key in ("horizontal_fov", "vertical_fov"):
            self._check(key, 0.01, _WIDEST, "rad")
        self._check("rate", 0.1, _FASTEST, "Hz")
        self._check("near", 0.05, _FARTHEST, "m")
        self._check("far", 0.1, _FARTHEST, "m")
        self._check("depth_step", 0.0, 0.1, "1/m")
        self._check("aside", -1.0, 1.0, "m")
        self._check("down", -0.5 * math.pi, 0.5 * math.pi, "rad")
        self._check("turned", -math.pi, math.pi, "rad")
        if not self.near < self.far:
            raise CameraError(
                f"camera {self.name!r}: near must be below far, got {self.near:g} and {self.far:g} m"
            )

    def _check(self, key: str, least: float, most: float, unit: str) -> None:
        value = getattr(self, key)
        if not (math.isfinite(value) and least <= value <= most):
            raise CameraError(
                f"camera {self.name!r}: {key} must be {least:g} to {most:g} {unit}, got {value:g}"
            )

    @property
    def place(self) -> Pose:
        """Where it is carried, from the robot's usual place for a camera."""
        return Pose.from_euler((0.0, self.aside, 0.0), pitch=self.down, yaw=self.turned)

    @property
    def period_ns(self) -> int:
        """Time between two frames [ns]."""
        return round(1e9 / self.rate)

    @property
    def focal_lengths(self) -> tuple[float, float]:
        """Focal lengths fx and fy [pixels]."""
        return (
            0.5 * self.width / math.tan(0.5 * self.horizontal_fov),
            0.5 * self.height / math.tan(0.5 * self.vertical_fov),
        )

    @property
    def principal_point(self) -> tuple[float, float]:
        """Where the optical axis meets the image [pixels]; the centre of the first pixel is at 0, 0."""
        return 0.5 * (self.width - 1), 0.5 * (self.height - 1)

    @property
    def k(self) -> tuple[float, ...]:
        """K of ``sensor_msgs/CameraInfo``: the intrinsic matrix by rows, 9 numbers."""
        (fx, fy), (cx, cy) = self.focal_lengths, self.principal_point
        return fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0

    @property
    def d(self) -> tuple[float, ...]:
        """D of ``sensor_msgs/CameraInfo`` for ``plumb_bob``: the image has no distortion."""
        return 0.0, 0.0, 0.0, 0.0, 0.0

    @property
    def r(self) -> tuple[float, ...]:
        """R of ``sensor_msgs/CameraInfo``: the image is rectified."""
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0

    @property
    def p(self) -> tuple[float, ...]:
        """P of ``sensor_msgs/CameraInfo``: the projection matrix by rows, 12 numbers."""
        (fx, fy), (cx, cy) = self.focal_lengths, self.principal_point
        return fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0


_KHOSHELHAM: Final = "Khoshelham and Oude Elberink, Sensors 12 (2012) 1437"
_TABLE: Final = (
    CameraModel(
        "kinect",
        depth_step=2.85e-3,
        source="57 x 43 degrees: Microsoft's data sheet (M); depth from 0.5 m (M) to the 10 m of libfreenect's"
        " FREENECT_DEPTH_MM_MAX_VALUE; step of the inverse depth: the"
        f" calibration of {_KHOSHELHAM}, which makes steps of 7 cm at 5 m",
    ),
    CameraModel(
        "wide",
        width=1280,
        height=720,
        horizontal_fov=math.radians(90.0),
        vertical_fov=2.0 * math.atan(math.tan(math.radians(45.0)) * 720 / 1280),
        near=0.3,
        far=10.0,
        source="chosen: a colour camera for driving, square pixels; its depth image is ideal",
    ),
    CameraModel(
        "small",
        width=320,
        height=240,
        horizontal_fov=math.radians(60.0),
        vertical_fov=2.0 * math.atan(math.tan(math.radians(30.0)) * 240 / 320),
        near=0.3,
        far=10.0,
        source="chosen: a quarter of the pixels for slow links, square pixels; its depth image is ideal",
    ),
    CameraModel(
        "arm",
        horizontal_fov=math.radians(66.0),
        vertical_fov=2.0 * math.atan(math.tan(math.radians(33.0)) * 480 / 640),
        near=0.15,
        far=4.0,
        aside=0.17,
        down=math.radians(45.0),
        turned=math.radians(-22.0),
        source="chosen: it looks down at what a gripper does before the front bumper, from the left, since straight"
        " from behind the arm hides it; square pixels; its depth image is ideal",
    ),
)

CAMERAS: Final[Mapping[str, CameraModel]] = MappingProxyType({m.name: m for m in _TABLE})
"""Cameras by name."""


def camera_named(name: str) -> CameraModel:
    """Return the camera of that name.

    Raises:
        CameraError: There is no such camera; the message lists the available ones.
    """
    if name not in CAMERAS:
        raise CameraError(f"no camera named {name!r}; available: {', '.join(CAMERAS)}")
    return CAMERAS[name]
