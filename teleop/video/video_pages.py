"""The pages of ``web_video_server``: streams, snapshots, a viewer, and the list of topics."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from html import escape
from http import HTTPStatus
from typing import Final
from urllib.parse import urlencode

from teleop.pictures.picture import Picture, PictureFormat
from teleop.pictures.picture_hub import PictureHub
from teleop.rosbridge.server.http_handlers import HttpHandlers, HttpRequest, Route, Stream
from teleop.rosbridge.server.http_pages import Page
from teleop.video.mjpeg import NEVER_CACHED, STREAM_HEADERS, mjpeg, stamp_text
from teleop.video.refusal import VideoRefusedError, answering
from teleop.video.video_topics import VideoTopic, check_stream_type, wanted_picture, wanted_rate
from teleop.video.viewer_access import ViewerAccess
from teleop.video.viewer_places import ViewerPlaces

SNAPSHOT_TIMEOUT: Final = 10.0
"""Time for which a snapshot waits for a picture [s]."""

_HTML: Final = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; frame-ancestors 'none'",
}


class VideoPages:
    """Answers requests for the pictures of a hub."""

    def __init__(
        self,
        hub: PictureHub,
        topics: Sequence[VideoTopic],
        access: ViewerAccess,
        stamp: Callable[[], int],
    ) -> None:
        """Prepare to answer.

        Args:
            hub: Where pictures come from.
            topics: What can be watched.
            access: Decides who may.
            stamp: Returns the newest known time of the robot's clock [ns].
        """
        self._hub, self._topics, self._access, self._stamp = hub, topics, access, stamp
        self._places = ViewerPlaces()

    def add_to(self, handlers: HttpHandlers, *, index: str = "/streams") -> None:
        """Answer at the paths of ``web_video_server``; ``index`` is the path of the list."""
        for path, handle in (
            ("/stream", self._stream),
            ("/snapshot", self._snapshot),
            ("/stream_viewer", self._viewer),
            (index, self._index),
        ):
            answered = answering(handle, self._access.refused)
            handlers.add(path, Route(answered, public=True, own_pages_only=True))

    async def next_picture(self, wanted: PictureFormat) -> Picture:
        """Return the first picture that was taken after this call.

        Raises:
            TimeoutError: If none comes in time.
        """
        asked, watch = self._stamp(), self._hub.watch(wanted)
        try:
            async with asyncio.timeout(SNAPSHOT_TIMEOUT):
                # What is on its way already may show what was there before.
                while (picture := await watch.next()).stamp <= asked:
                    pass
                return picture
        finally:
            watch.close()

    async def _stream(self, request: HttpRequest) -> Stream:
        check_stream_type(request.query)
        wanted, rate = wanted_picture(request.query, self._topics), wanted_rate(request.query)
        access = self._access.check(request, wanted.topic)
        leave = self._places.take(request.address, wanted)
        watch = self._hub.watch(wanted)

        def ended() -> None:
            watch.close()
            leave()

        chunks = mjpeg(watch, lambda: self._access.still(access), rate)
        return Stream(STREAM_HEADERS, chunks, ended)

    async def _snapshot(self, request: HttpRequest) -> Page:
        wanted = wanted_picture(request.query, self._topics)
        self._access.check(request, wanted.topic)
        leave = self._places.take(request.address, wanted)
        try:
            picture = await self.next_picture(wanted)
        except TimeoutError:
            line = (
                f"no picture came within {SNAPSHOT_TIMEOUT:g} s: does the robot's time stand still?"
            )
            raise VideoRefusedError(HTTPStatus.GATEWAY_TIMEOUT, line) from None
        finally:
            leave()
        headers = {
            "Content-Type": "image/jpeg",
            "Cache-Control": NEVER_CACHED,
            "Pragma": "no-cache",
            "X-Timestamp": stamp_text(picture.stamp),
        }
        return Page(HTTPStatus.OK, headers, picture.data)

    async def _viewer(self, request: HttpRequest) -> Page:
        check_stream_type(request.query)
        wanted = wanted_picture(request.query, self._topics)
        self._access.check(request, wanted.topic)
        address = escape(f"/stream?{urlencode(request.query, safe='/')}")
        title = escape(request.query["topic"])
        return _page(title, f'<h1>{title}</h1><p><img src="{address}" alt="{title}"></p>')

    async def _index(self, request: HttpRequest) -> Page:
        self._access.check(request, self._topics[0].source)
        ticket = {"ticket": request.query["ticket"]} if "ticket" in request.query else {}
        rows = "".join(_row(topic, ticket) for topic in self._topics)
        return _page(
            "Available ROS image topics", f"<h1>Available ROS image topics</h1><ul>{rows}</ul>"
        )


def _row(topic: VideoTopic, ticket: dict[str, str]) -> str:
    query = escape(urlencode({"topic": topic.name, **ticket}, safe="/"))
    links = (
        ("/stream_viewer", escape(topic.name)),
        ("/stream", "stream"),
        ("/snapshot", "snapshot"),
    )
    anchors = (f'<a href="{path}?{query}">{text}</a>' for path, text in links)
    return f"<li>{' '.join(anchors)}: {escape(topic.description)}</li>"


def _page(title: str, body: str) -> Page:
    text = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title></head>'
    )
    return Page(HTTPStatus.OK, dict(_HTML), f"{text}<body>{body}</body></html>\n".encode())
