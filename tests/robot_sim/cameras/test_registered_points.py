from __future__ import annotations

import numpy as np
import pytest

from robot_sim.cameras import CAMERAS, CameraFrame, points
from robot_sim.cameras.registered_points import POINT_BYTES, stride

KINECT = CAMERAS["kinect"]


def frame(depth: float = 2.0) -> CameraFrame:
    rgb = np.zeros((480, 640, 3), np.uint8)
    rgb[:] = (200, 100, 50)
    return CameraFrame(7, rgb, np.full((480, 640), depth, np.float32))


def test_every_point_projects_to_the_pixel_it_came_from() -> None:
    cloud, _ = points(frame(), KINECT, limit_bytes=640 * 480 * POINT_BYTES)
    (fx, fy), (cx, cy) = KINECT.focal_lengths, KINECT.principal_point
    v, u = np.mgrid[0:480, 0:640]

    np.testing.assert_allclose(fx * cloud[:, 0] / cloud[:, 2] + cx, u.ravel(), atol=1e-3)
    np.testing.assert_allclose(fy * cloud[:, 1] / cloud[:, 2] + cy, v.ravel(), atol=1e-3)
    np.testing.assert_array_equal(cloud[:, 2], 2.0)


def test_a_cloud_is_thinned_evenly_to_a_megabyte() -> None:
    cloud, colours = points(frame(), KINECT)

    assert 0.25e6 < len(cloud) * POINT_BYTES <= 1e6
    assert len(colours) == len(cloud)
    assert cloud.dtype == colours.dtype == np.float32
    for axis in (0, 1):
        gaps = np.diff(np.unique(np.round(cloud[:, axis], 5)))
        assert gaps.max() == pytest.approx(gaps.min(), rel=0.01)


@pytest.mark.parametrize("size", [(640, 480), (1280, 720), (320, 240), (17, 4096)])
@pytest.mark.parametrize("limit", [16, 1000, 1_000_000, 10**9])
def test_the_stride_is_the_least_that_fits(size: tuple[int, int], limit: int) -> None:
    def fits(step: int) -> bool:
        columns, rows = (-(-side // step) for side in size)
        return columns * rows * POINT_BYTES <= limit

    step = stride(*size, limit)

    assert fits(step)
    assert step == 1 or not fits(step - 1)


def test_colours_are_packed_as_point_clouds_have_them() -> None:
    _, colours = points(frame(), KINECT)

    assert hex(int(colours.view(np.uint32)[0])) == "0xc86432"


def test_pixels_without_depth_make_no_points() -> None:
    seen = frame()
    seen.depth[:, 320:] = np.nan
    cloud, _ = points(seen, KINECT)

    assert (cloud[:, 0] < 0.0).all()
    assert len(points(frame(np.nan), KINECT)[0]) == 0
    with pytest.raises(ValueError, match="limit_bytes must be at least 16, got 3"):
        points(seen, KINECT, limit_bytes=3)
