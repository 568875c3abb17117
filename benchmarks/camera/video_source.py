"""Pictures with a time code, served as a robot serves them: ``python -m benchmarks.camera.video_source`` prints its port.

The office as the Kinect-like camera draws it goes by as in a slow turn. The first rows of each picture are 32 bars,
white for 1: 24 bits of the wall clock [ms] when the picture was complete, and 8 bits to check them.
"""

from __future__ import annotations

import asyncio
import io
import time
from http import HTTPStatus

import numpy as np
import numpy.typing as npt
from PIL import Image

from robot_sim import Simulation, load_world
from robot_sim.cameras import CAMERAS
from robot_sim.cameras.renderer import CameraRenderer
from teleop.pictures.picture import Picture, PictureFormat
from teleop.pictures.picture_hub import PictureHub
from teleop.ros_types import registry
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.handled_request import text_page
from teleop.rosbridge.server.http_handlers import HttpRequest, Route
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.server import Server
from teleop.video.tickets import Tickets
from teleop.video.video_pages import VideoPages
from teleop.video.video_topics import video_topics
from teleop.video.viewer_access import ViewerAccess
from teleop.video.webrtc.webrtc_pages import WebrtcPages

RATE = 15.0
"""Pictures in a second, as of the Kinect-like camera."""
BITS, BAR, ROWS = 32, 20, 32
"""Bars of the time code, their width and their height [pixels]."""
TURN = 8
"""Pixels by which the office goes by from picture to picture."""


def draw_code(picture: npt.NDArray[np.uint8], milliseconds: int) -> None:
    """Draw a time into the first rows of a picture."""
    stamp = milliseconds & 0xFFFFFF
    check = (stamp ^ (stamp >> 8) ^ (stamp >> 16)) & 0xFF
    word = stamp << 8 | check
    bars = [255 * (word >> (BITS - 1 - bit) & 1) for bit in range(BITS)]
    picture[:ROWS] = np.repeat(np.array(bars, np.uint8), BAR)[None, :, None]


def read_code(picture: npt.NDArray[np.uint8]) -> int | None:
    """Return the time that was drawn into a grey picture; None if it cannot be read."""
    word = 0
    for bright in picture[ROWS // 2, BAR // 2 : BITS * BAR : BAR] > 127:
        word = word << 1 | int(bright)
    stamp, check = word >> 8, word & 0xFF
    return stamp if (stamp ^ (stamp >> 8) ^ (stamp >> 16)) & 0xFF == check else None


def office() -> npt.NDArray[np.uint8]:
    """Return what the camera sees."""
    world = load_world("office")
    simulation = Simulation(world)
    simulation.step()
    with CameraRenderer(world, CAMERAS["kinect"]) as renderer:
        return np.array(renderer.render(simulation.visual_state()).rgb)


class Source:
    """What makes the pictures that somebody wants."""

    def __init__(self, hub: PictureHub, seen: npt.NDArray[np.uint8]) -> None:
        self._hub, self._seen = hub, seen
        self._number = self.jpeg_bytes = 0

    async def film(self) -> None:
        """Publish pictures until cancelled."""
        begun = time.monotonic()
        while True:
            self._number += 1
            if wanted := self._hub.wanted:
                for picture in await asyncio.to_thread(self._pictures, wanted):
                    self._hub.publish(picture)
            due = begun + self._number / RATE
            await asyncio.sleep(max(0.0, due - time.monotonic()))

    def _pictures(self, wanted: frozenset[PictureFormat]) -> list[Picture]:
        image = np.roll(self._seen, self._number * TURN, axis=1)
        draw_code(image, time.time_ns() // 1_000_000)
        stamp = int(self._number / RATE * 1e9)
        return [self._picture(image, each, stamp) for each in wanted]

    def _picture(self, image: npt.NDArray[np.uint8], wanted: PictureFormat, stamp: int) -> Picture:
        height, width, _ = image.shape
        data = image.tobytes()
        if wanted.encoding == "jpeg":
            file = io.BytesIO()
            Image.fromarray(image).save(file, "JPEG", quality=wanted.quality)
            data = file.getvalue()
            self.jpeg_bytes += len(data)
        return Picture(wanted, stamp, "camera_rgb_optical_frame", width, height, data)

    async def answer(self, request: HttpRequest) -> Page:
        """Answer with the bytes of all JPEGs so far."""
        return text_page(HTTPStatus.OK, str(self.jpeg_bytes))


async def _serve() -> None:
    protocol = Protocol(registry())
    server, hub = Server(protocol, port=0), PictureHub(lambda wanted: None)
    source, seen = CAMERAS["kinect"], office()
    topics = video_topics(source.width, source.height)
    access = ViewerAccess(protocol, Tickets(time.monotonic))
    VideoPages(hub, topics, access, lambda: 0).add_to(server.handlers)
    WebrtcPages(hub, topics, access, lambda: server.addresses).add_to(server.handlers)
    camera = Source(hub, seen)
    server.handlers.add("/jpeg_bytes", Route(camera.answer))
    async with server:
        print(server.port, flush=True)
        await camera.film()


if __name__ == "__main__":
    asyncio.run(_serve())
