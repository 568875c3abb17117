"""Photographs over HTTP and on rosbridge: taken by POST or service, listed and fetched by GET."""

from __future__ import annotations

import json
from collections.abc import Callable
from http import HTTPStatus
from typing import Any, Final, TypeAlias

from teleop.rosbridge.auth.permissions import UNGUARDED, Access
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.server.http_handlers import READING, HttpRequest, Route
from teleop.rosbridge.server.http_pages import Page
from teleop.rosbridge.server.server import Server
from teleop.video.photographs.photo_folder import PhotoError
from teleop.video.photographs.photo_rate import PhotoRate
from teleop.video.photographs.photographer import Photographer, TakenPhoto
from teleop.video.refusal import VideoRefusedError, answering
from teleop.video.viewer_access import ViewerAccess

SERVICE: Final = "/camera/photo"
"""The service that takes a photograph."""

LIST: Final = "/photos"
"""Path of the list, to which a POST adds."""

_SECOND: Final = 1_000_000_000

_JSON: Final = {"Content-Type": "application/json", "Cache-Control": "no-store"}


Noted: TypeAlias = Callable[[str, Access | None, str, str], object]
"""Takes the name of a client, over HTTP its network address, its permissions, the name of the photograph that it took, and why
it got none; one of the two is empty."""


class PhotoPages:
    """Who may see pictures may see photographs; who may drive may take them."""

    def __init__(
        self,
        photographer: Photographer,
        access: ViewerAccess,
        topic: str,
        may_take: Callable[[Access], bool],
        note: Noted | None = None,
        rate: PhotoRate | None = None,
    ) -> None:
        """Prepare to answer.

        Args:
            photographer: Takes them.
            access: Decides who may see pictures.
            topic: The topic that photographs are pictures of.
            may_take: Returns whether somebody may take one.
            note: Called with each one that is taken, and each that is not.
            rate: How often each client may take one; once a second, if not given.
        """
        self._photographer, self._access, self._topic = photographer, access, topic
        self._may_take = may_take
        self._note: Noted = note or (lambda client, access, photo, refused: None)
        self._rate = rate or PhotoRate()

    def add_to(self, server: Server) -> None:
        """Offer the pages and the service."""
        self._server = server
        self._connections = server.protocol.connections
        self._guarded = server.protocol.authenticator is not None
        methods = (*READING, "POST")
        both = Route(
            answering(self._list_or_take, self._refused), methods, public=True, own_pages_only=True
        )
        server.handlers.add(LIST, both)
        one = Route(answering(self._fetch, self._access.refused), public=True, own_pages_only=True)
        server.handlers.add(f"{LIST}/", one)
        handler = server.async_handlers.wrap(self._serve)
        server.protocol.services.serve(SERVICE, "farsteer_msgs/srv/TakePhoto", handler)

    async def _list_or_take(self, request: HttpRequest) -> Page:
        if request.method == "POST":
            return await self._take(request)
        self._access.check(request, self._topic)
        try:
            photos = await self._photographer.list()
        except PhotoError as error:
            raise VideoRefusedError(HTTPStatus.INTERNAL_SERVER_ERROR, str(error)) from None
        listed = [
            {"name": photo.name, "url": f"{LIST}/{photo.name}", "bytes": photo.size}
            for photo in photos
        ]
        return Page(HTTPStatus.OK, dict(_JSON), json.dumps({"photos": listed}).encode())

    async def _fetch(self, request: HttpRequest) -> Page:
        self._access.check(request, self._topic)
        name = request.path.removeprefix(f"{LIST}/")
        try:
            content = await self._photographer.read(name)
        except PhotoError as error:
            raise VideoRefusedError(HTTPStatus.INTERNAL_SERVER_ERROR, str(error)) from None
        if content is None:
            line = f"no photograph {name[:80]!r}: GET {LIST} lists them"
            raise VideoRefusedError(HTTPStatus.NOT_FOUND, line)
        kind = "application/json" if name.endswith(".json") else "image/jpeg"
        return Page(HTTPStatus.OK, {"Content-Type": kind, "Cache-Control": "no-cache"}, content)

    async def _take(self, request: HttpRequest) -> Page:
        # A ticket stands in addresses, which are logged and copied: it shows, and does not act.
        access = request.access if self._guarded else UNGUARDED
        if access is None:
            line = "a token is required: in the header Authorization: Bearer TOKEN"
            raise VideoRefusedError(HTTPStatus.UNAUTHORIZED, line, WWW_Authenticate="Bearer")
        if refusal := self._refusal(access):
            raise VideoRefusedError(HTTPStatus.FORBIDDEN, refusal)
        if too_soon := self._too_soon(access, request.address):
            status = HTTPStatus.TOO_MANY_REQUESTS
            raise VideoRefusedError(status, too_soon, Retry_After="1")
        try:
            taken = await self._photographer.take(access.holder or request.address)
        except PhotoError as error:
            raise VideoRefusedError(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from None
        self._note(request.address, access, taken.name, "")
        content = {
            "name": taken.name,
            "url": f"{LIST}/{taken.name}",
            "stamp": taken.stamp,
        }
        headers = {**_JSON, "Location": f"{LIST}/{taken.name}"}
        return Page(HTTPStatus.CREATED, headers, json.dumps(content).encode())

    async def _serve(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        access, name = self._connections.access(client), self._connections.name(client)
        refusal = "the caller has left" if access is None else self._refusal(access)
        if access is not None and not refusal:
            connection = self._connections.get(client)
            refusal = self._too_soon(access, connection.host if connection else name)
        if refusal:
            self._note(name, access, "", refusal)
            raise ServiceError(refusal)
        try:
            taken = await self._photographer.take(name)
        except PhotoError as error:
            self._note(name, access, "", str(error))
            raise ServiceError(str(error)) from None
        self._note(name, access, taken.name, "")
        return _response(taken)

    def _refused(self, request: HttpRequest, why: str) -> None:
        if request.method == "POST":
            self._note(request.address, request.access, "", why)
        else:
            self._access.refused(request, why)

    def _too_soon(self, access: Access, client: str) -> str:
        """Return why a client takes its photographs too often; empty if it does not."""
        return self._rate.refusal(access.holder or client, self._server.now)

    def _refusal(self, access: Access) -> str:
        """Return why somebody may not take photographs; empty if they may."""
        refusal = access.refusal("call", SERVICE)
        if refusal is None and not self._may_take(access):
            refusal = f"role {access.role} may not drive, and so takes no photographs"
        return refusal or ""


def _response(taken: TakenPhoto) -> dict[str, Any]:
    stamp = {"sec": taken.stamp // _SECOND, "nanosec": taken.stamp % _SECOND}
    return {"success": True, "name": taken.name, "message": f"stored {taken.name}", "stamp": stamp}
