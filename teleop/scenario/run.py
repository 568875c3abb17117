"""Run a mission: build its robot and its referee, and drive it, in this process or over the wire."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import load_cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import SECOND
from robot_sim import (
    PhysicsError,
    Simulation,
    World,
    scene_names,
)
from teleop.clock import Stopwatch, wall_seconds
from teleop.joystick import Wish
from teleop.robot.robot import Drive, Message, Robot
from teleop.scenario.mission import HINT_STAMP, Mission
from teleop.scenario.referee import Referee, RunRecord
from teleop.scenario.run_report import Summary
from teleop.scenario.tour_driver import TourDriver

Progress = Callable[[float, str], None]
"""Called now and then with the share done and a line of text."""


def cloud_path(scene: str) -> Path:
    """Return where a scene's cloud lies, or would: in its folder, or beside a file that says it all.

    Args:
        scene: the name of a scene that comes with the project, or the path of a folder or a file.
    """
    place = Path(scene)
    if scene not in scene_names() and place.is_dir():
        return place / "cloud.ply"
    if scene not in scene_names() and place.is_file():
        return place.with_suffix(".ply")
    return Path(str(files("scenes") / scene / "cloud.ply"))


def cloud_of(scene: str) -> Cloud:
    """Load the prebuilt cloud of a scene; see ``cloud_path``.

    Raises:
        CloudError: if the scene has none; ``farsteer map`` makes one.
    """
    path = cloud_path(scene)
    if not path.is_file():
        raise CloudError(f"scene {scene!r} has no cloud yet: run `farsteer map {scene}`")
    return load_cloud(path)


def build(
    mission: Mission,
    world: World,
    cloud: Cloud,
    folder: Path,
    *,
    cache: Path | None = None,
    progress: Progress = lambda share, text: None,
) -> tuple[Robot, Referee]:
    """Build a mission's robot and the referee that watches it.

    Args:
        mission: what to do.
        world: the mission's scene.
        cloud: its prebuilt cloud.
        folder: where the files go; made if need be.
        cache: folder for derived files.
        progress: told what is being done.
    """
    begun = wall_seconds()
    watch = Stopwatch()
    simulation = Simulation(
        world, seed=mission.seed, config=mission.outfit.simulation(mission.slips)
    )
    progress(0.0, "preparing the map")
    config = LocalizerConfig()
    prepared = prepare(cloud, cache=cache)
    localizer = Localizer(prepared, simulation.mounts, config, stage=watch.stage)
    robot = Robot(simulation, localizer, stage=watch.stage)
    referee = Referee(
        folder,
        mission,
        simulation,
        cloud,
        watch,
        localizer_config=config,
        startup_seconds=wall_seconds() - begun,
    )
    return robot, referee


def run_here(
    mission: Mission,
    world: World,
    cloud: Cloud,
    folder: Path,
    *,
    cache: Path | None = None,
    progress: Progress = lambda share, text: None,
) -> tuple[Summary, RunRecord]:
    """Drive a mission without a wire between driver and robot; see ``build`` for the arguments.

    Files are written also when the run is interrupted or the physics fail.
    """
    robot, referee = build(mission, world, cloud, folder, cache=cache, progress=progress)
    with referee:
        return referee.finish(_drive(mission, robot, referee, progress))


def _drive(mission: Mission, robot: Robot, referee: Referee, progress: Progress) -> str:
    """Tick until the tour is done, time is up, or something ends it; return what did."""
    driver = TourDriver(robot.simulation.world.tour)
    hint = mission.hint(robot.simulation.truth().map_from_base)
    inbox: list[Message] = []
    try:
        while not driver.done:
            now = robot.simulation.stamp
            if now >= mission.time_limit:
                return "completed" if mission.duration else "out of time before the tour's end"
            if now == HINT_STAMP:
                inbox.append(hint)
            snapshot = robot.tick(now, inbox)
            referee.take(snapshot)
            estimate = snapshot.estimate
            twist = driver.command(estimate.map_from_base, estimate.health)
            inbox = [Drive("script", Wish(twist, enabled=True))]
            if snapshot.stamp % SECOND == 0:
                share = now / mission.time_limit if mission.duration else driver.progress
                progress(share, f"{now // SECOND} s at {referee.factor:.1f}x, {estimate.health}")
    except KeyboardInterrupt:
        return "interrupted"
    except PhysicsError as error:
        return str(error)
    return "completed"
