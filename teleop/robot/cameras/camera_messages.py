"""Messages of a camera: images, raw and compressed, its calibration, and coloured points."""

from __future__ import annotations

from typing import Final

from robot_sim.cameras import CameraModel
from teleop.pictures.picture import Picture
from teleop.robot.topics.message_parts import Message, header, point_cloud

_PIXEL_BYTES: Final = {"rgb8": 3, "16UC1": 2}


def image(picture: Picture) -> Message:
    """Return ``sensor_msgs/Image`` of raw pixels."""
    encoding = picture.format.encoding
    return {
        "header": header(picture.stamp, picture.frame),
        "height": picture.height,
        "width": picture.width,
        "encoding": encoding,
        "is_bigendian": 0,
        "step": picture.width * _PIXEL_BYTES[encoding],
        "data": picture.data,
    }


def compressed_colours(picture: Picture) -> Message:
    """Return ``sensor_msgs/CompressedImage`` of a JPEG, described as ``compressed_image_transport`` does."""
    # Decoders take the words after "compressed" as the order of the colours in the file.
    return _compressed(picture, "rgb8; jpeg compressed bgr8")


def compressed_depth(picture: Picture) -> Message:
    """Return ``sensor_msgs/CompressedImage`` of a PNG of 16 bits, described as ``compressed_image_transport`` does.

    ``compressedDepth``, which puts twelve bytes before the PNG, is another transport; without them any program
    that reads PNG files reads the depth.
    """
    return _compressed(picture, "16UC1; png compressed ")


def camera_info(camera: CameraModel, stamp: int, frame: str) -> Message:
    """Return ``sensor_msgs/CameraInfo`` of a frame at a stamp [ns]."""
    return {
        "header": header(stamp, frame),
        "height": camera.height,
        "width": camera.width,
        "distortion_model": "plumb_bob",
        "d": list(camera.d),
        "k": list(camera.k),
        "r": list(camera.r),
        "p": list(camera.p),
    }


def points(picture: Picture) -> Message:
    """Return ``sensor_msgs/PointCloud2`` of coloured points, as ``depth_image_proc`` names their fields."""
    return point_cloud(picture.stamp, picture.frame, ("x", "y", "z", "rgb"), picture.data)


def _compressed(picture: Picture, description: str) -> Message:
    return {
        "header": header(picture.stamp, picture.frame),
        "format": description,
        "data": picture.data,
    }
