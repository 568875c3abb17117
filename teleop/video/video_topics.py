"""The topics whose pictures can be watched, and what a viewer may ask of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Final

from teleop.pictures.picture import PictureFormat
from teleop.video.refusal import VideoRefusedError

DEFAULT_QUALITY: Final = 95
"""Quality unless a viewer asks for another, as in ``web_video_server``."""

FASTEST: Final = 60
"""Largest ``rate`` that a viewer may ask for [1/s]: more than any camera has."""

_NO: Final = ("", "0", "false", "no")
"""Values of ``invert`` that leave a picture as it is; its bare presence turns it, as in ``web_video_server``."""


@dataclass(frozen=True, slots=True)
class VideoTopic:
    """A topic whose pictures can be watched."""

    name: str
    """Name by which viewers ask for it."""
    source: str
    """Topic of the format in which the pictures are asked for; equal ones are encoded once."""
    width: int
    """Width of the camera's pictures, and the largest that is served [pixels]."""
    height: int
    """Height of the camera's pictures, and the largest that is served [pixels]."""
    description: str
    """What it shows, for people."""


def video_topics(width: int, height: int) -> tuple[VideoTopic, ...]:
    """Return the topics of the robot's camera, of which this is the size [pixels]; the one to prefer first."""
    colours, depth = "/camera/rgb/image_raw", "/camera/depth/image_raw"
    return (
        VideoTopic(
            "/camera/rgb/image_rect_color",
            colours,  # the camera has no distortion, so these are the same pictures
            width,
            height,
            "colours, rectified",
        ),
        VideoTopic(colours, colours, width, height, "colours"),
        VideoTopic(
            depth, depth, width, height, "depth as grey: near is light, black is not measured"
        ),
    )


def wanted_picture(query: Mapping[str, str], topics: Sequence[VideoTopic]) -> PictureFormat:
    """Return the format that the fields of an address ask for.

    Raises:
        VideoRefusedError: If there is no such picture; the line says which there are.
    """
    topic = _topic(query, topics)
    quality = _number(query, "quality", DEFAULT_QUALITY, 100)
    width = _number(query, "width", topic.width, topic.width)
    height = _number(query, "height", topic.height, topic.height)
    inverted = "invert" in query and (query["invert"] == "" or query["invert"].lower() not in _NO)
    return PictureFormat(topic.source, "jpeg", width, height, quality, inverted)


def wanted_rate(query: Mapping[str, str]) -> int:
    """Return how many pictures a second an address asks for at most; 0 for all.

    Raises:
        VideoRefusedError: If it is no such number.
    """
    return _number(query, "rate", 0, FASTEST)


def check_stream_type(query: Mapping[str, str]) -> None:
    """Raise a VideoRefusedError unless a viewer asks for the one type of streams."""
    kind = query.get("type", "mjpeg")
    if kind != "mjpeg":
        line = f"type {kind[:40]!r} is not served here; type=mjpeg works, and is the default"
        raise VideoRefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, line)


def _topic(query: Mapping[str, str], topics: Sequence[VideoTopic]) -> VideoTopic:
    name = query.get("topic", "")
    for topic in topics:
        if name in (topic.name, topic.name[1:]):
            return topic
    names = ", ".join(topic.name for topic in topics)
    if not name:
        line = f"topic is missing: /stream?topic={topics[0].name}; there are {names}"
        raise VideoRefusedError(HTTPStatus.BAD_REQUEST, line)
    line = f"no pictures of topic {name[:80]!r}: there are {names}"
    raise VideoRefusedError(HTTPStatus.NOT_FOUND, line)


def _number(query: Mapping[str, str], name: str, default: int, most: int) -> int:
    """Return a field that is a number of 1 to ``most``; zero and less are the default, but not of the quality."""
    text = query.get(name, "").strip()
    if not text:
        return default
    digits = text.removeprefix("-")
    if len(text) <= 9 and digits.isascii() and digits.isdigit():
        number = int(text)
        if number <= 0 and name != "quality":
            return default
        if 1 <= number <= most:
            return number
    line = f"{name} must be 1 to {most}, got {text[:40]!r}"
    raise VideoRefusedError(HTTPStatus.BAD_REQUEST, line)
