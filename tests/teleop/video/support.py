"""A video server over a hub that a test feeds with real pictures, and viewers that read from sockets."""

from __future__ import annotations

import asyncio
import http.client
import json
import socket
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

from teleop.pictures.picture import Picture, PictureFormat
from teleop.pictures.picture_hub import PictureHub
from teleop.robot.clients.whoami_service import may_drive
from teleop.robot.serving.server_setup import ROLES
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credentials, read_credentials
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.http_handlers import HttpHandlers
from teleop.rosbridge.server.http_server import HttpServer
from teleop.rosbridge.server.server import Server
from teleop.video.photographs.photo_folder import PhotoFolder
from teleop.video.photographs.photo_pages import PhotoPages
from teleop.video.photographs.photo_rate import PhotoRate
from teleop.video.photographs.photo_record import PhotoPose
from teleop.video.photographs.photographer import PhotoContext, Photographer
from teleop.video.tickets import Tickets
from teleop.video.video_pages import VideoPages
from teleop.video.video_topics import video_topics
from teleop.video.viewer_access import ViewerAccess
from tests.teleop.rosbridge.support import REGISTRY

WIDTH, HEIGHT = 160, 120
TOPIC = "/camera/rgb/image_rect_color"
PERIOD = 66_666_667
"""Time between two pictures in the robot's time [ns]."""

TOKENS = """
[tokens.headset]
role = "view"
token = "view-view-view-view"
[tokens.driver]
role = "operate"
token = "drive-drive-drive-drive"
"""

POSE = PhotoPose(1, (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.01,) * 36, "tracking")


@cache
def jpeg(wanted: PictureFormat, number: int) -> bytes:
    """Return a JPEG that shows a number, as the bar's length, in a format."""
    image = Image.new("RGB", (WIDTH, HEIGHT), "navy")
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 0, number % WIDTH, 20), "white")
    for x in range(0, WIDTH, 4):
        draw.line((x, 30, WIDTH - x, HEIGHT), (x, 255 - x, 99))
    if wanted.inverted:
        image = image.rotate(180)
    file = BytesIO()
    size = (wanted.width or WIDTH, wanted.height or HEIGHT)
    image.resize(size).save(file, "JPEG", quality=wanted.quality or 80)
    return file.getvalue()


def picture(content: bytes) -> Image.Image:
    """Return a picture that was sent."""
    image = Image.open(BytesIO(content))
    image.load()
    return image


@dataclass
class VideoRig:
    """The server and what feeds it."""

    server: Server
    hub: PictureHub
    access: ViewerAccess
    photographer: Photographer
    time: list[float]
    """Time of the tickets' clock [s]; a test sets it."""
    stamp: int = 0
    number: int = 0
    padding: int = 0
    """Bytes by which each picture is made longer, as a comment would."""
    encoded: list[PictureFormat] = field(default_factory=list)

    @property
    def port(self) -> int:
        """Where it is served."""
        return self.server.port

    def show(self, *, late: int = 0) -> None:
        """Have the camera see the next picture, or one that is late by some time [ns]."""
        self.number += 1
        self.stamp += PERIOD
        for wanted in sorted(self.hub.wanted, key=str):
            self.encoded.append(wanted)
            size = (wanted.width or WIDTH, wanted.height or HEIGHT)
            content = jpeg(wanted, self.number % 50) + bytes(self.padding)
            stamp = self.stamp - late
            self.hub.publish(Picture(wanted, stamp, "camera_rgb_optical_frame", *size, content))

    async def film(self, period: float) -> None:
        """Show pictures until cancelled."""
        while True:
            self.show()
            await asyncio.sleep(period)


@asynccontextmanager
async def video(
    folder: Path,
    *,
    tokens: bool = False,
    filming: bool = True,
    period: float = 0.01,
    rate: PhotoRate | None = None,
    **quota: int,
) -> AsyncIterator[VideoRig]:
    """Serve pictures and photographs; of a robot that asks for tokens or not."""
    protocol = Protocol(
        REGISTRY, limits=ClientLimits.unhurried(), authenticator=_gate(folder) if tokens else None
    )
    server = Server(protocol, port=0)
    hub, time = PictureHub(lambda wanted: None), [1000.0]
    access = ViewerAccess(protocol, Tickets(lambda: time[0]))
    stamp = [lambda: 0]
    pages = VideoPages(hub, video_topics(WIDTH, HEIGHT), access, lambda: stamp[0]())
    pages.add_to(server.handlers)
    access.add_page(server.handlers)
    around = PhotoContext(lambda at: POSE, lambda: "2026-11-22T10:20:30.5+00:00", "office", "ab12")
    whole = PictureFormat("/camera/rgb/image_raw", "jpeg", WIDTH, HEIGHT, 95)
    photos = PhotoFolder(folder / "photos", **quota)
    photographer = Photographer(photos, whole, pages.next_picture, around)
    rate = rate or PhotoRate(0)
    PhotoPages(photographer, access, whole.topic, may_drive, rate=rate).add_to(server)
    rig = VideoRig(server, hub, access, photographer, time)
    stamp[0] = lambda: rig.stamp
    async with server:
        film = asyncio.create_task(rig.film(period)) if filming else None
        try:
            yield rig
        finally:
            if film is not None:
                film.cancel()
            photographer.close()


