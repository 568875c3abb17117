"""``POST /webrtc/offer`` with an SDP offer answers with the robot's; ``/webrtc_viewer`` is a page that plays it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from http import HTTPStatus
from pathlib import Path
from typing import Final

from teleop.pictures.picture import PictureFormat
from teleop.pictures.picture_hub import PictureHub
from teleop.rosbridge.server.http_handlers import HttpHandlers, HttpRequest, Route
from teleop.rosbridge.server.http_pages import Page
from teleop.video.refusal import VideoRefusedError, answering
from teleop.video.video_topics import VideoTopic, wanted_picture
from teleop.video.viewer_access import ViewerAccess
from teleop.video.viewer_places import ViewerPlaces
from teleop.video.webrtc.peer import Peer

MAX_PEERS: Final = 4
"""Connections at a time; each has an encoder of its own."""

OFFER: Final = "/webrtc/offer"
VIEWER: Final = "/webrtc_viewer"
_SCRIPT: Final = "/webrtc_viewer.js"

_SDP: Final = "application/sdp"

_POLICY: Final = "default-src 'none'; script-src 'self'; connect-src 'self'; frame-ancestors 'none'"


class WebrtcPages:
    """Answers offers, and holds the connections until they end."""

    def __init__(
        self,
        hub: PictureHub,
        topics: Sequence[VideoTopic],
        access: ViewerAccess,
        addresses: Callable[[], Sequence[str]],
    ) -> None:
        """Prepare to answer.

        Args:
            hub: Where pictures come from.
            topics: What can be watched; of these, colours are offered.
            access: Decides who may.
            addresses: Returns the addresses that the robot's server listens on.
        """
        self._hub, self._access, self._addresses = hub, access, addresses
        self._topics = [topic for topic in topics if not topic.source.startswith("/camera/depth/")]
        self._places = ViewerPlaces()
        self._peers: set[Peer] = set()
        self._script = Path(__file__).with_name("webrtc_viewer.js").read_bytes()

    @property
    def peers(self) -> int:
        """Number of connections, those that are being set up or closed included."""
        return len(self._peers)

    def add_to(self, handlers: HttpHandlers) -> None:
        """Answer at the paths."""
        refused = self._access.refused
        offer = Route(answering(self._offer, refused), ("POST",), True, True, takes_body=True)
        handlers.add(OFFER, offer)
        viewer = answering(self._viewer, refused)
        handlers.add(VIEWER, Route(viewer, public=True, own_pages_only=True))
        handlers.add(_SCRIPT, Route(answering(self._code), public=True, own_pages_only=True))

    async def close(self) -> None:
        """End all connections."""
        for peer in tuple(self._peers):
            await peer.close()

    async def _offer(self, request: HttpRequest) -> Page:
        if request.headers.get("Content-Type", "").partition(";")[0].strip().lower() != _SDP:
            line = f"an offer is an SDP with Content-Type: {_SDP}"
            raise VideoRefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, line)
        wanted = self._wanted(request)
        access = self._access.check(request, wanted.topic)
        try:
            offer = request.body.decode()
        except UnicodeDecodeError:
            raise VideoRefusedError(HTTPStatus.BAD_REQUEST, "an offer is UTF-8") from None
        if len(self._peers) >= MAX_PEERS:
            line = f"{MAX_PEERS} viewers watch by WebRTC already: /stream has room for more"
            raise VideoRefusedError(HTTPStatus.SERVICE_UNAVAILABLE, line, Retry_After="10")
        leave = self._places.take(request.address, wanted)

        def closed(peer: Peer) -> None:
            self._peers.discard(peer)
            leave()

        watch = self._hub.watch(wanted)
        peer = Peer(watch, self._addresses(), lambda: self._access.still(access), closed)
        self._peers.add(peer)
        answered = False
        try:
            sdp = await peer.answer(offer)
            answered = True
        finally:
            if not answered:
                await peer.close()
        fields = {"Content-Type": _SDP, "Cache-Control": "no-store"}
        return Page(HTTPStatus.OK, fields, sdp.encode())

    async def _viewer(self, request: HttpRequest) -> Page:
        query = {"topic": self._topics[0].name, **request.query}
        title = escape(query["topic"])
        self._access.check(request, wanted_picture(query, self._topics).topic)
        text = (
            f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
            f'<script src="{_SCRIPT}" defer></script></head><body><h1>{title}</h1>'
            '<p><video autoplay muted playsinline></video></p><p role="status"></p></body></html>\n'
        )
        fields = {
            "Content-Type": "text/html; charset=utf-8",
            "Cache-Control": "no-store",
            "Content-Security-Policy": _POLICY,
        }
        return Page(HTTPStatus.OK, fields, text.encode())

    async def _code(self, request: HttpRequest) -> Page:
        fields = {"Content-Type": "text/javascript; charset=utf-8", "Cache-Control": "no-cache"}
        return Page(HTTPStatus.OK, fields, self._script)

    def _wanted(self, request: HttpRequest) -> PictureFormat:
        """Return the raw format of the topic that a request names, the first unless it does."""
        query = {"topic": request.query.get("topic", self._topics[0].name)}
        found = wanted_picture(query, self._topics)
        # Drawn by the camera's process anyway: neither encoded there nor decoded here.
        return PictureFormat(found.topic, "rgb8", found.width, found.height)
