"""Serving a robot, in real time or in lockstep, to any rosbridge client."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import AsyncExitStack, closing, contextmanager
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from localization.logs.mcap_writer import ReadingsWriter
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import LocalizerConfig
from localization.pipeline.log_replay import config_metadata
from localization.surfaces.files import surfaces_of
from localization.types import Hint
from robot_sim import Simulation, World
from teleop.robot.assembly import RobotParts, build_drive, build_stepped_robot, latched_of
from teleop.robot.inbox import PoseHint
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.playground.playground import Playground, WorldChoice
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.control_process import ControlProcess
from teleop.robot.real_time.process_messages import (
    ESTIMATOR_BOUND,
    GATEWAY_BOUND,
    EstimatorSetup,
    GatewaySetup,
)
from teleop.robot.recording import Recording
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.stepped_robot import TickObserver

if TYPE_CHECKING:  # imported only where there is a camera
    from teleop.robot.real_time.camera_start import CameraStart

_LOG = logging.getLogger(__name__)


def start_gateway(pictures: int | None = None) -> ChildProcess:
    """Start the gateway; ``pictures`` is where those of a camera arrive."""
    return ChildProcess("teleop.robot.real_time.gateway_process", GATEWAY_BOUND, pictures)


def start_estimator() -> ChildProcess:
    """Start the estimator, which localises the robot."""
    return ChildProcess("teleop.robot.real_time.estimator_process", ESTIMATOR_BOUND)


async def serve(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    *,
    cache: Path | None = None,
    map_file: Path | None = None,
    ready: Callable[[Address], None] = lambda address: None,
    stop: asyncio.Event | None = None,
    again: Callable[[WorldChoice, Address], object] = lambda choice, address: None,
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
        again: Called at the end if somebody in the playground wants another world at the same address.

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
        await _serve_in_lockstep(world, cloud, config, cache, map_file, ready, stop)
        return 0.0
    return await _serve_in_real_time(world, cloud, config, cache, map_file, ready, stop, again)


async def _serve_in_lockstep(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    cache: Path | None,
    map_file: Path | None,
    ready: Callable[[Address], None],
    stop: asyncio.Event,
) -> None:
    """Serve in this process, with the robot's own time."""
    prepared, parts = prepare(cloud, cache=cache), RobotParts.of(world, config)
    stepped = build_stepped_robot(parts, cloud, prepared, config, run_id=secrets.token_hex(8))
    gateway, simulation = stepped.gateway, stepped.robot.simulation
    gateway.offer_files(map_file, surfaces_of(cloud, cache=cache))
    if not config.lost:
        stepped.adapter.wishes.post(_start_pose(simulation))
    LockstepService(stepped)
    _on_hangup(gateway.read_tokens)
    async with AsyncExitStack() as cleanup:
        cleanup.push_async_callback(gateway.close)
        stepped.observers = cleanup.enter_context(_log(config, simulation, cloud))
        # Before the log ends: a robot that loses its client brakes, and this is recorded.
        cleanup.push_async_callback(gateway.close)
        ready(await gateway.start())
        await stop.wait()


def _next_record(record: Path | None) -> Path | None:
    """Return the file in which a record goes on once its estimator has ended: ``log-2.mcap`` after ``log.mcap``."""
    if record is None:
        return None
    names = (record.with_stem(f"{record.stem}-{number}") for number in count(2))
    free = next(name for name in names if not name.exists())
    _LOG.warning("the record goes on in %s", free)
    return free


async def _serve_in_real_time(
    world: World,
    cloud: Cloud,
    config: ServeConfig,
    cache: Path | None,
    map_file: Path | None,
    ready: Callable[[Address], None],
    stop: asyncio.Event,
    again: Callable[[WorldChoice, Address], object],
) -> float:
    """Be the control process; the gateway and the estimator are processes of their own."""
    # They load their libraries while the robot is built here.
    camera = _start_camera(world, config)
    pictures = None if camera is None else camera.link
    gateway, estimator = start_gateway(pictures), start_estimator()
    try:
        drive = build_drive(RobotParts.of(world, config))
        simulation = drive.simulation
        if config.playground:
            drive.playground = Playground(simulation, drive.forget_surroundings)
        for_estimator = EstimatorSetup(
            cloud,
            simulation.mounts,
            cache,
            config.record,
            _metadata(config, simulation, cloud),
            simulation.world.robot.rolling_radius,
        )
        # Preparing a map may take long; clients connect when all is there.
        _, surfaces = await asyncio.gather(
            asyncio.to_thread(estimator.begin(for_estimator).ready),
            asyncio.to_thread(surfaces_of, cloud, cache=cache),
        )
        feed = None if camera is None else await asyncio.to_thread(camera.feed, simulation)
        model = None if camera is None else camera.model
        for_gateway = GatewaySetup(
            config,
            simulation.world.name,
            latched_of(simulation, cloud, secrets.token_hex(8), model),
            map_file,
            LocalizerConfig().undo_memory,
            model,
            surfaces,
        )
        process = ControlProcess(
            drive,
            gateway.begin(for_gateway),
            estimator,
            restart_gateway=lambda: start_gateway(pictures).begin(for_gateway),
            restart_estimator=lambda: start_estimator().begin(
                replace(for_estimator, record=_next_record(config.record))
            ),
            camera=feed,
        )
    except BaseException:
        if camera is not None:
            camera.kill()
        gateway.kill()
        estimator.kill()
        raise
    try:
        address = await asyncio.to_thread(process.ready)
        # A server that is started again listens where clients know it.
        for_gateway = replace(for_gateway, config=replace(config, port=address.port))
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
        factor = await driving
        if drive.playground is not None and drive.playground.next_world is not None:
            again(drive.playground.next_world, address)
        return factor
    finally:
        process.end()
        if camera is not None:
            camera.close()


def _start_camera(world: World, config: ServeConfig) -> CameraStart | None:
    """Start the camera's process, if one is wanted; nothing of it is imported otherwise."""
    if config.camera is None:
        return None
    from teleop.robot.real_time.camera_start import CameraStart

    return CameraStart(world, config.camera)


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
    log = ReadingsWriter(config.record, simulation.mounts, dict(metadata), wheel_radius=radius)
    with closing(Recording(log, config.record)) as recording:
        yield (lambda tick: recording.readings(tick.readings, tick.stamp, tick.drive.arm),)
