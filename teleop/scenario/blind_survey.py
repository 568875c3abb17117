"""Survey drives as a robot without truth has them: the readings alone make the map.

The simulator still steers the robot along the survey route, as a hand at the joystick would, and judges
the map afterwards; what lies between, in ``localization.slam``, sees the readings and nothing else.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from localization.cloud import Cloud
from localization.evaluation import Statistics, align, ate
from localization.geometry import FloatArray
from localization.log import ReadingsWriter
from localization.mapping import distances_to_mesh
from localization.slam import Survey
from localization.trajectory import Trajectory
from localization.types import SECOND, Health, Pose, Reading, Twist
from robot_sim import Simulation, World
from robot_sim.survey.still_mesh import still_mesh
from teleop.scenario.driver import DriverConfig, TourDriver
from teleop.scenario.survey import SurveyError

Progress = Callable[[float, str], None]
"""Called now and then with the share done and a line of text."""

_SPEED: Final = 0.4
"""Of the drive [m/s]."""
_REST: Final = 2 * SECOND
"""The robot stands still at first, so that the gyro's bias is known before it turns the map [ns]."""
_NEAR: Final = 0.05
"""A point this near to a surface is as good as on it [m]: the cloud's spacing is more."""


def record_survey(
    world: World,
    path: Path,
    *,
    seed: int = 0,
    progress: Progress = lambda share, text: None,
) -> Trajectory:
    """Drive the world's survey route, write all readings to a log, and return where the robot truly was.

    Args:
        world: a scene with a survey route.
        path: of the log; its folder is made if need be.
        seed: of the sensor noise.
        progress: called with the share done and a line of text.

    Raises:
        SurveyError: if the route took four times as long as its length lets expect.
    """
    simulation = Simulation(world, seed=seed)
    words = {"scene": world.name, "seed": str(seed), "drive": "survey"}
    with ReadingsWriter(path, simulation.mounts, words) as log:
        truth = []
        for readings, pose in _drive(simulation, progress):
            for reading in readings:
                log.write(reading, simulation.stamp)
            truth.append((simulation.stamp, pose))
    return Trajectory.from_poses(truth)


def _drive(
    simulation: Simulation, progress: Progress
) -> Iterator[tuple[tuple[Reading, ...], Pose]]:
    route = simulation.world.survey
    driver = TourDriver(route, DriverConfig(speed=_SPEED))
    length = float(np.hypot(*np.diff(np.array(route), axis=0).T).sum())
    time_limit = round((60.0 + 4.0 * length / _SPEED) * SECOND)
    pose = simulation.truth().map_from_base
    while not driver.done:
        begun = simulation.stamp >= _REST
        twist = driver.command(pose, Health.TRACKING) if begun else Twist.planar(0.0, 0.0)
        simulation.command(twist)
        readings = tuple(simulation.step())
        pose = simulation.truth().map_from_base
        yield readings, pose
        if simulation.stamp % SECOND == 0:
            progress(0.5 * driver.progress, f"driving, {simulation.stamp // SECOND} s")
        if simulation.stamp > time_limit:
            at = np.round(pose.position[:2], 1).tolist()
            raise SurveyError(f"the survey got stuck near {at}, {driver.progress:.0%} done")


@dataclass(frozen=True, slots=True)
class Fit:
    """How far a cloud's points are from the surfaces that are truly there."""

    distance: Statistics
    """[m]."""
    near: float
    """Share of the points within 5 cm."""

    @classmethod
    def of(cls, points: FloatArray, world: World) -> Fit:
        """Measure points (N, 3) against all that stands still in a world."""
        distances = distances_to_mesh(points, *still_mesh(world))
        return cls(Statistics.of(distances), float((distances < _NEAR).mean()))


@dataclass(frozen=True, slots=True)
class MapQuality:
    """What a map made without truth is worth, by the truth.

    The map's frame begins at the robot's first pose: an error of heading there turns all of it, which
    matters to nobody who works in the map. So each figure is given as it stands, and with the whole
    map moved to where its drive fits the true one best.
    """

    way: float
    """Length of the drive [m]."""
    key_frames: int
    closures: int
    """Loops closed."""
    points: int
    """Of the cloud."""
    odometry: Statistics
    """Horizontal error before loops were closed, the drive moved to its best fit [m]."""
    drive: Statistics
    """Horizontal error of where the sweeps were taken, as it stands [m]."""
    drive_moved: Statistics
    """The same, moved to its best fit [m]."""
    heading_moved: Statistics
    """Error of heading, moved to its best fit [rad]."""
    cloud: Fit
    """As it stands."""
    cloud_moved: Fit
    """Moved to the best fit of the drive."""

    def lines(self) -> list[str]:
        """Return it as lines of text."""
        return [
            f"{self.way:.0f} m, {self.key_frames} key frames, {self.closures} loops closed, {self.points} points",
            f"{'':26}{'rmse':>9}{'median':>9}{'p95':>9}{'max':>9}",
            _line("drive, odometry, moved", self.odometry),
            _line("drive", self.drive),
            _line("drive, moved", self.drive_moved),
            _line("cloud to surfaces", self.cloud.distance) + f"   {self.cloud.near:.1%} within 5 cm",
            _line("cloud to surfaces, moved", self.cloud_moved.distance)
            + f"   {self.cloud_moved.near:.1%} within 5 cm",
            f"heading, moved: {np.degrees(self.heading_moved.rmse):.3f} degrees rmse, "
            f"{np.degrees(self.heading_moved.max):.3f} at most",
        ]  # fmt: skip

    def write(self, path: Path) -> None:
        """Write it as JSON, in metres and radians."""
        path.write_text(json.dumps(dataclasses.asdict(self), indent=2) + "\n", encoding="utf-8")


def judge(survey: Survey, cloud: Cloud, truth: Trajectory, world: World) -> MapQuality:
    """Hold a map that was made without truth against the truth."""
    motion = align(survey.trajectory, truth)
    moved = ate(survey.trajectory, truth, aligned=True)
    return MapQuality(
        way=survey.way,
        key_frames=len(survey.keys),
        closures=len(survey.closures),
        points=len(cloud.points),
        odometry=ate(survey.odometry, truth, aligned=True).horizontal,
        drive=ate(survey.trajectory, truth).horizontal,
        drive_moved=moved.horizontal,
        heading_moved=moved.heading,
        cloud=Fit.of(cloud.points, world),
        cloud_moved=Fit.of(motion.apply(cloud.points), world),
    )


def _line(name: str, s: Statistics) -> str:
    figures = "".join(f"{1000.0 * value:9.1f}" for value in (s.rmse, s.median, s.p95, s.max))
    return f"{name:<26}{figures} mm"
