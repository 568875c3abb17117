"""The list of streams, announced as a JSON object of names and addresses on the topic ``/cam_sources``."""

from __future__ import annotations

import json
from typing import Final

from teleop.rosbridge.protocol.protocol import Protocol

CAM_SOURCES: Final = "/cam_sources"
"""The topic; a ``std_msgs/String`` that is latched."""

_STREAMS: Final = {
    "{}": "/camera/rgb/image_rect_color",
    "{}_depth": "/camera/depth/image_raw",
}
"""Topics by the pattern of their name."""

_QUALITY: Final = 30
"""Quality of the announced streams, as headsets ask for it."""


def cam_sources(robot: str, base: str) -> dict[str, str]:
    """Return the addresses of a robot's streams by name.

    Args:
        robot: Name of the robot; the list is read by programs that cut it at commas and colons.
        base: Beginning of the addresses, such as ``http://192.168.1.7:8080``.
    """
    fields = f"type=mjpeg&quality={_QUALITY}"
    return {
        name.format(robot): f"{base}/stream?topic={topic}&{fields}"
        for name, topic in _STREAMS.items()
    }


def base_address(host: str, port: int, *, encrypted: bool) -> str:
    """Return the beginning of the addresses of a server."""
    named = f"[{host}]" if ":" in host else host
    return f"{'https' if encrypted else 'http'}://{named}:{port}"


def announce(protocol: Protocol, sources: dict[str, str], now: int) -> None:
    """Publish the list for everybody who subscribes, now or later."""
    protocol.topics.advertise(CAM_SOURCES, "std_msgs/msg/String", latch=True)
    protocol.topics.publish(CAM_SOURCES, {"data": json.dumps(sources)}, now)
