"""Serving a robot, in real time or in lockstep, to any rosbridge client."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from localization.logs.mcap_writer import ReadingsWriter
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import config_metadata
from localization.types import Hint
from robot_sim import Simulation, World
from teleop.console.page_files import offer_page
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.drive import Drive
from teleop.robot.inbox import PoseHint
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.drive_process import DriveProcess
from teleop.robot.real_time.process_messages import (
    ESTIMATE_BOUND,
    TALK_BOUND,
    EstimateSetup,
    TalkSetup,
)
from teleop.robot.robot import Robot
from teleop.robot.safety.control_state import SafetyConfig
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits
from teleop.robot.serving.address import Address
from teleop.robot.serving.camera_choice import stepped_camera
from teleop.robot.serving.robot_options import slip_bursts
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.serving.server_setup import (
    address_of,
    audit_log,
    build_server,
    offer_map,
    round_trips_of,
    token_file,
    watch_tokens,
)
from teleop.robot.stepped_robot import SteppedRobot, TickObserver
from teleop.robot.tick_record import TickRecord
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.topic_table import Interface, latched_messages
from teleop.rosbridge.server.server import Server

if TYPE_CHECKING:  # imported only where there is a camera
    from teleop.robot.cameras.stepped_camera import SteppedCamera
    from teleop.robot.serving.camera_start import CameraStart
    from teleop.robot.video.robot_video import RobotVideo


def start_talk(pictures: int | None = None) -> ChildProcess:
    """Start the process that talks with clients; ``pictures`` is where those of a camera arrive."""
    return ChildProcess("teleop.robot.real_time.talk_process", TALK_BOUND, pictures)


def start_estimate() -> ChildProcess:
    """Start the process that localises the robot."""
    return ChildProcess("teleop.robot.real_time.estimate_process", ESTIMATE_BOUND)


async def serve(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    *,
    cache: Path | None = None,
    map_file: Path | None = None,
    ready: Callable[[Address], None] = lambda address: None,
    stop: asyncio.Event | None = None,
) -> float:
    """Serve in real time or in lockstep, until Ctrl-C or until ``stop`` is set.

    Args:
        world: The scene.
        cloud: Its prebuilt cloud.
        config: All other settings.
        cache: Folder for derived files.
        map_file: File that is offered over HTTP, on the same port, as ``/map.ply`` and by its hash.
        ready: Called once clients can connect.
        stop: Ends serving.

    Returns:
        The real-time factor that was achieved; 0 in lockstep, which has none.

    Raises:
        ServerError: If the port is in use, or tokens, certificate or origins are invalid.
        AuditError: If the audit log cannot be written.
        CameraError: If there is no camera of that name.
    """
    stop = stop or asyncio.Event()
    _stop_on_signals(stop)
    config = replace(config, name=config.name or world.robot.name)
    if config.lockstep:
        drive = _drive(world, config)
        await _serve_in_lockstep(drive, cloud, config, cache, map_file, ready, stop)
        return 0.0
    return await _serve_in_real_time(world, cloud, config, cache, map_file, ready, stop)


async def _serve_in_lockstep(
    drive: Drive,
    cloud: Cloud,
    config: ServeConfig,
    cache: Path | None,
    map_file: Path | None,
    ready: Callable[[Address], None],
    stop: asyncio.Event,
) -> None:
    """Serve in this process, with the robot's own time."""
    simulation = drive.simulation
    localizer = Localizer(prepare(cloud, cache=cache), simulation.mounts)
    robot = Robot(simulation, localizer, drive.safety)
    tokens = token_file(config)
    server = build_server(config, tokens, lambda: simulation.stamp)
    with ExitStack() as cleanup:
        audit = cleanup.enter_context(
            audit_log(config, server, simulation.world.name, lambda: simulation.stamp)
        )
        observers = cleanup.enter_context(_log(config, simulation, cloud))
        offer_map(server, map_file)
        page = offer_page(server.pages, encrypted=server.encrypted)
        camera = stepped_camera(simulation, config.camera, server)
        if camera is not None:
            cleanup.enter_context(closing(camera))
            draw = camera.ticked
            observers = (*observers, lambda tick: draw())
        latched = _latched(cloud, simulation, camera=camera is not None)
        video = None
        if camera is not None:
            video = _video(server, camera, config, latched, audit)
            observers = (*observers, video.ticked)
        adapter = RosbridgeAdapter(
            server,
            latched,
            undo_memory=localizer.config.undo_memory,
            round_trips=round_trips_of(server),
            audit=audit,
        )
        if not config.lost:
            adapter.wishes.post(_start_pose(simulation))
        LockstepService(SteppedRobot(robot, adapter, observers=observers))
        if tokens is not None:
            watch = cleanup.enter_context(closing(watch_tokens(tokens, server, audit)))
            _on_hangup(watch.check_now)
        try:
            await server.start()
            streams = "" if video is None else await video.start()
            ready(address_of(server, page=page, streams=streams))
            await stop.wait()
        finally:
            if video is not None:
                await video.close()
            await server.close()


