"""Set-up of a mission's robot and recorder, and driving it within one process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND
from robot_sim import PhysicsError, Simulation, World
from teleop.clock import Stopwatch, wall_seconds
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import DriveCommand, InboxMessage, PoseHint
from teleop.robot.robot import Robot
from teleop.scenario.mission import HINT_STAMP, Mission
from teleop.scenario.run_recorder import RunRecord, RunRecorder
from teleop.scenario.run_summary import RunSummary
from teleop.scenario.tour_driver import TourDriver

Progress = Callable[[float, str], None]
"""Called now and then with the completed share, in [0, 1], and a line of text."""


def build(
    mission: Mission,
    world: World,
    cloud: Cloud,
    folder: Path,
    *,
    cache: Path | None = None,
    progress: Progress = lambda share, text: None,
) -> tuple[Robot, RunRecorder]:
    """Build a mission's robot and the recorder of its run.

    Args:
        mission: The mission.
        world: Its scene.
        cloud: The scene's prebuilt cloud.
        folder: Folder of the run, which is created.
        cache: Folder for derived files.
        progress: Called with the progress.
    """
    begun = wall_seconds()
    watch = Stopwatch()
    config = mission.robot.simulation(mission.slips)
    simulation = Simulation(world, seed=mission.seed, config=config)
    progress(0.0, "preparing the map")
    localizer_config = LocalizerConfig()
    prepared = prepare(cloud, cache=cache)
    localizer = Localizer(prepared, simulation.mounts, localizer_config, stage=watch.stage)
    robot = Robot(simulation, localizer, stage=watch.stage)
    recorder = RunRecorder(
        folder,
        mission,
        simulation,
        cloud,
        watch,
        localizer_config=localizer_config,
        startup_seconds=wall_seconds() - begun,
    )
    return robot, recorder


def run_in_process(
    mission: Mission,
    world: World,
    cloud: Cloud,
    folder: Path,
    *,
    cache: Path | None = None,
    progress: Progress = lambda share, text: None,
) -> tuple[RunSummary, RunRecord]:
    """Drive a mission without a socket between driver and robot; see ``build`` for the arguments.

    The files are also written when the run is interrupted or the physics become unstable.
    """
    robot, recorder = build(mission, world, cloud, folder, cache=cache, progress=progress)
    with recorder:
        return recorder.finish(_drive(mission, robot, recorder, progress))


def _drive(mission: Mission, robot: Robot, recorder: RunRecorder, progress: Progress) -> str:
    """Tick until the tour is driven, time is up, or the run fails; return how it ended."""
    driver = TourDriver(robot.simulation.world.tour)
    hint = mission.hint(robot.simulation.truth().map_from_base)
    inbox: list[InboxMessage] = []
    try:
        while not driver.done:
            now = robot.simulation.stamp
            if now >= mission.time_limit:
                return "completed" if mission.duration else "out of time before the tour's end"
            if now == HINT_STAMP:
                inbox.append(PoseHint("script", hint))
            tick = robot.tick(now, inbox)
            recorder.take(tick)
            estimate = tick.estimate
            twist = driver.command(estimate.map_from_base, estimate.health)
            inbox = [DriveCommand("script", VelocityRequest(twist, enabled=True))]
            if tick.stamp % SECOND == 0:
                share = now / mission.time_limit if mission.duration else driver.progress
                progress(share, f"{now // SECOND} s at {recorder.factor:.1f}x, {estimate.health}")
    except KeyboardInterrupt:
        return "interrupted"
    except PhysicsError as error:
        return str(error)
    return "completed"
