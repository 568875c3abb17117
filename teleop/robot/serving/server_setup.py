"""The rosbridge server of a robot, as the settings of ``farsteer serve`` describe it."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from teleop import clock
from teleop.link.command_age import RoundTrips
from teleop.link.emulation import EmulatedLinks, LinkEmulation
from teleop.robot.audit.audit_file import AuditFile
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Role, RoleRules
from teleop.rosbridge.auth.tls import tls_context
from teleop.rosbridge.auth.token_file import TokenFile, TokenWatch
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server

ROLES: Final[Mapping[Role, RoleRules]] = {
    **DEFAULT_RULES,
    # Everybody who can see the robot can stop it, and learn about itself and its link.
    Role.VIEW: replace(
        DEFAULT_RULES[Role.VIEW],
        call=(
            *DEFAULT_RULES[Role.VIEW].call,
            *("/teleop/estop", "/teleop/session", "/teleop/link", "/teleop/ask", "/video/ticket"),
            *("/teleop/introduce", "/teleop/clients", "/teleop/own_token"),
        ),
    ),
}
"""What each role may do with a robot unless the token file has other rules."""


def token_file(config: ServeConfig) -> TokenFile | None:
    """Return the file of tokens, if one is given.

    Raises:
        ServerError: If it cannot be read.
    """
    return None if config.tokens is None else TokenFile(config.tokens, clock.unix_seconds, ROLES)


def build_server(
    config: ServeConfig,
    tokens: TokenFile | None,
    now: Callable[[], int],
    *,
    authenticator: Authenticator | None = None,
    link: EmulatedLinks | None = None,
) -> Server:
    """Return a server that does not listen yet.

    Args:
        config: Settings.
        tokens: Tokens of those who may connect; None if anybody may.
        now: Returns the time of its clock [ns].
        authenticator: Verifies tokens in the place of those.
        link: Emulates the links of clients in the place of that of the settings.

    Raises:
        ServerError: If the certificate or an origin is invalid.
    """
    if authenticator is None and tokens is not None:
        authenticator = Authenticator(tokens.credentials, clock.unix_seconds)
    if link is None and config.link_config is not None:
        stepping = "/sim/step" if config.lockstep else ""
        link = LinkEmulation(config.link_config, clock_service=stepping)
    protocol = Protocol(
        registry(config.messages),
        limits=ClientLimits.unhurried() if config.lockstep else ClientLimits(),
        ros_version="ros1" if config.ros1 else "ros2",
        authenticator=authenticator,
        frame_delay=link,
    )
    if link is not None:
        protocol.observers.add(link)
    return Server(
        protocol,
        config.listening_host,
        config.port,
        clock=now,
        lockstep=config.lockstep,
        origins=config.origins,
        tls=_tls(config),
    )


def round_trips_of(server: Server) -> Callable[[int], RoundTrips | None]:
    """Return a function for the round trips of a server's clients, to be called for those that drive.

    From its first call on they are measured, and what the client sees is kept from getting old. In lockstep only those of an emulated link are known.
    """

    def round_trips(client: int) -> RoundTrips | None:
        server.watch_round_trip(client)
        server.keep_fresh(client)
        trip = server.round_trip(client)
        if trip is None:
            return None if server.lockstep else RoundTrips()
        return RoundTrips(
            trip.last, trip.unanswered, trip.longest, trip.sent_at, server.backlog(client)
        )

    return round_trips


def offer_map(server: Server, map_file: Path | None) -> None:
    """Offer the map over HTTP on the same port, as ``/map.ply`` and by its hash."""
    if map_file is not None:
        body = map_file.read_bytes()
        digest = server.pages.add_file("/map.ply", body)
        server.pages.add_file(f"/map/{digest}.ply", body, immutable=True)


def offer_surfaces(server: Server, surfaces: bytes) -> None:
    """Offer the map's surfaces, a GLB file, as ``/map.glb``."""
    server.pages.add_file("/map.glb", surfaces, "model/gltf-binary", compress=True)


def address_of(server: Server, *, page: bool = False, streams: str = "") -> Address:
    """Return where clients find a server that has started.

    Args:
        server: The server.
        page: Whether it has the console.
        streams: Address of the list of video streams; empty without a camera.
    """
    gate = server.protocol.authenticator
    drives = gate is None or (gate.anonymous is not None and gate.anonymous.role is not Role.VIEW)
    return Address(
        server.url,
        server.host,
        server.port,
        server.encrypted,
        not drives,
        server.lockstep,
        page,
        streams,
    )


@contextmanager
def audit_log(
    config: ServeConfig, server: Server, scene: str, stamp: Callable[[], int]
) -> Iterator[AuditLog | None]:
    """Keep the audit log, if one is wanted.

    Args:
        config: Settings.
        server: The server whose connections are logged.
        scene: Name of the scene, for the first line.
        stamp: Returns the time of the robot's clock [ns].

    Raises:
        AuditError: If it cannot be written.
    """
    if config.audit is None:
        yield None
        return
    first = {"time": clock.utc_text(), "stamp": stamp(), "what": "begin"}
    file = AuditFile(config.audit, {**first, "scene": scene, "host": config.listening_host})
    audit = AuditLog(file.add, server, stamp=stamp, wall=clock.utc_text)
    try:
        yield audit
    finally:
        audit.end()
        file.close()


def watch_tokens(tokens: TokenFile, server: Server, audit: AuditLog | None) -> TokenWatch:
    """Read the token file again when it changes; the caller closes the watch."""
    loop = asyncio.get_running_loop()

    def renew(credentials: Credentials) -> None:
        gone = [
            server.protocol.connections.name(client)
            for client in server.protocol.update_credentials(credentials)
        ]
        if audit is not None:
            audit.tokens_renewed(gone)

    def renewed(credentials: Credentials) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(renew, credentials)

    return TokenWatch(tokens, renewed)


def _tls(config: ServeConfig) -> ssl.SSLContext | None:
    if config.tls_cert is None or config.tls_key is None:
        return None
    return tls_context(config.tls_cert, config.tls_key)
