"""Why a request for pictures is refused, in one line."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import wraps
from http import HTTPStatus
from typing import Final, TypeAlias

from teleop.rosbridge.server.handled_request import text_page
from teleop.rosbridge.server.http_handlers import Handler, HttpRequest, Stream
from teleop.rosbridge.server.http_pages import Page


class VideoRefusedError(Exception):
    """A request that is refused."""

    def __init__(self, status: HTTPStatus, line: str, **headers: str) -> None:
        """Refuse a request.

        Args:
            status: Status of the response.
            line: Why, and what would have worked.
            headers: Further headers, with underscores for hyphens.
        """
        super().__init__(line)
        self.page = text_page(status, line, **headers)
        """The response."""


Refused: TypeAlias = Callable[[HttpRequest, str], object]
"""Takes a request that was refused to its sender, and the reason."""

_WHO_NOT_WHAT: Final = (
    HTTPStatus.UNAUTHORIZED,
    HTTPStatus.FORBIDDEN,
    HTTPStatus.TOO_MANY_REQUESTS,
    HTTPStatus.SERVICE_UNAVAILABLE,
)
"""Refusals for who asks or how much is wanted; others are of requests that nobody could be granted."""


def answering(
    handle: Callable[[HttpRequest], Awaitable[Page | Stream]],
    refused: Refused = lambda request, why: None,
) -> Handler:
    """Return a handler that answers a refusal with its line, and keeps all answers on the robot's own pages.

    Args:
        handle: Answers a request, or refuses it.
        refused: Called when it refuses somebody what others are granted.
    """

    @wraps(handle)
    async def answer(request: HttpRequest) -> Page | Stream:
        try:
            answered = await handle(request)
        except VideoRefusedError as refusal:
            answered = refusal.page
            if refusal.page.status in _WHO_NOT_WHAT:
                refused(request, str(refusal))
        if isinstance(answered, Page):
            return Page(answered.status, {**answered.headers, **OWN_PAGES_ONLY}, answered.body)
        return answered

    return answer


OWN_PAGES_ONLY = {
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}
"""Headers by which browsers show the content on pages of this server and no others."""
