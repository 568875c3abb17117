"""Serve a robot until told to stop: any rosbridge client may drive it."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import ssl
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from localization.logs.mcap_log import ReadingsWriter
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import config_metadata
from localization.types import Hint
from robot_sim import Simulation, World
from teleop import clock as pacing
from teleop.interfaces import registry
from teleop.robot import topics
from teleop.robot.audit_file import AuditFile
from teleop.robot.audit_log import Audit
from teleop.robot.robot import Robot, Snapshot
from teleop.robot.robot_options import Outfit
from teleop.robot.rosbridge_adapter import Host, Stepper
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credentials
from teleop.rosbridge.auth.origins import LOOPBACK
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Role, RoleRules
from teleop.rosbridge.auth.tls import tls_context
from teleop.rosbridge.auth.token_file import TokenFile, TokenWatch
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server

ROLES: Final[Mapping[Role, RoleRules]] = {
    **DEFAULT_RULES,
    # Whoever sees that something goes wrong can stop it.
    Role.VIEW: replace(
        DEFAULT_RULES[Role.VIEW], call=(*DEFAULT_RULES[Role.VIEW].call, "/teleop/estop")
    ),
}
"""What each role may do with a robot unless the file of tokens says otherwise."""


@dataclass(frozen=True, slots=True)
class ServeConfig:
    """How the robot is served."""

    host: str = "127.0.0.1"
    """Address to listen on; others than loopback are open to the network."""
    port: int = 9090
    """0 takes a free one."""
    seed: int = 0
    """Of sensor noise."""
    placed: bool = True
    """Whether the robot knows where it starts; else it waits for a hint on ``/initialpose``."""
    record: Path | None = None
    """Where to write the log of readings (MCAP)."""
    lockstep: bool = False
    """Whether time stands still until a client steps it (``/sim/step``)."""
    outfit: Outfit = field(default_factory=Outfit)
    """Of the robot; its world is built by the caller."""
    messages: tuple[Path, ...] = ()
    """Folders of further ``.msg``, ``.srv`` and ``.action`` files, for topics among clients."""
    ros1: bool = False
    """Whether to name types and write ``cbor-raw`` as ROS 1 does, for clients that know no other."""
    tokens: Path | None = None
    """File of those who may connect, see ``docs/security.md``; without it everybody may."""
    origins: tuple[str, ...] = ()
    """Web pages that may connect, besides those of this machine (``https://lab.example``)."""
    tls_cert: Path | None = None
    """Certificate, with those of its issuers; needs ``tls_key``."""
    tls_key: Path | None = None
    """Its private key."""
    audit: Path | None = None
    """File to which lines are added that say who did what."""

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise ValueError(f"port must be 0 to 65535, got {self.port}")
        if self.seed < 0:
            raise ValueError(f"seed must be >= 0, got {self.seed}")
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ValueError("TLS needs both, a certificate and its key")


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
        world: the scene.
        cloud: its prebuilt cloud.
        config: where to listen, and the rest.
        cache: folder for derived files.
        map_file: what is offered as ``/map.ply`` over HTTP, on the same port.
        ready: called once clients can connect.
        stop: ends serving.

    Returns:
        The real-time factor that was kept; 0 in lockstep, which has none.

    Raises:
        ServerError: if the port is taken, or tokens, certificate or origins are no good.
        AuditError: if the audit log cannot be written.
    """
    tls, tokens = _tls(config), _tokens(config)
    gate = None if tokens is None else Authenticator(tokens.credentials, pacing.unix_seconds)
    simulation = Simulation(world, seed=config.seed, config=config.outfit.simulation())
    localizer = Localizer(prepare(cloud, cache=cache), simulation.mounts)
    robot = Robot(simulation, localizer)
    protocol = Protocol(
        registry(config.messages),
        limits=ClientLimits.unhurried() if config.lockstep else ClientLimits(),
        ros_version="ros1" if config.ros1 else "ros2",
        authenticator=gate,
    )
    clock: Callable[[], int] = pacing.monotonic
    if config.lockstep:
        clock = lambda: simulation.stamp  # noqa: E731
    server = Server(
        protocol,
        config.host,
        config.port,
        clock=clock,
        lockstep=config.lockstep,
        origins=config.origins,
        tls=tls,
    )
    file = _audit_file(config, simulation)
    audit = None
    if file is not None:
        audit = Audit(file.add, server, stamp=lambda: simulation.stamp, wall=pacing.utc_text)
    log = _log(config, simulation, cloud)

    def record(snapshot: Snapshot) -> None:
        if log is not None:
            for reading in snapshot.readings:
                log.write(reading, snapshot.stamp)

    if map_file is not None:
        _offer(server, map_file)
    host = Host(robot, server, cloud, audit=audit, sinks=(record,))
    if config.placed:
        # On its mark, as a robot is that was put where it always starts.
        host.post(Hint(0, simulation.truth().map_from_base, np.zeros((6, 6))))
    stop = stop or asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            loop.add_signal_handler(number, stop.set)
    watch = None if tokens is None else _watch(tokens, server, audit)
    try:
        await server.start()
        ready(server)
        if not config.lockstep:
            return await pacing.real_time(host.tick, stop)
        Stepper(host)
        await stop.wait()
        return 0.0
    finally:
        if watch is not None:
            watch.close()
        await server.close()
        if log is not None:
            log.close()
        if audit is not None:
            audit.end()
        if file is not None:
            file.close()


def _tls(config: ServeConfig) -> ssl.SSLContext | None:
    if config.tls_cert is None or config.tls_key is None:
        return None
    return tls_context(config.tls_cert, config.tls_key)


def _tokens(config: ServeConfig) -> TokenFile | None:
    return None if config.tokens is None else TokenFile(config.tokens, ROLES)


def _watch(tokens: TokenFile, server: Server, audit: Audit | None) -> TokenWatch:
    """Have the file of tokens read again when it changes, or by SIGHUP."""
    loop = asyncio.get_running_loop()

    def renew(keyring: Credentials) -> None:
        gone = [
            server.protocol.connections.name(client)
            for client in server.protocol.update_credentials(keyring)
        ]
        if audit is not None:
            audit.renewed(gone)

    def renewed(keyring: Credentials) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(renew, keyring)

    watch = TokenWatch(tokens, renewed)
    with contextlib.suppress(NotImplementedError, RuntimeError, ValueError, AttributeError):
        loop.add_signal_handler(signal.SIGHUP, watch.check_now)
    return watch


def _audit_file(config: ServeConfig, simulation: Simulation) -> AuditFile | None:
    if config.audit is None:
        return None
    first = {"time": pacing.utc_text(), "stamp": simulation.stamp, "what": "begin"}
    return AuditFile(config.audit, {**first, "scene": simulation.world.name, "host": config.host})


def _offer(server: Server, map_file: Path) -> None:
    server.pages.add_file("/map.ply", map_file.read_bytes())


def _log(config: ServeConfig, simulation: Simulation, cloud: Cloud) -> ReadingsWriter | None:
    if config.record is None:
        return None
    metadata = {
        "scene": simulation.world.name,
        "seed": str(config.seed),
        "map_sha256": cloud.sha256,
        **config_metadata(LocalizerConfig()),
    }
    radius = simulation.world.robot.rolling_radius
    return ReadingsWriter(config.record, simulation.mounts, metadata, wheel_radius=radius)


def greeting(server: Server, world: World, cloud: Cloud, map_path: Path) -> str:
    """Return what to print once clients can connect: address, map, topics, and a client that works."""
    names = ", ".join(t.name for t in topics.OUTPUTS)
    inputs = ", ".join(t.name for t in topics.INPUTS)
    lockstep = server.lockstep
    services = ", ".join(s.name for s in topics.SERVICES if lockstep or s.name != "/sim/step")
    how = _SNIPPET_INTRODUCED.format(snippet(server.port))
    if server.protocol.authenticator is not None or server.encrypted:
        how = _GUARDED
    return f"""\
{world.name} at {server.url}{_warning(server)}
map       {map_path}
          {len(cloud.points)} points, sha256 {cloud.sha256[:16]}...
topics    {names}
listens   {inputs}
services  {services}

{_LOCKSTEP if lockstep else how}
Ctrl-C ends."""


def _warning(server: Server) -> str:
    """Return what to be warned of where others reach the address."""
    if server.host in LOOPBACK:
        return ""
    gate = server.protocol.authenticator
    if gate is None or (gate.anonymous is not None and gate.anonymous.role is not Role.VIEW):
        return "\nwarning: anybody who reaches this address can drive the robot; --tokens asks who"
    if not server.encrypted:
        return (
            "\nwarning: tokens can be overheard on the way here; --tls-cert and --tls-key encrypt"
        )
    return ""


_GUARDED = "docs/security.md says how clients bring a token and whom they trust"

_SNIPPET_INTRODUCED = """\
drive it with roslibpy (pip install roslibpy):

{}"""

_LOCKSTEP = "time stands still until a client calls /sim/step; docs/teleoperation.md has an example"


def snippet(port: int) -> str:
    """Return ten lines of roslibpy that drive forward, print the pose and receive a cloud."""
    return f"""\
import time, roslibpy
ros = roslibpy.Ros("127.0.0.1", {port})
ros.run()
pose = roslibpy.Topic(ros, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", throttle_rate=500)
pose.subscribe(lambda m: print("pose", m["pose"]["pose"]["position"]))
cloud = roslibpy.Topic(ros, "/local_cloud", "sensor_msgs/PointCloud2", throttle_rate=500)
cloud.subscribe(lambda m: print("cloud of", m["width"], "points"))
joy = roslibpy.Topic(ros, "/joy", "sensor_msgs/Joy")
for forward in [0.0] + [1.0] * 30:  # a neutral stick first, then three seconds ahead
    joy.publish({{"axes": [0.0, forward], "buttons": [0, 0, 0, 0, 1]}})
    time.sleep(0.1)
ros.terminate()
"""
