"""Survey drives as a robot without truth has them: the readings alone make the map.

The simulator still steers the robot along the survey route, as a hand at the joystick would, and judges
the map afterwards; what lies between, in ``localization.mapping.slam``, sees the readings and nothing else.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.evaluation.statistics import Statistics
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import align, ate
from localization.geometry import FloatArray
from localization.logs.mcap_writer import ReadingsWriter
from localization.mapping.mesh_distance import distances_to_mesh
from localization.mapping.slam import Survey
from localization.maps.cloud import Cloud
from localization.types import SECOND
from robot_sim import Simulation, SimulationConfig, World
from robot_sim.survey.static_mesh import still_mesh
from teleop.world_building.survey import visible_surface
from teleop.world_building.survey_drive import Progress, survey_drive

_REST: Final = 2 * SECOND
"""The robot stands still at first, so that the gyro's bias is known before it turns the map [ns]."""
_NEAR: Final = 0.05
"""A point this near to a surface is as good as on it [m]: the cloud's spacing is more."""
_COVERED: Final = 0.10
"""A surface that has a point of the map this near is mapped [m]: in a cloud of points 0.08 m apart all of
it has, and 0.05 m would count the gaps between them."""


def record_survey(
    world: World,
    path: Path,
    *,
    seed: int = 0,
    sensors: SimulationConfig | None = None,
    progress: Progress = lambda share, text: None,
) -> Trajectory:
    """Drive the world's survey route, write all readings to a log, and return where the robot truly was.

    Args:
        world: a scene with a survey route.
        path: of the log; its folder is made if need be.
        seed: of the sensor noise.
        sensors: what the robot carries; None for what it does by default.
        progress: called with the share done and a line of text.

    Raises:
        SurveyError: if the route took four times as long as its length lets expect.
    """
    simulation = Simulation(world, seed=seed, config=sensors)

    def halfway(share: float, text: str) -> None:
        progress(0.5 * share, text)

    words = {"scene": world.name, "seed": str(seed), "drive": "survey"}
    with ReadingsWriter(path, simulation.mounts, words) as log:
        truth = []
        for readings, pose in survey_drive(simulation, rest=_REST, progress=halfway):
            for reading in readings:
                log.write(reading, simulation.stamp)
            truth.append((simulation.stamp, pose))
    return Trajectory.from_poses(truth)


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
    complete: float
    """Share of the surface to be seen from along the survey route that has a point of the map within
    10 cm."""

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
            f"{self.complete:.1%} of what can be seen from the route is within 10 cm of a point",
        ]  # fmt: skip

    def write(self, path: Path) -> None:
        """Write it as JSON, in metres and radians."""
        path.write_text(json.dumps(dataclasses.asdict(self), indent=2) + "\n", encoding="utf-8")


def judge(survey: Survey, cloud: Cloud, truth: Trajectory, world: World) -> MapQuality:
    """Hold a map that was made without truth against the truth."""
    motion = align(survey.trajectory, truth)
    moved = ate(survey.trajectory, truth, aligned=True)
    return MapQuality(
        way=survey.distance,
        key_frames=len(survey.keys),
        closures=len(survey.closures),
        points=len(cloud.points),
        odometry=ate(survey.odometry, truth, aligned=True).horizontal,
        drive=ate(survey.trajectory, truth).horizontal,
        drive_moved=moved.horizontal,
        heading_moved=moved.heading,
        cloud=Fit.of(cloud.points, world),
        cloud_moved=Fit.of(motion.apply(cloud.points), world),
        complete=completeness(cloud.points, world),
    )


def completeness(points: FloatArray, world: World) -> float:
    """Return which share of the surface that can be seen from a world's survey route a map's points cover."""
    distance, _ = cKDTree(points).query(visible_surface(world), distance_upper_bound=_COVERED)
    return float(np.isfinite(distance).mean())


def _line(name: str, s: Statistics) -> str:
    figures = "".join(f"{1000.0 * value:9.1f}" for value in (s.rmse, s.median, s.p95, s.max))
    return f"{name:<26}{figures} mm"
