"""The services of ``--lan`` by which people share a robot: links, tokens of devices, their list, and their end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

from teleop import clock
from teleop.console.lan.qr_code import qr_picture
from teleop.console.lan.token_book import ListedToken, TokenBook
from teleop.errors import SettingError
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.name_services import clean_name
from teleop.robot.serving.page_invitation import page_addresses
from teleop.robot.serving.server_setup import ROLES, address_of
from teleop.rosbridge.auth.credentials import read_credentials
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.server.server import Server

_LONGEST: Final = 30 * 86_400.0
"""Longest life of a link [s]; who stays longer opens a new one."""


class ShareServices:
    """Serves them; who may call which is a rule of the roles."""

    def __init__(
        self,
        server: Server,
        book: TokenBook,
        addresses: Callable[[], list[str]],
        audit: AuditLog | None,
    ) -> None:
        """Offer the services.

        Args:
            server: The robot's server, whose tokens are those of the list.
            book: The list.
            addresses: Returns the addresses of the console page, the one to prefer first.
            audit: Log of what clients do to the robot.
        """
        self._protocol, self._book, self._addresses = server.protocol, book, addresses
        self._audit = audit
        for name, kind, handler in (
            ("/teleop/share", "Share", self._share),
            ("/teleop/own_token", "OwnToken", self._own_token),
            ("/teleop/tokens", "Tokens", self._tokens),
            ("/teleop/revoke_token", "RevokeToken", self._revoke),
        ):
            wrapped = server.async_handlers.wrap(handler)
            self._protocol.services.serve(name, f"farsteer_msgs/srv/{kind}", wrapped)

    async def _share(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        caller, role, seconds = self._caller(client), request["role"], float(request["seconds"])
        problem = ""
        if role not in (Role.VIEW, Role.OPERATE):
            problem = f"role must be view or operate, got {role[:80]!r}"
        elif caller.access and Role(role).rank > caller.access.role.rank:
            problem = f"you have role {caller.access.role}, and cannot share {role}"
        elif not (math.isfinite(seconds) and 1.0 <= seconds <= _LONGEST):
            problem = f"seconds must be from 1 to {_LONGEST:g}, got {seconds:g}"
        token = made = None
        if not problem:
            until = _now() + timedelta(seconds=round(seconds))
            name = clean_name(request["name"]) or f"link of {clean_name(caller.name)}"
            made, token, problem = await self._made(name, role, until, link=True)
        self._record(caller, "share", made, problem)
        link = f"{self._addresses()[0]}#token={token}"
        return {
            "success": not problem,
            "message": problem,
            "name": made.name if made else "",
            "link": link if token else "",
            "qr": qr_picture(link) if token else "",
        }

    async def _own_token(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        caller = self._caller(client)
        access, token, made = caller.access, None, None
        listed = [one for one in await asyncio.to_thread(self._book.tokens, _now()) if one.link]
        link = next((one for one in listed if access and one.name == access.holder), None)
        if link is None or access is None or not access.link:
            problem = "your token is not that of a link: it is your own already"
        else:
            name = clean_name(request["device"]) or f"device of {link.name}"
            made, token, problem = await self._made(name, link.role, link.until)
        self._record(caller, "own token", made, problem)
        return {"success": not problem, "message": problem, "token": token or ""}

    async def _tokens(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        time = _now()
        listed = await asyncio.to_thread(self._book.tokens, time)
        return {
            "names": [token.name for token in listed],
            "roles": [token.role for token in listed],
            "seconds": [
                -1.0 if token.until is None else (token.until - time).total_seconds()
                for token in listed
            ],
            "links": [token.link for token in listed],
        }

    async def _revoke(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        caller, name, problem = self._caller(client), request["name"], ""
        listed = await asyncio.to_thread(self._book.tokens, _now())
        token = next((one for one in listed if one.name == name), None)
        if caller.access and name == caller.access.holder:
            problem = "that is your own token: another one can revoke it"
        elif token and caller.access and Role(token.role).rank > caller.access.role.rank:
            problem = f"{name} has role {token.role}, and you have {caller.access.role}"
        else:
            try:
                await asyncio.to_thread(self._book.remove, name, _now())
                await self._renew()
            except SettingError as error:
                problem = str(error)
        self._record(caller, "revoke", token, problem)
        return {"success": not problem, "message": problem or f"{name} has ended"}

    async def _made(
        self, name: str, role: str, until: datetime | None, *, link: bool = False
    ) -> tuple[ListedToken | None, str | None, str]:
        """Make a token that the server knows; return its entry and its text, or why there is none."""
        try:
            made, token = await asyncio.to_thread(
                self._book.add, name, role, _now(), until, link=link
            )
        except SettingError as error:
            return None, None, str(error)
        await self._renew()
        return made, token, ""

    async def _renew(self) -> None:
        """Have the server go by the list as it is now, and not only once its file is found changed."""
        credentials = await asyncio.to_thread(read_credentials, self._book.file, ROLES)
        self._protocol.update_credentials(credentials.valid_at(clock.unix_seconds()))

    def _caller(self, client: int) -> Connection:
        connection = self._protocol.connections.get(client)
        if connection is None:
            raise ServiceError("the caller has left")
        return connection

    def _record(self, who: Connection, what: str, token: ListedToken | None, problem: str) -> None:
        if self._audit is not None:
            until = token.until.isoformat() if token and token.until else ""
            given = (token.name, token.role, until) if token else ("", "", "")
            self._audit.token(who.name, what, *given, refused=problem)


def offer_sharing(server: Server, tokens: Path, audit: AuditLog | None) -> None:
    """Offer the services, unless the tokens are in a file that a person keeps."""
    book = TokenBook(tokens)
    if book.kept:
        ShareServices(server, book, lambda: page_addresses(address_of(server)), audit)


def _now() -> datetime:
    return datetime.fromtimestamp(clock.unix_seconds(), UTC)
