"""Viewers by WebRTC, and the sockets of this process as the kernel lists them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from aiortc import MediaStreamTrack, RTCPeerConnection, RTCSessionDescription
from av import VideoFrame

from teleop.pictures.picture import Picture
from teleop.video.video_topics import video_topics
from teleop.video.webrtc.robot_candidates import listen_only_on, robot_connection
from teleop.video.webrtc.webrtc_pages import WebrtcPages
from tests.teleop.support import soon
from tests.teleop.video.support import HEIGHT, WIDTH, Answer, VideoRig, ask, video

SDP = "application/sdp"


@asynccontextmanager
async def webrtc(
    folder: Path, *, tokens: bool = False
) -> AsyncIterator[tuple[VideoRig, WebrtcPages]]:
    """Serve raw pictures by WebRTC; their grey says which number they have."""
    async with video(folder, tokens=tokens, filming=False) as rig:
        topics = video_topics(WIDTH, HEIGHT)
        pages = WebrtcPages(rig.hub, topics, rig.access, lambda: rig.server.addresses)
        pages.add_to(rig.server.handlers)
        film = asyncio.create_task(_film(rig))
        try:
            yield rig, pages
        finally:
            await pages.close()
            film.cancel()


async def _film(rig: VideoRig) -> None:
    while True:
        rig.number, rig.stamp = rig.number + 1, rig.stamp + 33_333_333
        grey = bytes([rig.number * 8 % 256]) * (WIDTH * HEIGHT * 3)
        for wanted in rig.hub.wanted:
            rig.hub.publish(Picture(wanted, rig.stamp, "camera", WIDTH, HEIGHT, grey))
        await asyncio.sleep(0.033)


class WebrtcViewer:
    """A client that receives one video."""

    def __init__(self) -> None:
        self.connection: RTCPeerConnection = robot_connection()
        self.tracks: asyncio.Queue[MediaStreamTrack] = asyncio.Queue()
        self.connection.on("track", self.tracks.put_nowait)

    async def offer(self, *, kind: str = "video") -> str:
        """Return an offer; the client listens on loopback only, too."""
        self.connection.addTransceiver(kind, direction="recvonly")
        listen_only_on(self.connection, ["127.0.0.1"])
        await self.connection.setLocalDescription(await self.connection.createOffer())
        return self.connection.localDescription.sdp

    async def accept(self, answer: str) -> MediaStreamTrack:
        """Return the track of an answer."""
        await self.connection.setRemoteDescription(RTCSessionDescription(answer, "answer"))
        return await soon(self.tracks.get())


async def post(port: int, offer: bytes | str, query: str = "", **headers: str) -> Answer:
    """Return the response to an offer."""
    fields = {"Content_Type": SDP, **headers}
    body = offer.encode() if isinstance(offer, str) else offer
    return await ask(port, f"/webrtc/offer{query}", "POST", body, fields)


@asynccontextmanager
async def watching(
    port: int, query: str = "", **headers: str
) -> AsyncIterator[tuple[WebrtcViewer, MediaStreamTrack]]:
    """Watch by WebRTC."""
    viewer = WebrtcViewer()
    try:
        answer = await post(port, await viewer.offer(), query, **headers)
        assert answer.status == 200, answer.line
        yield viewer, await viewer.accept(answer.body.decode())
    finally:
        await viewer.connection.close()


async def frame_of(track: MediaStreamTrack) -> VideoFrame:
    """Return the next picture of a track."""
    frame = await soon(track.recv())
    assert isinstance(frame, VideoFrame)
    return frame


async def emptied(pages: WebrtcPages) -> None:
    """Wait until no connection is left."""

    async def wait() -> None:
        while pages.peers:  # noqa: ASYNC110 - the pages have no event of it
            await asyncio.sleep(0.02)

    await soon(wait())


def udp_addresses() -> set[str]:
    """Return the local addresses of this process's UDP sockets, in the kernel's hexadecimal form."""
    inodes = set()
    for number in Path("/proc/self/fd").iterdir():
        try:
            inodes.add(str(number.readlink()))
        except OSError:  # the descriptor of the listing itself
            continue
    found = set()
    for table in ("udp", "udp6"):
        for line in Path(f"/proc/self/net/{table}").read_text().splitlines()[1:]:
            words = line.split()
            if f"socket:[{words[9]}]" in inodes:
                found.add(words[1].rpartition(":")[0])
    return found
