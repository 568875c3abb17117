"""The topics of a camera: what is subscribed to is watched, and each picture published as it comes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from robot_sim.cameras import CameraModel
from robot_sim.robot.camera_mount import DEPTH_FRAME, RGB_FRAME
from teleop.pictures.picture import Picture, PictureFormat
from teleop.pictures.picture_hub import PictureHub, Watch
from teleop.robot.cameras import camera_messages as messages
from teleop.robot.cameras.frame_schedule import frame_due
from teleop.robot.topics.message_parts import Message
from teleop.rosbridge.server.server import Server

_RAW: Final = "/camera/rgb/image_raw"
_DEPTH: Final = "/camera/depth/image_raw"

_COLOURS: Final = PictureFormat(_RAW, "rgb8")
_JPEG: Final = PictureFormat(_RAW, "jpeg")


@dataclass(frozen=True, slots=True)
class PictureTopic:
    """A topic that publishes pictures of one format."""

    name: str
    """Name of the topic."""
    type: str
    """Type of its messages."""
    format: PictureFormat
    """The format; the camera has no distortion, so that rectified and raw colours are the same pictures."""
    build: Callable[[Picture], Message]
    """Returns the message of a picture."""
    description: str
    """Content, for the documentation."""


@dataclass(frozen=True, slots=True)
class InfoTopic:
    """A topic that publishes the calibration with each frame."""

    name: str
    """Name of the topic."""
    type: str
    """Type of its messages."""
    frame: str
    """Optical frame of its images."""
    description: str
    """Content, for the documentation."""


PICTURE_TOPICS: Final = (
    PictureTopic(
        _RAW, "sensor_msgs/msg/Image", _COLOURS, messages.image, "colours, `rgb8`, 0.9 MB a frame"
    ),
    PictureTopic(
        f"{_RAW}/compressed",
        "sensor_msgs/msg/CompressedImage",
        _JPEG,
        messages.compressed_colours,
        "the same as JPEG of quality 80",
    ),
    PictureTopic(
        "/camera/rgb/image_rect_color",
        "sensor_msgs/msg/Image",
        _COLOURS,
        messages.image,
        "the same pictures as `image_raw`: the camera has no distortion",
    ),
    PictureTopic(
        "/camera/rgb/image_rect_color/compressed",
        "sensor_msgs/msg/CompressedImage",
        _JPEG,
        messages.compressed_colours,
        "the same as JPEG of quality 80",
    ),
    PictureTopic(
        _DEPTH,
        "sensor_msgs/msg/Image",
        PictureFormat(_DEPTH, "16UC1"),
        messages.image,
        "depth along the optical axis [mm], `16UC1`, registered to the colours; 0: nothing measured",
    ),
    PictureTopic(
        f"{_DEPTH}/compressed",
        "sensor_msgs/msg/CompressedImage",
        PictureFormat(_DEPTH, "png"),
        messages.compressed_depth,
        "the same as a plain PNG of 16 bits, without the header of `compressedDepth`",
    ),
    PictureTopic(
        "/camera/depth/points",
        "sensor_msgs/msg/PointCloud2",
        PictureFormat("/camera/depth/points", "points"),
        messages.points,
        "coloured points in the optical frame: x y z [m], rgb; thinned evenly to at most 1 MB",
    ),
)
"""Topics of pictures."""

INFO_TOPICS: Final = tuple(
    InfoTopic(
        f"/camera/{part}/camera_info",
        "sensor_msgs/msg/CameraInfo",
        frame,
        "size and intrinsics, with the stamp of each frame that is due",
    )
    for part, frame in (("rgb", RGB_FRAME), ("depth", DEPTH_FRAME))
)
"""Topics of the calibration."""

CAMERA_TOPICS: Final[tuple[PictureTopic | InfoTopic, ...]] = (*PICTURE_TOPICS, *INFO_TOPICS)
"""All topics of a camera."""


class CameraTopics:
    """Publishes what a hub's pictures show, to those who subscribe; nothing is made for nobody."""

    def __init__(self, server: Server, hub: PictureHub, camera: CameraModel) -> None:
        """Advertise the topics.

        Args:
            server: The robot's server, not yet started.
            hub: Where pictures come from.
            camera: The camera.
        """
        self._server, self._hub, self._camera = server, hub, camera
        self._watches: dict[str, Watch] = {}
        for topic in CAMERA_TOPICS:
            server.protocol.topics.advertise(topic.name, topic.type)

    def ticked(self, stamp: int) -> bool:
        """Follow what is subscribed to; return whether a frame is due at this tick.

        Args:
            stamp: Robot time after the tick [ns].
        """
        topics = self._server.protocol.topics
        for topic in PICTURE_TOPICS:
            watch = self._watches.get(topic.name)
            if topics.wanted(topic.name) is (watch is not None):
                continue
            if watch is None:
                take = partial(self._publish, topic)
                self._watches[topic.name] = self._hub.watch(topic.format, take)
            else:
                self._watches.pop(topic.name).close()
        due = frame_due(stamp, self._camera.rate)
        if due:
            for info in INFO_TOPICS:
                build = partial(messages.camera_info, self._camera, stamp, info.frame)
                topics.publish(info.name, build, self._server.now)
        return due

    def _publish(self, topic: PictureTopic, picture: Picture) -> None:
        build = partial(topic.build, picture)
        self._server.protocol.topics.publish(topic.name, build, self._server.now)
