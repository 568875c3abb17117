"""The camera at the station: its frustum in the map, its pictures beside it, and their age."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from localization.display.rerun_sink import Sink
from localization.maps.cloud import Cloud
from localization.types import SECOND
from robot_sim import P3AT
from robot_sim.cameras import CAMERAS
from robot_sim.robot.camera_mount import DEPTH_FRAME, RGB_FRAME
from teleop.operator.display.camera_drawing import DEPTH, PICTURE
from teleop.operator.display.display import Display
from teleop.operator.operator_client import CAMERA
from teleop.pictures.picture import Picture, PictureFormat
from teleop.robot.cameras import camera_messages as messages
from teleop.robot.cameras.camera_topics import CAMERA_TOPICS
from teleop.robot.topics.topic_table import latched_messages
from tests.teleop.operator.support import column, rows

INFO, COLOURS, MILLIMETRES = CAMERA


def _file(pixels: np.ndarray[Any, Any], kind: str) -> bytes:
    file = BytesIO()
    Image.fromarray(pixels).save(file, kind)
    return file.getvalue()


def _shown(display: Display, cloud: Cloud) -> None:
    """Show a second of a camera that stops after its third frame."""
    camera = CAMERAS["small"]
    for topic, message in latched_messages(cloud, P3AT(), {}, camera=camera).items():
        display.show(topic.name, message)
    jpeg = _file(np.zeros((240, 320, 3), np.uint8), "JPEG")
    png = _file(np.full((240, 320), 1500, np.uint16), "PNG")
    for tick in range(1, 51):
        stamp = tick * 20_000_000
        if tick in (4, 7, 10):
            size = camera.width, camera.height
            display.show(INFO, messages.camera_info(camera, stamp, RGB_FRAME))
            colours = Picture(PictureFormat(COLOURS, "jpeg"), stamp, RGB_FRAME, *size, jpeg)
            display.show(COLOURS, messages.compressed_colours(colours))
            depth = Picture(PictureFormat(MILLIMETRES, "png"), stamp, DEPTH_FRAME, *size, png)
            display.show(MILLIMETRES, messages.compressed_depth(depth))
        display.show("/clock", {"clock": {"sec": stamp // SECOND, "nanosec": stamp % SECOND}})


def test_pictures_of_a_camera_are_drawn_with_their_age(cloud: Cloud, tmp_path: Path) -> None:
    display = Display(cloud, sink=Sink(file=tmp_path / "x.rrd"), strict=True, camera=True)
    _shown(display, cloud)
    display.close()
    found = rows(tmp_path / "x.rrd")
    assert (found[f"{PICTURE}/image"], found[f"{DEPTH}/image"]) == (3, 3)
    assert PICTURE in found, "the frustum stands in the map"
    ages = [text for (text,) in column(tmp_path / "x.rrd", f"{PICTURE}/age", "Points2D:labels")]
    assert ages[0] == "0.0 s old"
    assert ages[-1] == "0.8 s old"


@pytest.mark.parametrize("camera", [True, False])
def test_camera_takes_part_only_where_it_is_wanted(
    cloud: Cloud, tmp_path: Path, camera: bool
) -> None:
    display = Display(cloud, sink=Sink(file=tmp_path / "x.rrd"), strict=True, camera=camera)
    assert (set(CAMERA) <= set(display.topics)) is camera
    display.close()


def test_topics_of_the_station_are_the_robot_s() -> None:
    types = {topic.name: topic.type for topic in CAMERA_TOPICS}
    assert {name: types.get(name) for name in CAMERA} == dict(CAMERA)
