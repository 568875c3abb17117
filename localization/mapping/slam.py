"""Graph SLAM: poses of all sweeps of a drive from its readings alone, and the cloud of those sweeps.

Odometry combines wheels, gyro and KISS-ICP; key frames are matched with earlier visits to the same place; a
pose graph distributes the loops' corrections over the drive; and finally the poses are refined so that all
sweeps agree with each other. Only the robot's mounts are known beforehand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import transformed
from localization.geometry import FloatArray
from localization.mapping.cloud_builder import CloudBuilder, MappingConfig
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.gyro_heading import GyroFactors
from localization.mapping.key_frame_edges import EdgeCovariance
from localization.mapping.loop_closure_types import Closure, RejectedClosures
from localization.mapping.loop_optimization import (
    Progress as Progress,
    close_loops,
    distances_driven,
    odometry_graph,
)
from localization.mapping.map_accuracy import MapAccuracy, map_accuracy
from localization.mapping.odometry_front_end import Odometer, OdometrySweep
from localization.mapping.planar_pose import between
from localization.mapping.pose_front_end import PoseOdometer
from localization.mapping.slam_config import MappingError, SlamConfig
from localization.mapping.sweep_placement import placed_sweeps
from localization.mapping.trajectory_refinement import refined_trajectory
from localization.mapping.wall_faces import lost_faces_warning
from localization.maps.cloud import Cloud
from localization.motion.sensor_configuration import Motion
from localization.types import Mounts, Pose, Reading


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """Poses of the sweeps of a drive, and the loop closures behind them."""

    steps: tuple[OdometrySweep, ...]
    """The sweeps that were kept, with their odometry."""
    keys: tuple[int, ...]
    """Numbers of the key frames among the sweeps."""
    odometry: Trajectory
    """Pose of each sweep by odometry."""
    closed: Trajectory
    """Pose of each sweep after loop closure."""
    trajectory: Trajectory
    """Pose ``map_from_base`` of each sweep after loop closure and refinement."""
    closures: tuple[Closure, ...]
    """The accepted loop closures."""
    rejected_closures: RejectedClosures
    """Counts of the rejected candidates."""
    distance: float
    """Length of the drive [m]."""
    rejected_readings: int
    """Number of invalid readings that were rejected."""
    accuracy: MapAccuracy
    """Estimated accuracy of the map."""

    def cloud(
        self,
        name: str,
        config: MappingConfig = MappingConfig(),  # noqa: B008  (frozen)
        warn: Callable[[str], None] = lambda line: None,
    ) -> Cloud:
        """Return the cloud of all scanners' points, with the map's own noise.

        Args:
            name: Name of the cloud.
            config: How points become a cloud.
            warn: Called with one line if the cloud lacks one face of a wall that was seen from both sides.

        Raises:
            CloudError: If there are too few points for a cloud.
            ImportError: If Open3D is missing.
        """
        builder = CloudBuilder(replace(config, upright=_one_height(self.steps)))
        for i, step in enumerate(self.steps):
            builder.add(step.sweep, self.trajectory.pose(i))
        cloud = builder.build(name)
        if (warning := lost_faces_warning(builder.lost_faces)) is not None:
            warn(warning)
        a = self.accuracy
        return replace(cloud, position_noise=a.position_noise, heading_noise=a.heading_noise)


def map_drive(
    readings: Iterable[Reading],
    mounts: Mounts,
    config: SlamConfig = SlamConfig(),  # noqa: B008  (frozen)
    *,
    start: Pose | None = None,
    progress: Progress = lambda share, text: None,
) -> Survey:
    """Estimate the poses of the sweeps of a drive.

    Args:
        readings: Readings of the whole drive, in the order of arrival.
        mounts: ``base_from_scanner`` of each scanner.
        config: All settings.
        start: ``map_from_base`` at the first reading, of which roll and pitch are ignored; by default the map's
            origin.
        progress: Called with the fraction done and a line of text.

    Raises:
        MappingError: If there are no sweeps of a horizontal scanner, or the robot hardly moved.
        ImportError: If Open3D is missing.
    """
    odometer: Odometer | PoseOdometer = Odometer(mounts, config.odometer)
    if config.odometer.sensors.motion in (Motion.ODOMETRY, Motion.ODOMETRY_AND_GYRO):
        odometer = PoseOdometer(mounts, config.pose_odometer)
    steps, keys, edges = _drive(readings, odometer, config, progress)
    odometry = np.array([steps[k].at for k in keys])
    driven = float(distances_driven(odometry)[-1])
    if driven < config.min_distance:
        raise MappingError(
            f"the robot moved only {driven:.1f} m; a map needs a drive of at least {config.min_distance:g} m"
        )
    sweeps = [FlatSweep.of(steps[k].sweep, *steps[k].tilt) for k in keys]
    heights = np.array([steps[k].height for k in keys])
    patches = _patches(steps, keys)
    gyro = GyroFactors.of([steps[k].gyro for k in keys], config.gyro)
    closed = close_loops(
        sweeps,
        odometry,
        heights,
        edges,
        config.closures,
        patches,
        gyro=gyro,
        passes=config.passes,
        progress=lambda share, text: progress(0.5 + 0.2 * share, text),
    )
    way = distances_driven(odometry)
    graph = closed.graph or odometry_graph(odometry, edges, gyro)
    accuracy = map_accuracy(graph, way, closed.closures if closed.graph is not None else ())
    origin = Pose.identity()
    if start is not None:
        origin = Pose.from_euler(start.position, yaw=start.yaw)
    # Refinement works in the drive's own axes, so that the map's shape does not depend on its origin.
    placed = placed_sweeps(steps, keys, closed.poses, closed.heights)
    mapping = replace(config.refinement.mapping, upright=_one_height(steps))
    refinement = replace(config.refinement, mapping=mapping)
    finest = refined_trajectory(
        steps, placed, refinement, lambda share: progress(0.7 + 0.2 * share, "refining")
    )
    return Survey(
        steps=tuple(steps),
        keys=tuple(keys),
        odometry=Trajectory.from_poses((s.sweep.stamp, origin @ s.pose) for s in steps),
        closed=transformed(placed, origin),
        trajectory=transformed(finest, origin),
        closures=closed.closures,
        rejected_closures=closed.rejected_closures,
        distance=driven,
        rejected_readings=odometer.refused,
        accuracy=accuracy,
    )


def _drive(
    readings: Iterable[Reading],
    odometer: Odometer | PoseOdometer,
    config: SlamConfig,
    progress: Progress,
) -> tuple[list[OdometrySweep], list[int], list[FloatArray]]:
    """Run the odometry; return the kept sweeps, the key frames, and the covariance between these."""
    steps: list[OdometrySweep] = []
    keys: list[int] = []
    edges: list[FloatArray] = []
    between_keys = EdgeCovariance()
    stamp = 0
    for reading in readings:
        step = odometer.add(reading)
        if step is None or not step.sweep.horizontal.any():
            continue
        if steps:
            between_keys.add(step)
        if steps and not _worth_keeping(steps[-1], step, config):
            continue
        if not keys or _moved(steps[keys[-1]], step, config.key_distance, config.key_turn):
            if keys:
                edges.append(between_keys.covariance(step, config.edge_floor))
            between_keys = EdgeCovariance()
            keys.append(len(steps))
        steps.append(step)
        if step.sweep.stamp - stamp > 1_000_000_000:
            stamp = step.sweep.stamp
            share = float(getattr(readings, "share", 0.5))
            progress(0.5 * share, f"odometry, {len(keys)} key frames")
    if not steps:
        raise MappingError(
            "there are no sweeps of a horizontal scanner with readings of motion around them; "
            "a map needs laser scans together with wheels, gyro or odometry"
        )
    return steps, keys, edges


def _patches(steps: Sequence[OdometrySweep], keys: Sequence[int]) -> list[FlatSweep]:
    """Return the points seen from each key frame until the next, in the key frame's axes."""
    patches = []
    for first, last in zip(keys, [*keys[1:], len(steps)], strict=True):
        at = steps[first].at
        parts = [FlatSweep.of(s.sweep, *s.tilt).moved(between(at, s.at)) for s in steps[first:last]]
        patches.append(FlatSweep.joined(parts))
    return patches


def _one_height(steps: Sequence[OdometrySweep]) -> bool:
    """Return whether all points are from horizontal scanners, so that surfaces show as lines only."""
    return all(step.sweep.horizontal.all() for step in steps)


def _worth_keeping(a: OdometrySweep, b: OdometrySweep, config: SlamConfig) -> bool:
    waited = b.sweep.stamp - a.sweep.stamp >= config.keep_pause
    return waited or _moved(a, b, config.keep_distance, config.keep_turn)


def _moved(a: OdometrySweep, b: OdometrySweep, way: float, turn: float) -> bool:
    step = between(a.at, b.at)
    return float(np.hypot(step[0], step[1])) > way or abs(float(step[2])) > turn
