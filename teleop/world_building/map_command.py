"""``farsteer map``: clouds of scenes, and of places that somebody drove through."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from localization.cli.terminal import Progress, say

if TYPE_CHECKING:
    from localization.logs.open_log import ReadingsLog
    from localization.mapping.slam import Survey
    from localization.maps.cloud import Cloud
    from localization.types import Pose
    from robot_sim import SimulationConfig


@dataclass(frozen=True)
class Map:
    """Build a cloud: of a log of readings, or of a scene by a survey drive.

    From a log, no pose is known beforehand: odometry is made of wheels, gyro and KISS-ICP, loops are
    closed, and a pose graph settles where each sweep was taken. Of a scene, the sweeps are placed where
    the simulator says the robot is, as by a perfect total station; with --without-truth its survey drive
    is recorded, mapped from the readings alone, and the map held against the truth.
    """

    source: Annotated[str | None, tyro.conf.Positional] = None
    """A log (our .mcap, a ROS bag, a CARMEN text), or a scene's name, folder or file."""
    scene: str | None = None
    """Which scene to map; the office, unless this or a log is given."""
    without_truth: bool = False
    """Map a scene from its readings alone, and report how good that map is."""
    seed: int = 0
    """Of the sensor noise."""
    quick: bool = False
    """Look all round from stops along the route instead of driving it."""
    out: Path | None = None
    """File to write; the scene's own cloud.ply, or a new folder under runs/ for maps made without truth."""
    start: tuple[float, float, float] | None = None
    """Where the log begins: x, y [m], heading [degrees]; the map's origin unless given."""
    uneven: bool = False
    """Follow the ground's height and slope; unless given it is taken to be level."""
    motion: Literal["wheels-and-gyro", "wheels", "gyro", "odometry", "scanner"] | None = None
    """What to take the motion of a log from, if not from what it has."""
    mount: dict[str, tuple[float, float, float, float]] = field(default_factory=dict)
    """Where a frame of a log sits on base_link, if a bag does not say: NAME x y z [m] yaw [degrees]."""
    topics: tuple[str, ...] = ()
    """Topics of a bag to read; all that are understood unless given."""
    effects: bool = False
    """Of a scene, by its drive: whether the scanners' light does what light does, so that panes are mapped
    as such scanners see them."""

    def __call__(self) -> int:
        """Run it."""
        if self.source is not None and self.scene is not None:
            raise ValueError(f"give a log or a scene, not both {self.source!r} and {self.scene!r}")
        if self.source is not None and not _is_scene(self.source):
            return self._map_log(Path(self.source))
        scene = self.scene or self.source or "office"
        if self.start is not None or self.motion is not None or self.mount or self.topics:
            raise ValueError(
                "--start, --motion, --mount and --topics are for logs; a scene has its own"
            )
        if self.quick and (self.effects or self.without_truth):
            raise ValueError(
                "--quick looks from stops: --effects and --without-truth need the drive"
            )
        return self._map_blindly(scene) if self.without_truth else self._map_scene(scene)

    def _map_scene(self, scene: str) -> int:
        from robot_sim import load_world
        from teleop.scenario.run import cloud_path
        from teleop.world_building.survey import survey, survey_from_stations

        world = load_world(scene)
        bar = Progress()
        if self.quick:
            cloud = survey_from_stations(world, seed=self.seed, progress=bar)
        else:
            cloud = survey(world, seed=self.seed, sensors=self._sensors(), progress=bar)
        bar.end()
        _save(cloud, self.out or cloud_path(scene))
        return 0

    def _map_log(self, path: Path) -> int:
        from localization.cli.sensor_layout import layout_of
        from localization.logs.open_log import open_log

        if self.quick or self.without_truth or self.effects:
            raise ValueError(
                f"{path}: --quick, --without-truth and --effects are for scenes, not for logs"
            )
        log = open_log(path, layout_of(self.mount, self.topics))
        bar = Progress()
        start = None
        if self.start is not None:
            x, y, degrees = self.start
            start = _pose(x, y, degrees)
        survey = self._survey(log, start, bar)
        bar(0.9, f"fusing {len(survey.steps)} sweeps")
        cloud = survey.cloud(path.stem)
        bar.end()
        out = self._own_out()
        _save(cloud, out)
        _save_drive(survey, out)
        if log.warning is not None:
            say(log.warning)
        say(
            f"{survey.way:.0f} m of way, {len(survey.keys)} key frames, "
            f"{len(survey.closures)} loops closed"
        )
        return 0

    def _map_blindly(self, scene: str) -> int:
        from localization.evaluation.trajectory import write_tum
        from localization.logs.mcap_log import read_log
        from robot_sim import load_world
        from teleop.world_building.survey import mapping_config
        from teleop.world_building.survey_without_truth import judge, record_survey

        world = load_world(scene)
        bar = Progress()
        out = self._own_out()
        readings = out.with_suffix(".mcap")
        truth = record_survey(
            world, readings, seed=self.seed, sensors=self._sensors(), progress=bar
        )
        survey = self._survey(read_log(readings), world.spawn, bar)
        bar(0.9, f"fusing {len(survey.steps)} sweeps")
        cloud = survey.cloud(world.name, mapping_config(world))
        quality = judge(survey, cloud, truth, world)
        bar.end()
        _save(cloud, out)
        _save_drive(survey, out)
        write_tum(out.with_suffix(".truth.tum"), truth)
        quality.write(out.with_suffix(".json"))
        say(*quality.lines())
        return 0

    def _sensors(self) -> SimulationConfig:
        from teleop.robot.robot_options import Outfit

        return Outfit(effects=self.effects).simulation()

    def _survey(self, log: ReadingsLog, start: Pose | None, bar: Progress) -> Survey:
        from localization.mapping.slam import SlamConfig, survey_of
        from localization.motion.sensor_configuration import Motion, SensorConfiguration

        motion = log.sensors.motion if self.motion is None else Motion(self.motion)
        config = SlamConfig.of(SensorConfiguration(motion, log.sensors.flat), level=not self.uneven)
        return survey_of(log, log.mounts, config, start=start, progress=bar)

    def _own_out(self) -> Path:
        from teleop.clock import wall_clock_name

        return self.out if self.out is not None else Path("runs") / wall_clock_name() / "map.ply"


def _is_scene(source: str) -> bool:
    """Return whether a name is a scene's rather than a log's: logs are files and ROS 2 bags' folders."""
    path = Path(source)
    if path.suffix in (".toml", ".xml", ".yaml"):
        return True
    if path.is_dir():
        return not (path / "metadata.yaml").is_file()
    # A bare word that is no file is a scene; if it is misspelt, the error lists those there are.
    return not path.is_file() and not path.suffix


def _pose(x: float, y: float, degrees: float) -> Pose:
    from localization.types import Pose

    return Pose.planar(x, y, math.radians(degrees))


def _save(cloud: Cloud, path: Path) -> None:
    from localization.maps.cloud import save_cloud

    path.parent.mkdir(parents=True, exist_ok=True)
    saved = save_cloud(cloud, path)
    say(f"{len(saved.points)} points, {path.stat().st_size / 1e6:.2f} MB in {path}")
    say(f"sha256 {saved.sha256}")


def _save_drive(survey: Survey, path: Path) -> None:
    from localization.evaluation.trajectory import write_tum

    write_tum(path.with_suffix(".tum"), survey.trajectory)
