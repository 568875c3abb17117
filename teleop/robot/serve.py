"""Serving a robot, in real time or in lockstep, to any rosbridge client."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import ssl
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from localization.logs.mcap_writer import ReadingsWriter
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import config_metadata
from localization.types import Hint
from robot_sim import Simulation, World
from teleop import clock
from teleop.interfaces import registry
from teleop.robot.audit.audit_file import AuditFile
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.robot import Robot
from teleop.robot.robot_options import slip_bursts
from teleop.robot.rosbridge_adapter import RosbridgeAdapter, TickObserver
from teleop.robot.serve_config import ServeConfig
from teleop.robot.tick_record import TickRecord
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
    # Everybody who can see the robot can stop it.
    Role.VIEW: replace(
        DEFAULT_RULES[Role.VIEW], call=(*DEFAULT_RULES[Role.VIEW].call, "/teleop/estop")
    ),
}
"""What each role may do with a robot unless the token file has other rules."""


async def serve(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    *,
    cache: Path | None = None,
    map_file: Path | None = None,
    ready: Callable[[Server], None] = lambda server: None,
    stop: asyncio.Event | None = None,
) -> float:
    """Serve in real time or in lockstep, until Ctrl-C or until ``stop`` is set.

    Args:
        world: The scene.
        cloud: Its prebuilt cloud.
        config: All other settings.
        cache: Folder for derived files.
        map_file: File that is offered as ``/map.ply`` over HTTP, on the same port.
        ready: Called once clients can connect.
        stop: Ends serving.

    Returns:
        The real-time factor that was achieved; 0 in lockstep, which has none.

    Raises:
        ServerError: If the port is in use, or tokens, certificate or origins are invalid.
        AuditError: If the audit log cannot be written.
    """
    stop = stop or asyncio.Event()
    tls, tokens = _tls(config), _tokens(config)
    robot = _robot(world, cloud, config, cache)
    server = _server(robot.simulation, config, tls, tokens)
    with ExitStack() as cleanup:
        audit = cleanup.enter_context(_audit(config, robot.simulation, server))
        observers = cleanup.enter_context(_log(config, robot.simulation, cloud))
        if map_file is not None:
            _offer(server, map_file)
        adapter = RosbridgeAdapter(robot, server, cloud, audit=audit, observers=observers)
        if not config.lost:
            # The robot knows the pose at which it is always switched on.
            pose = robot.simulation.truth().map_from_base
            adapter.post(Hint(0, pose, np.zeros((6, 6))))
        _stop_on_signals(stop)
        try:
            with nullcontext() if tokens is None else closing(_watch(tokens, server, audit)):
                await server.start()
                ready(server)
                return await _run(adapter, config, stop)
        finally:
            await server.close()


async def _run(adapter: RosbridgeAdapter, config: ServeConfig, stop: asyncio.Event) -> float:
    """Tick until ``stop`` is set; return the real-time factor, or 0 in lockstep."""
    if not config.lockstep:
        return await clock.real_time(adapter.tick, stop)
    LockstepService(adapter)
    await stop.wait()
    return 0.0


def _robot(world: World, cloud: Cloud, config: ServeConfig, cache: Path | None) -> Robot:
    simulation = Simulation(
        world, seed=config.seed, config=config.robot.simulation(slip_bursts(config.slip))
    )
    return Robot(simulation, Localizer(prepare(cloud, cache=cache), simulation.mounts))


def _server(
    simulation: Simulation,
    config: ServeConfig,
    tls: ssl.SSLContext | None,
    tokens: TokenFile | None,
) -> Server:
    protocol = Protocol(
        registry(config.messages),
        limits=ClientLimits.unhurried() if config.lockstep else ClientLimits(),
        ros_version="ros1" if config.ros1 else "ros2",
        authenticator=None
        if tokens is None
        else Authenticator(tokens.credentials, clock.unix_seconds),
    )
    return Server(
        protocol,
        config.host,
        config.port,
        clock=(lambda: simulation.stamp) if config.lockstep else clock.monotonic,
        lockstep=config.lockstep,
        origins=config.origins,
        tls=tls,
    )


def _tls(config: ServeConfig) -> ssl.SSLContext | None:
    if config.tls_cert is None or config.tls_key is None:
        return None
    return tls_context(config.tls_cert, config.tls_key)


def _tokens(config: ServeConfig) -> TokenFile | None:
    return None if config.tokens is None else TokenFile(config.tokens, ROLES)


def _offer(server: Server, map_file: Path) -> None:
    server.pages.add_file("/map.ply", map_file.read_bytes())


def _stop_on_signals(stop: asyncio.Event) -> None:
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        # Windows, and loops in other threads than the main one, have no signal handlers.
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            loop.add_signal_handler(number, stop.set)


def _watch(tokens: TokenFile, server: Server, audit: AuditLog | None) -> TokenWatch:
    """Read the token file again when it changes, and on SIGHUP."""
    loop = asyncio.get_running_loop()

    def renew(keyring: Credentials) -> None:
        gone = [
            server.protocol.connections.name(client)
            for client in server.protocol.update_credentials(keyring)
        ]
        if audit is not None:
            audit.tokens_renewed(gone)

    def renewed(keyring: Credentials) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(renew, keyring)

    watch = TokenWatch(tokens, renewed)
    with contextlib.suppress(NotImplementedError, RuntimeError, ValueError, AttributeError):
        loop.add_signal_handler(signal.SIGHUP, watch.check_now)
    return watch


@contextmanager
def _audit(
    config: ServeConfig, simulation: Simulation, server: Server
) -> Iterator[AuditLog | None]:
    """Keep the audit log, if one is wanted."""
    if config.audit is None:
        yield None
        return
    first = {"time": clock.utc_text(), "stamp": simulation.stamp, "what": "begin"}
    file = AuditFile(config.audit, {**first, "scene": simulation.world.name, "host": config.host})
    audit = AuditLog(file.add, server, stamp=lambda: simulation.stamp, wall=clock.utc_text)
    try:
        yield audit
    finally:
        audit.end()
        file.close()


@contextmanager
def _log(
    config: ServeConfig, simulation: Simulation, cloud: Cloud
) -> Iterator[tuple[TickObserver, ...]]:
    """Record the readings, if that is wanted."""
    if config.record is None:
        yield ()
        return
    metadata = {
        "scene": simulation.world.name,
        "seed": str(config.seed),
        "map_sha256": cloud.sha256,
        **config_metadata(LocalizerConfig()),
    }
    radius = simulation.world.robot.rolling_radius
    with ReadingsWriter(config.record, simulation.mounts, metadata, wheel_radius=radius) as log:

        def write(tick: TickRecord) -> None:
            for reading in tick.readings:
                log.write(reading, tick.stamp)

        yield (write,)
