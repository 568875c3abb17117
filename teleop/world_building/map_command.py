"""``farsteer map``: maps of scenes and of logs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from localization.cli.map_log import LogMapping, map_file, save_drive, save_map
from localization.cli.terminal import Progress, say
from teleop.errors import SettingError

if TYPE_CHECKING:
    from robot_sim import SimulationConfig, World


@dataclass(frozen=True)
class Map(LogMapping):
    """Build a cloud: from a log of readings, or of a scene by a survey drive.

    For a log, no pose is known beforehand: odometry combines wheels, gyro and KISS-ICP, loops are closed,
    and a pose graph settles the pose of each sweep. For a scene, the simulator's true poses are used, as
    if measured by a perfect total station; with --without-truth its survey drive is recorded, mapped from
    the readings alone, and the map compared with the truth.
    """

    source: Annotated[str | None, tyro.conf.Positional] = None
    """A log (our .mcap, a ROS bag, a CARMEN text), or a scene's name, folder or file."""
    scene: str | None = None
    """Scene to map; the office, unless this or a log is given."""
    without_truth: bool = False
    """Map a scene from its readings alone, and report how good that map is."""
    seed: int = 0
    """Seed of the sensor noise."""
    quick: bool = False
    """Scan from stops along the route instead of driving it."""
    out: Path | None = None
    """File to write; the scene's own cloud.ply, or a new folder under runs/ for maps made without truth."""
    effects: bool = False
    """Simulate optical effects in the survey of a scene, so that glass is mapped as real scanners see it."""

    def __call__(self) -> int:
        """Run it."""
        if self.source is not None and self.scene is not None:
            raise SettingError(
                f"give a log or a scene, not both {self.source!r} and {self.scene!r}"
            )
        if self.source is not None and not _is_scene(self.source):
            if self.quick or self.without_truth or self.effects:
                raise SettingError(
                    f"{self.source}: --quick, --without-truth and --effects are for scenes, not for logs"
                )
            return self.map_log(Path(self.source), self.out)
        scene = self.scene or self.source or "office"
        if self.start is not None or self.motion is not None or self.mount or self.topics:
            raise SettingError(
                "--start, --motion, --mount and --topics are for logs; a scene has its own"
            )
        if self.quick and (self.effects or self.without_truth):
            raise SettingError(
                "--quick scans from stops: --effects and --without-truth need the drive"
            )
        return self._map_without_truth(scene) if self.without_truth else self._map_scene(scene)

    def _map_scene(self, scene: str) -> int:
        from robot_sim import load_world
        from robot_sim.survey.route_proposal import reach_of
        from teleop.scene_clouds import scene_cloud_path
        from teleop.world_building.reach_report import reach_lines
        from teleop.world_building.station_survey import survey_from_stations
        from teleop.world_building.survey import survey

        world, out = load_world(scene), self.out or scene_cloud_path(scene)
        # A scene mapped without --out gets its own cloud replaced: that is what the command is for.
        replace(self, overwrite=self.overwrite or self.out is None).check(out)
        world = _with_survey(world)
        bar = Progress()
        warnings: list[str] = []
        if self.quick:
            cloud = survey_from_stations(world, seed=self.seed, progress=bar, warn=warnings.append)
        else:
            sensors = self._sensors()
            cloud = survey(
                world, seed=self.seed, sensors=sensors, progress=bar, warn=warnings.append
            )
        bar.end()
        say(*warnings)
        save_map(cloud, out)
        say(*reach_lines(reach_of(world), world.robot))
        return 0

    def _map_without_truth(self, scene: str) -> int:
        from localization.evaluation.tum_file import write_tum
        from localization.logs.mcap_log import read_log
        from robot_sim import load_world
        from robot_sim.survey.route_proposal import reach_of
        from teleop.world_building.map_quality import map_quality
        from teleop.world_building.reach_report import reach_lines
        from teleop.world_building.survey import mapping_config
        from teleop.world_building.survey_recording import record_survey

        self.check(self.out)
        world = _with_survey(load_world(scene))
        bar = Progress()
        out = map_file(self.out)
        readings = out.with_suffix(".mcap")
        truth = record_survey(
            world, readings, seed=self.seed, sensors=self._sensors(), progress=bar
        )
        survey, cloud = self.survey(
            read_log(readings), world.spawn, world.name, bar, mapping_config(world), say
        )
        quality = map_quality(survey, cloud, truth, world)
        bar.end()
        save_map(cloud, out)
        save_drive(survey, out)
        write_tum(out.with_suffix(".truth.tum"), truth)
        quality.write(out.with_suffix(".json"))
        say(*quality.lines(), *survey.accuracy.lines(), *reach_lines(reach_of(world), world.robot))
        return 0

    def _sensors(self) -> SimulationConfig:
        from teleop.robot.serving.robot_options import RobotOptions

        return RobotOptions(effects=self.effects).simulation()


def _with_survey(world: World) -> World:
    """Return a world with a survey route, and say if it had to be planned."""
    from robot_sim.survey.route_proposal import with_routes

    world = with_routes(world)
    say(*(f"note: {note}" for note in world.notes))
    return world


def _is_scene(source: str) -> bool:
    """Return whether a name denotes a scene, not a log: logs are files and folders of ROS 2 bags."""
    path = Path(source)
    if path.suffix in (".toml", ".xml", ".yaml"):
        return True
    if path.is_dir():
        return not (path / "metadata.yaml").is_file()
    # A bare word that is not a file is a scene; if it is misspelt, the error lists the scenes there are.
    return not path.is_file() and not path.suffix
