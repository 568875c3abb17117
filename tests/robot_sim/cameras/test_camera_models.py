from __future__ import annotations

import math
from dataclasses import replace

import pytest

from robot_sim.cameras import CAMERAS, CameraModel, camera_named
from robot_sim.errors import CameraError

KINECT = CAMERAS["kinect"]


def test_the_edges_of_the_image_lie_at_half_the_field_of_view() -> None:
    for model in CAMERAS.values():
        fx, _, cx, _, fy, cy, *_ = model.k
        # A pixel reaches half a pixel beyond its centre.
        left, right = math.atan((cx + 0.5) / fx), math.atan((model.width - 0.5 - cx) / fx)
        up, down = math.atan((cy + 0.5) / fy), math.atan((model.height - 0.5 - cy) / fy)
        assert left + right == pytest.approx(model.horizontal_fov)
        assert up + down == pytest.approx(model.vertical_fov)
        assert left == pytest.approx(right)
        assert up == pytest.approx(down)


def test_the_kinect_has_the_focal_lengths_of_57_and_43_degrees() -> None:
    fx, fy = KINECT.focal_lengths

    assert (KINECT.width, KINECT.height) == (640, 480)
    assert fx == pytest.approx(320.0 / math.tan(math.radians(28.5)))
    assert fy == pytest.approx(240.0 / math.tan(math.radians(21.5)))
    assert KINECT.principal_point == (319.5, 239.5)
    assert KINECT.rate == 15.0
    assert KINECT.period_ns == 66_666_667


def test_the_chosen_cameras_have_square_pixels() -> None:
    for name in ("wide", "small", "arm"):
        fx, fy = CAMERAS[name].focal_lengths
        assert fx == pytest.approx(fy)


def test_the_camera_info_describes_a_rectified_image_without_distortion() -> None:
    assert KINECT.d == (0.0,) * 5
    assert KINECT.r == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    assert len(KINECT.p) == 12
    assert [KINECT.p[i] for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)] == list(KINECT.k)
    assert KINECT.p[3] == KINECT.p[7] == KINECT.p[11] == 0.0


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"width": 8}, "width must be 16 to 4096 pixels, got 8"),
        ({"height": 5000}, "height must be 16 to 4096 pixels, got 5000"),
        ({"horizontal_fov": 3.0}, "horizontal_fov must be 0.01 to 2.8 rad, got 3"),
        ({"vertical_fov": math.nan}, "vertical_fov must be 0.01 to 2.8 rad, got nan"),
        ({"rate": 0.0}, "rate must be 0.1 to 60 Hz, got 0"),
        ({"near": 4.0, "far": 2.0}, "near must be below far, got 4 and 2 m"),
        ({"depth_step": -1.0}, "depth_step must be 0 to 0.1 1/m, got -1"),
        ({"aside": 2.0}, "aside must be -1 to 1 m, got 2"),
        ({"down": math.inf}, "down must be -1.5708 to 1.5708 rad, got inf"),
        ({"turned": 4.0}, "turned must be -3.14159 to 3.14159 rad, got 4"),
    ],
)
def test_numbers_out_of_range_are_named(change: dict[str, float], says: str) -> None:
    with pytest.raises(CameraError, match=says):
        replace(KINECT, **change)  # type: ignore[arg-type]


def test_an_unknown_camera_is_answered_with_those_there_are() -> None:
    with pytest.raises(
        CameraError, match="no camera named 'kinekt'; available: kinect, wide, small, arm"
    ):
        camera_named("kinekt")
    assert camera_named("kinect") is KINECT
    assert CameraModel("other", width=100, height=50).principal_point == (49.5, 24.5)
