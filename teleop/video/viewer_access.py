"""Who may see the robot's pictures, and where a ticket is got."""

from __future__ import annotations

import json
from http import HTTPStatus
from typing import Any, Final

from teleop.rosbridge.auth.permissions import UNGUARDED, Access
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.http_handlers import HttpHandlers, HttpRequest, Route
from teleop.rosbridge.server.http_pages import Page
from teleop.video.refusal import Refused, VideoRefusedError, answering
from teleop.video.tickets import VALIDITY, Tickets

TICKET_SERVICE: Final = "/video/ticket"
"""Service that answers with a ticket, as its message."""

TICKET_PAGE: Final = "/video_ticket"
"""Path at which a POST answers with a ticket."""

_HOW: Final = (
    "a token is required: in the header Authorization: Bearer TOKEN,"
    f" or as ?ticket= with what POST {TICKET_PAGE} or the service {TICKET_SERVICE} answered"
)


class ViewerAccess:
    """Decides who may see pictures: who may subscribe to their topic, by token or by ticket."""

    def __init__(
        self,
        protocol: Protocol,
        tickets: Tickets,
        refused: Refused = lambda request, why: None,
    ) -> None:
        """Offer the ticket's service.

        Args:
            protocol: The protocol of the robot's server.
            tickets: The tickets.
            refused: Called when somebody is refused pictures or a ticket.
        """
        self._protocol, self._tickets = protocol, tickets
        self.refused = refused
        """Called when somebody is refused pictures, photographs or a ticket."""

        protocol.services.serve(TICKET_SERVICE, "std_srvs/srv/Trigger", self._ticket_service)

    def add_page(self, handlers: HttpHandlers) -> None:
        """Answer POST at the page of tickets."""
        route = Route(
            answering(self._ticket_page, self.refused), methods=("POST",), own_pages_only=True
        )
        handlers.add(TICKET_PAGE, route)

    def check(self, request: HttpRequest, topic: str) -> Access:
        """Return the permissions of somebody who may see the pictures of a topic.

        Raises:
            VideoRefusedError: If they may not.
        """
        access = UNGUARDED
        if self._protocol.authenticator is not None:
            ticket = request.query.get("ticket")
            found = request.access if ticket is None else self._tickets.find(ticket)
            if found is None:
                line = (
                    _HOW if ticket is None else f"the ticket is not valid, or not any more; {_HOW}"
                )
                raise VideoRefusedError(HTTPStatus.UNAUTHORIZED, line, WWW_Authenticate="Bearer")
            access = found
        if not self.still(access):
            raise VideoRefusedError(HTTPStatus.UNAUTHORIZED, "the token was withdrawn")
        if refusal := access.refusal("subscribe", topic):
            raise VideoRefusedError(HTTPStatus.FORBIDDEN, refusal)
        return access

    def still(self, access: Access) -> bool:
        """Return whether permissions that somebody was given hold now."""
        authenticator = self._protocol.authenticator
        return authenticator is None or authenticator.credentials.still_grant(access)

    async def _ticket_page(self, request: HttpRequest) -> Page:
        access = UNGUARDED if self._protocol.authenticator is None else request.access
        if access is None:
            raise VideoRefusedError(HTTPStatus.UNAUTHORIZED, _HOW, WWW_Authenticate="Bearer")
        body = {"ticket": self._tickets.issue(access), "valid_seconds": VALIDITY}
        fields = {"Content-Type": "application/json", "Cache-Control": "no-store"}
        return Page(HTTPStatus.OK, fields, json.dumps(body).encode())

    def _ticket_service(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        access = self._protocol.connections.access(client)
        if access is None:
            raise ServiceError("the caller has left")
        return {"success": True, "message": self._tickets.issue(access)}