async def _serve_in_real_time(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    cache: Path | None,
    map_file: Path | None,
    ready: Callable[[Address], None],
    stop: asyncio.Event,
) -> float:
    """Drive in this process; talk and estimate in processes of their own."""
    # They load their libraries while the robot is built here.
    camera = _start_camera(world, config)
    pictures = None if camera is None else camera.link
    talking, estimating = start_talk(pictures), start_estimate()
    try:
        drive = _drive(world, config)
        simulation = drive.simulation
        estimate = EstimateSetup(
            cloud,
            simulation.mounts,
            cache,
            config.record,
            _metadata(config, simulation, cloud),
            simulation.world.robot.rolling_radius,
        )
        # Preparing a map may take long; clients connect when all is there.
        await asyncio.to_thread(estimating.begin(estimate).ready)
        feed = None if camera is None else await asyncio.to_thread(camera.feed, simulation)
        talk = TalkSetup(
            config,
            simulation.world.name,
            _latched(cloud, simulation, camera=feed is not None),
            map_file,
            LocalizerConfig().undo_memory,
            None if camera is None else camera.model,
        )
        process = DriveProcess(
            drive,
            talking.begin(talk),
            estimating,
            restart_talk=lambda: start_talk(pictures).begin(talk),
            restart_estimate=lambda: start_estimate().begin(replace(estimate, record=None)),
            camera=feed,
        )
    except BaseException:
        if camera is not None:
            camera.kill()
        talking.kill()
        estimating.kill()
        raise
    try:
        address = await asyncio.to_thread(process.ready)
        # A server that is started again listens where clients know it.
        talk = replace(talk, config=replace(config, port=address.port))
        if not config.lost:
            process.post(_start_pose(simulation))
        _on_hangup(process.read_tokens)
        ready(address)
        ended = threading.Event()
        driving = asyncio.create_task(asyncio.to_thread(process.run, ended))
        waiting = asyncio.create_task(stop.wait())
        await asyncio.wait({driving, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        ended.set()
        return await driving
    finally:
        process.end()
        if camera is not None:
            camera.close()


def _latched(cloud: Cloud, simulation: Simulation, *, camera: bool) -> Mapping[Interface, Message]:
    """Return what is published once, with an identity of this run."""
    robot, run_id = simulation.world.robot, secrets.token_hex(8)
    return latched_messages(cloud, robot, simulation.mounts, run_id, camera=camera)


def _start_camera(world: World, config: ServeConfig) -> CameraStart | None:
    """Start the camera's process, if one is wanted; nothing of it is imported otherwise."""
    if config.camera is None:
        return None
    from teleop.robot.serving.camera_start import CameraStart

    return CameraStart(world, config.camera)


def _video(
    server: Server,
    camera: SteppedCamera,
    config: ServeConfig,
    latched: Mapping[Interface, Message],
    audit: AuditLog | None,
) -> RobotVideo:
    """Offer the camera's streams and photographs; imported here, since most robots have none."""
    from teleop.robot.video.robot_video import RobotVideo

    return RobotVideo(server, camera.hub, camera.size, config, latched, audit)


def _drive(world: World, config: ServeConfig) -> Drive:
    settings = config.robot.simulation(slip_bursts(config.slip))
    simulation = Simulation(world, seed=config.seed, config=settings)
    limits = SpeedLimits.of(simulation.config.drive)
    return Drive(simulation, Safety(limits, SafetyConfig(stale=config.stale_limits)))


def _start_pose(simulation: Simulation) -> PoseHint:
    """Return the pose at which the robot is always switched on, which it knows."""
    return PoseHint("", Hint(0, simulation.truth().map_from_base, np.zeros((6, 6))))


def _stop_on_signals(stop: asyncio.Event) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        _on_signal(number, stop.set)


def _on_hangup(act: Callable[[], object]) -> None:
    if hasattr(signal, "SIGHUP"):
        _on_signal(signal.SIGHUP, act)


def _on_signal(number: int, act: Callable[[], object]) -> None:
    # Windows, and loops in other threads than the main one, have no signal handlers.
    with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
        asyncio.get_running_loop().add_signal_handler(number, partial(act))


def _metadata(config: ServeConfig, simulation: Simulation, cloud: Cloud) -> Mapping[str, str]:
    """Return the metadata of a log of the readings."""
    return {
        "scene": simulation.world.name,
        "seed": str(config.seed),
        "map_sha256": cloud.sha256,
        **config_metadata(LocalizerConfig()),
    }


@contextmanager
def _log(
    config: ServeConfig, simulation: Simulation, cloud: Cloud
) -> Iterator[tuple[TickObserver, ...]]:
    """Record the readings, if that is wanted."""
    if config.record is None:
        yield ()
        return
    metadata, radius = _metadata(config, simulation, cloud), simulation.world.robot.rolling_radius
    with ReadingsWriter(
        config.record, simulation.mounts, dict(metadata), wheel_radius=radius
    ) as log:

        def write(tick: TickRecord) -> None:
            for reading in tick.readings:
                log.write(reading, tick.stamp)

        yield (write,)
