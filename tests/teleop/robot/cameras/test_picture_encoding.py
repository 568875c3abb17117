"""A frame in the formats that viewers want, read back by another program's eyes: Pillow and numpy."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from robot_sim.cameras import CameraFrame, CameraModel
from teleop.pictures.picture import Encoding, Picture, PictureFormat
from teleop.robot.cameras.picture_encoding import pictures_of

CAMERA = CameraModel("test", width=64, height=48, near=0.5, far=4.5)
COLOURS, DEPTH = "/camera/rgb/image_raw", "/camera/depth/image_raw"


@pytest.fixture(scope="module")
def frame() -> CameraFrame:
    """Return a smooth picture, of whose depth the first column was not measured."""
    y, x = np.mgrid[0:48, 0:64]
    rgb = np.stack([4 * x, 5 * y, 255 - 4 * x], axis=-1).astype(np.uint8)
    depth = (0.5 + 4.0 * x / 63).astype(np.float32)
    depth[:, 0] = np.nan
    return CameraFrame(80_000_000, rgb, depth)


def only(
    frame: CameraFrame,
    topic: str,
    encoding: Encoding,
    width: int = 0,
    height: int = 0,
    quality: int = 0,
) -> Picture:
    wanted = PictureFormat(topic, encoding, width, height, quality)
    (picture,) = pictures_of(frame, CAMERA, [wanted])
    return picture


def test_raw_colours_are_the_rows_of_the_frame(frame: CameraFrame) -> None:
    picture = only(frame, COLOURS, "rgb8")
    assert (picture.stamp, picture.frame) == (frame.stamp, "camera_rgb_optical_frame")
    shown = np.frombuffer(picture.data, np.uint8).reshape(picture.height, picture.width, 3)
    assert (shown == frame.rgb).all()


def test_jpeg_shows_the_frame_and_weighs_less_at_less_quality(frame: CameraFrame) -> None:
    fine, coarse = only(frame, COLOURS, "jpeg", 0, 0, 95), only(frame, COLOURS, "jpeg", 0, 0, 10)
    shown = np.asarray(Image.open(BytesIO(fine.data)), float)
    assert np.abs(shown - frame.rgb).mean() < 4.0
    assert len(coarse.data) < len(fine.data)


@pytest.mark.parametrize("topic", [COLOURS, DEPTH])
def test_inverted_pictures_are_turned_by_half_a_turn(frame: CameraFrame, topic: str) -> None:
    shown = []
    for inverted in (False, True):
        wanted = PictureFormat(topic, "jpeg", quality=100, inverted=inverted)
        (picture,) = pictures_of(frame, CAMERA, [wanted])
        shown.append(np.asarray(Image.open(BytesIO(picture.data)).convert("L"), float))
    assert np.abs(shown[0][::-1, ::-1] - shown[1]).mean() < 2.0
    assert np.abs(shown[0] - shown[1]).mean() > 20.0


@pytest.mark.parametrize(("asked", "got"), [((32, 24), (32, 24)), ((9999, 24), (64, 24))])
def test_sizes_are_as_asked_and_never_above_the_camera_s_own(
    frame: CameraFrame, asked: tuple[int, int], got: tuple[int, int]
) -> None:
    picture = only(frame, COLOURS, "jpeg", *asked)
    assert (picture.width, picture.height) == Image.open(BytesIO(picture.data)).size == got


def test_depth_is_whole_millimetres_and_zero_where_nothing_was_measured(frame: CameraFrame) -> None:
    raw = only(frame, DEPTH, "16UC1")
    millimetres = np.frombuffer(raw.data, "<u2").reshape(48, 64)
    assert (millimetres[:, 0] == 0).all()
    assert np.abs(millimetres[:, 1:] * 1e-3 - frame.depth[:, 1:]).max() < 5.1e-4
    file = only(frame, DEPTH, "png")
    assert (np.asarray(Image.open(BytesIO(file.data))) == millimetres).all()
    assert raw.frame == file.frame == "camera_depth_optical_frame"


def test_pixels_of_smaller_depth_images_are_pixels_of_the_camera(frame: CameraFrame) -> None:
    small = np.frombuffer(only(frame, DEPTH, "16UC1", 7, 5).data, "<u2")
    assert small.shape == (35,)
    assert set(small.tolist()) <= set(frame.depth_mm.ravel().tolist())


def test_depth_for_eyes_is_bright_where_near_and_black_where_unknown(frame: CameraFrame) -> None:
    grey = np.asarray(Image.open(BytesIO(only(frame, DEPTH, "jpeg", 0, 0, 95).data)), float)
    assert grey[:, 0].mean() < 30.0
    assert grey[:, 8].mean() > grey[:, 32].mean() > grey[:, 60].mean() > 32.0


def test_formats_of_two_topics_share_their_bytes(frame: CameraFrame) -> None:
    raw, rectified = COLOURS, "/camera/rgb/image_rect_color"
    wanted = [PictureFormat(topic, "jpeg", 32, 24, 30) for topic in (rectified, raw)]
    first, second = pictures_of(frame, CAMERA, wanted)
    assert (first.format.topic, second.format.topic) == (raw, rectified)
    assert first.data is second.data


def test_formats_that_make_no_sense_give_nothing(frame: CameraFrame) -> None:
    wanted = [PictureFormat(DEPTH, "rgb8"), PictureFormat(COLOURS, "16UC1")]
    assert pictures_of(frame, CAMERA, wanted) == []
