"""One WebRTC connection, from its offer until the viewer leaves."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Sequence
from http import HTTPStatus
from typing import Final

from aiortc import RTCSessionDescription

from teleop.pictures.picture_hub import Watch
from teleop.video.refusal import VideoRefusedError
from teleop.video.webrtc.picture_track import PictureTrack
from teleop.video.webrtc.robot_candidates import (
    listen_only_on,
    robot_connection,
    without_candidates,
)

CONNECT_TIMEOUT: Final = 15.0
"""Time from the answer until the connection stands [s]; one that does not is closed."""

_ONE_VIDEO: Final = "an offer has one video, that is received, and nothing else"


class Peer:
    """A viewer's connection; ``closed`` is called once, however it ends."""

    def __init__(
        self,
        watch: Watch,
        addresses: Sequence[str],
        may_go_on: Callable[[], bool],
        closed: Callable[[Peer], object],
    ) -> None:
        """Prepare a connection.

        Args:
            watch: The viewer's watch of a raw format; closed with the connection.
            addresses: Addresses of the robot's server.
            may_go_on: Returns whether the viewer may go on watching.
            closed: Called at the end.
        """
        self._watch, self._addresses, self._closed = watch, addresses, closed
        self._connection = robot_connection()
        self._track = PictureTrack(watch, may_go_on)
        self._closing: asyncio.Task[None] | None = None
        self._deadline: asyncio.TimerHandle | None = None
        self._track.on("ended", self._close_soon)
        self._connection.on("connectionstatechange", self._changed)

    async def answer(self, offer: str) -> str:
        """Return the answer to an offer; all candidates are in it.

        Raises:
            VideoRefusedError: If the offer is not understood; the line says what would work.
        """
        kinds = re.findall(r"^m=(\w+)", offer, re.MULTILINE)
        if kinds != ["video"]:
            found = ", ".join(kinds[:5]) or "none"
            raise VideoRefusedError(HTTPStatus.BAD_REQUEST, f"{_ONE_VIDEO}; this one has: {found}")
        try:
            described = RTCSessionDescription(without_candidates(offer), "offer")
            await self._connection.setRemoteDescription(described)
            self._connection.addTrack(self._track)
            listen_only_on(self._connection, self._addresses)
            await self._connection.setLocalDescription(await self._connection.createAnswer())
        except Exception as error:  # aiortc's parser raises whatever fails first in it
            line = f"the offer is not understood ({type(error).__name__}); {_ONE_VIDEO}"
            raise VideoRefusedError(HTTPStatus.BAD_REQUEST, line) from error
        loop = asyncio.get_running_loop()
        self._deadline = loop.call_later(CONNECT_TIMEOUT, self._close_soon)
        return self._connection.localDescription.sdp

    async def close(self) -> None:
        """End the connection, if it has not ended."""
        self._close_soon()
        assert self._closing is not None
        await asyncio.shield(self._closing)

    def _changed(self) -> None:
        state = self._connection.connectionState
        if state == "connected" and self._deadline is not None:
            self._deadline.cancel()
        elif state in ("failed", "closed"):
            self._close_soon()

    def _close_soon(self) -> None:
        if self._closing is None:
            self._closing = asyncio.ensure_future(self._close())

    async def _close(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._watch.close()
        self._track.stop()
        try:
            await self._connection.close()
        finally:
            self._closed(self)
