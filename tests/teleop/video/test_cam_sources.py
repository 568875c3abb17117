"""The announced list of streams."""

from __future__ import annotations

import json

from teleop.video.cam_sources import announce, base_address, cam_sources
from tests.teleop.rosbridge.support import Wire


def test_the_list_is_that_of_the_thesis_and_reaches_those_who_come_later() -> None:
    wire = Wire()
    base = base_address("192.168.1.7", 8080, encrypted=False)
    announce(wire.protocol, cam_sources("turtlebot", base), wire.now)
    wire.send({"op": "subscribe", "topic": "/cam_sources", "type": "std_msgs/String"})
    (message,) = wire.received()
    text = message["msg"]["data"]
    assert json.loads(text)["turtlebot"] == (
        "http://192.168.1.7:8080/stream?topic=/camera/rgb/image_rect_color&type=mjpeg&quality=30"
    )
    assert json.loads(text)["turtlebot_depth"].startswith("http://192.168.1.7:8080/stream?")
    # Headsets cut the text at commas.
    assert text.count(",") == len(json.loads(text)) - 1


def test_addresses_name_scheme_host_and_port() -> None:
    assert base_address("::1", 9090, encrypted=True) == "https://[::1]:9090"
    assert base_address("robot.lan", 80, encrypted=False) == "http://robot.lan:80"
