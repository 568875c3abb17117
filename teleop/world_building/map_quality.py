"""Quality of a map that was made without ground truth, measured against it."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from localization.evaluation.error_statistics import Statistics
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import align, ate
from localization.geometry import FloatArray
from localization.mapping.mesh_distance import distances_to_mesh
from localization.mapping.slam import Survey
from localization.maps.cloud import Cloud
from robot_sim import World
from robot_sim.survey.static_mesh import static_mesh
from teleop.world_building.station_survey import visible_surface

_NEAR: Final = 0.05
"""Distance within which a point counts as on a surface [m]; the spacing of the cloud is larger."""
_COVERED: Final = 0.10
"""Distance from a point of the map within which a surface counts as mapped [m].

In a cloud of points 0.08 m apart, all of a mapped surface is; 0.05 m would count the gaps between points.
"""


@dataclass(frozen=True, slots=True)
class CloudDistances:
    """Distances of a cloud's points from the true surfaces."""

    distance: Statistics
    """Distances of the points from the nearest surface [m]."""
    near: float
    """Share of the points within 5 cm of a surface."""

    @classmethod
    def of(cls, points: FloatArray, world: World) -> CloudDistances:
        """Measure points (N, 3) against all static surfaces of a world."""
        distances = distances_to_mesh(points, *static_mesh(world))
        return cls(Statistics.of(distances), float((distances < _NEAR).mean()))


@dataclass(frozen=True, slots=True)
class MapQuality:
    """Errors of a map that was made without ground truth.

    The map's frame begins at the robot's first pose: an error of heading there turns the whole map, which
    does not matter to its users. So errors are given as they are, and aligned: with the whole map moved to
    where its drive fits the true one best.
    """

    way: float
    """Length of the drive [m]."""
    key_frames: int
    """Number of key frames."""
    closures: int
    """Number of closed loops."""
    points: int
    """Number of points of the cloud."""
    odometry: Statistics
    """Horizontal error of the drive before loops were closed, aligned [m]."""
    drive: Statistics
    """Horizontal error of the poses of the sweeps [m]."""
    drive_moved: Statistics
    """Horizontal error of the poses of the sweeps, aligned [m]."""
    heading_moved: Statistics
    """Error of the headings of the sweeps, aligned [rad]."""
    cloud: CloudDistances
    """Distances of the cloud's points from the true surfaces."""
    cloud_moved: CloudDistances
    """Distances of the cloud's points from the true surfaces, aligned."""
    complete: float
    """Share of the surface visible from the survey route that has a point of the map within 10 cm."""

    def lines(self) -> list[str]:
        """Return the errors as lines of text."""
        return [
            f"{self.way:.0f} m, {self.key_frames} key frames, {self.closures} loops closed, {self.points} points",
            f"{'':26}{'rmse':>9}{'median':>9}{'p95':>9}{'max':>9}",
            _line("drive, odometry, aligned", self.odometry),
            _line("drive", self.drive),
            _line("drive, aligned", self.drive_moved),
            _line("cloud to surfaces", self.cloud.distance) + f"   {self.cloud.near:.1%} within 5 cm",
            _line("cloud to surfaces, aligned", self.cloud_moved.distance)
            + f"   {self.cloud_moved.near:.1%} within 5 cm",
            f"heading, aligned: {np.degrees(self.heading_moved.rmse):.3f} degrees rmse, "
            f"{np.degrees(self.heading_moved.max):.3f} at most",
            f"{self.complete:.1%} of the surface visible from the route is within 10 cm of a point",
        ]  # fmt: skip

    def write(self, path: Path) -> None:
        """Write the errors as JSON, in metres and radians."""
        path.write_text(json.dumps(dataclasses.asdict(self), indent=2) + "\n", encoding="utf-8")


def map_quality(survey: Survey, cloud: Cloud, truth: Trajectory, world: World) -> MapQuality:
    """Measure a map that was made without ground truth against it."""
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
        cloud=CloudDistances.of(cloud.points, world),
        cloud_moved=CloudDistances.of(motion.apply(cloud.points), world),
        complete=completeness(cloud.points, world),
    )


def completeness(points: FloatArray, world: World) -> float:
    """Return the share of the surface visible from a world's survey route that a map's points cover."""
    distance, _ = cKDTree(points).query(visible_surface(world), distance_upper_bound=_COVERED)
    return float(np.isfinite(distance).mean())


def _line(name: str, s: Statistics) -> str:
    figures = "".join(f"{1000.0 * value:9.1f}" for value in (s.rmse, s.median, s.p95, s.max))
    return f"{name:<26}{figures} mm"