@asynccontextmanager
async def further_port(rig: VideoRig) -> AsyncIterator[int]:
    """Serve the list of streams at the root of another port."""
    handlers = HttpHandlers()
    pages = VideoPages(rig.hub, video_topics(WIDTH, HEIGHT), rig.access, lambda: rig.stamp)
    pages.add_to(handlers, index="/")
    async with HttpServer(rig.server, 0, handlers) as further:
        yield further.port


def _gate(folder: Path) -> Authenticator:
    return Authenticator(credentials(folder, TOKENS), lambda: 0.0)


def credentials(folder: Path, text: str) -> Credentials:
    """Return the credentials of a token file."""
    file = folder / "tokens.toml"
    file.write_text(text, encoding="utf-8")
    file.chmod(0o600)
    return read_credentials(file, ROLES)


@dataclass
class Answer:
    """A response that has ended."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def line(self) -> str:
        return self.body.decode().rstrip("\n")

    @property
    def json(self) -> Any:
        return json.loads(self.body)


async def get(port: int, path: str, method: str = "GET", **headers: str) -> Answer:
    """Return the whole response to a request without a body; in names of headers write _ for -."""
    return await ask(port, path, method, None, headers)


async def ask(
    port: int, path: str, method: str, body: bytes | None, headers: Mapping[str, str]
) -> Answer:
    """Return the whole response to a request."""

    def answered() -> Answer:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
        names = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, body, names)
        response = connection.getresponse()
        fields = {k.lower(): v for k, v in response.getheaders()}
        answer = Answer(response.status, fields, response.read())
        connection.close()
        return answer

    return await asyncio.to_thread(answered)


@dataclass
class Part:
    """A part of a stream."""

    headers: dict[str, str]
    data: bytes

    @property
    def stamp(self) -> float:
        return float(self.headers["x-timestamp"])


class Viewer:
    """Reads a stream part by part."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer
        self.status, self.headers = 0, dict[str, str]()

    async def begin(self, path: str, headers: Mapping[str, str]) -> None:
        """Send the request and read the header of the response."""
        lines = [f"GET {path} HTTP/1.1", "Host: 127.0.0.1"]
        lines += [f"{name}: {value}" for name, value in headers.items()]
        self.writer.write("\r\n".join([*lines, "", ""]).encode())
        head = (await self.reader.readuntil(b"\r\n\r\n")).decode().split("\r\n")
        self.status = int(head[0].split()[1])
        self.headers = fields_of(head[1:])

    async def next(self) -> Part:
        """Return the next part."""
        boundary = await self.reader.readuntil(b"\r\n")
        if boundary == b"\r\n":
            boundary = await self.reader.readuntil(b"\r\n")
        assert boundary == b"--boundarydonotcross\r\n"
        head = (await self.reader.readuntil(b"\r\n\r\n")).decode().split("\r\n")
        headers = fields_of(head)
        return Part(headers, await self.reader.readexactly(int(headers["content-length"])))

    def close(self) -> None:
        self.writer.close()


def fields_of(lines: list[str]) -> dict[str, str]:
    """Return header lines by name."""
    pairs = (line.partition(":") for line in lines if line)
    return {name.lower(): value.strip() for name, _, value in pairs}


@asynccontextmanager
async def viewer(
    port: int, path: str, headers: Mapping[str, str] | None = None, *, buffer: int = 0
) -> AsyncIterator[Viewer]:
    """Watch a stream; ``buffer`` is the size of the receive buffer [bytes]."""
    taker = socket.socket()
    if buffer:
        taker.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
    taker.setblocking(False)
    await asyncio.get_running_loop().sock_connect(taker, ("127.0.0.1", port))
    reader, writer = await asyncio.open_connection(sock=taker, limit=max(buffer, 4096))
    watching = Viewer(reader, writer)
    try:
        await watching.begin(path, headers or {})
        yield watching
    finally:
        watching.close()
