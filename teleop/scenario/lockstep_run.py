"""A mission in lockstep by two processes, robot and operator, that share a map file and a socket."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections import deque
from pathlib import Path

from localization.extras import has
from localization.maps.cloud import Cloud
from localization.types import SECOND
from robot_sim import PhysicsError, World
from teleop.interfaces import registry
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.robot import Robot
from teleop.robot.serving.camera_choice import stepped_camera
from teleop.robot.stepped_robot import SteppedRobot, TickObserver
from teleop.robot.tick_record import TickRecord
from teleop.robot.topics.topic_table import latched_messages
from teleop.rosbridge.framing.outgoing_frames import OutgoingFrame, Output
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server
from teleop.scenario.mission import HINT_STAMP, Mission
from teleop.scenario.mission_run import Progress, build
from teleop.scenario.run_recorder import RunRecord, RunRecorder
from teleop.scenario.run_summary import RunSummary, TopicTraffic
from teleop.scenario.scripted_operator import OperatorScript


def run_over_wire(
    mission: Mission,
    world: World,
    cloud: Cloud,
    map_path: Path,
    folder: Path,
    *,
    cache: Path | None = None,
    progress: Progress = lambda share, text: None,
    camera: str | None = None,
) -> tuple[RunSummary, RunRecord]:
    """Serve the robot here, and have a scripted operator in a process of its own drive it.

    Args:
        mission: The mission.
        world: Its scene.
        cloud: The scene's prebuilt cloud, for the robot.
        map_path: File of the cloud, which the operator loads itself.
        folder: Folder of the run, for the operator's recording as well, if rerun is installed.
        cache: Folder for derived files.
        progress: Called with the progress.
        camera: Name of the camera that the robot carries, whose pictures the operator watches; None for none.

    Raises:
        CameraError: If there is no camera of that name.
    """
    robot, recorder = build(mission, world, cloud, folder, cache=cache, progress=progress)
    with recorder:
        ending, traffic = asyncio.run(
            _serve_and_operate(mission, robot, recorder, cloud, map_path, progress, camera)
        )
        if ending == "interrupted" and not recorder.begun:
            raise KeyboardInterrupt
        return recorder.finish(ending, traffic)


async def _serve_and_operate(
    mission: Mission,
    robot: Robot,
    recorder: RunRecorder,
    cloud: Cloud,
    map_path: Path,
    progress: Progress,
    camera_name: str | None,
) -> tuple[str, tuple[TopicTraffic, ...]]:
    simulation = robot.simulation

    # Recording waits until the operator has its response, and happens while it decides.
    unrecorded: deque[TickRecord] = deque()

    def record() -> None:
        while unrecorded:
            tick = unrecorded.popleft()
            recorder.take(tick)
            if tick.stamp % SECOND == 0:
                share = recorder.progress
                seconds = tick.stamp // SECOND
                progress(share, f"{seconds} s at {recorder.factor:.1f}x, {tick.estimate.health}")

    protocol = Protocol(registry(), limits=ClientLimits.unhurried())
    server = Server(protocol, port=0, clock=lambda: simulation.stamp, lockstep=True)
    meter = Meter()
    protocol.observers.add(meter)
    camera = stepped_camera(simulation, camera_name, server)
    observers: tuple[TickObserver, ...] = (unrecorded.append,)
    if camera is not None:
        draw = camera.ticked
        observers = (*observers, lambda tick: draw())
    adapter = RosbridgeAdapter(
        server,
        latched_messages(
            cloud, simulation.world.robot, simulation.mounts, camera=camera is not None
        ),
        undo_memory=robot.localizer.config.undo_memory,
    )
    service = LockstepService(
        SteppedRobot(robot, adapter, observers=observers),
        over=lambda: "time is up" if simulation.stamp >= mission.time_limit else "",
        deferred=record,
    )
    await server.start()
    script_path = _write_script(
        mission, robot, server.url, map_path, recorder.folder, camera=camera is not None
    )
    interrupted = asyncio.Event()
    loop = asyncio.get_running_loop()
    with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
        loop.add_signal_handler(signal.SIGINT, interrupted.set)
    operator_error = await _run_operator(script_path, interrupted)
    await server.close()
    if camera is not None:
        camera.close()
    record()
    if service.error is not None and not isinstance(service.error, PhysicsError):
        raise service.error
    if service.error is not None:
        ending = str(service.error)
    elif interrupted.is_set():
        ending = "interrupted"
    else:
        ending = operator_error or "completed"
    return ending, meter.traffic()


async def _run_operator(script: Path, interrupted: asyncio.Event) -> str:
    """Run the operator's process until it ends or is interrupted; return its error, or nothing."""
    operator = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "teleop.scenario.scripted_operator",
        str(script),
        stderr=asyncio.subprocess.PIPE,
        # Ctrl-C interrupts this process only, which then ends the operator.
        start_new_session=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "RUST_LOG": "error"},
    )
    ended = asyncio.create_task(operator.communicate())
    cut = asyncio.create_task(interrupted.wait())
    await asyncio.wait({ended, cut}, return_when=asyncio.FIRST_COMPLETED)
    if interrupted.is_set() and operator.returncode is None:
        operator.terminate()
    _, errors = await ended
    cut.cancel()
    if operator.returncode == 0:
        return ""
    last = errors.decode(errors="replace").strip().splitlines()[-1:]
    return "; ".join(last) or f"the operator ended with {operator.returncode}"


class Meter(Observer):
    """Counts the frames and bytes of each topic that are sent and received."""

    def __init__(self) -> None:
        self._counts: dict[str, list[int]] = {}

    def received(self, connection: Connection, frame: str | bytes) -> None:
        """Count a received frame."""
        self._add("(to the robot)", len(frame))

    def sent(self, connection: Connection, output: Output) -> None:
        """Count a sent frame."""
        if isinstance(output, OutgoingFrame):
            self._add(output.topic or "(answers)", len(output.payload))

    def _add(self, topic: str, size: int) -> None:
        count = self._counts.setdefault(topic, [0, 0])
        count[0] += 1
        count[1] += size

    def traffic(self) -> tuple[TopicTraffic, ...]:
        """Return the counts by topic, most bytes first."""
        rows = sorted(self._counts.items(), key=lambda row: (-row[1][1], row[0]))
        return tuple(TopicTraffic(topic, *count) for topic, count in rows)


def _write_script(
    mission: Mission, robot: Robot, url: str, map_path: Path, folder: Path, *, camera: bool
) -> Path:
    hint = mission.hint(robot.simulation.truth().map_from_base)
    script = OperatorScript(
        url=url,
        map_path=str(map_path),
        tour=robot.simulation.world.tour,
        hint_stamp=HINT_STAMP,
        hint_position=tuple(hint.map_from_base.position.tolist()),
        hint_quaternion_wxyz=tuple(hint.map_from_base.quaternion_wxyz.tolist()),
        hint_covariance=tuple(hint.covariance.ravel().tolist()),
        duration=mission.duration,
        recording=str(folder / "operator.rrd") if has("rerun") else None,
        camera=camera,
    )
    path = folder / "operator.json"
    script.save(path)
    return path
