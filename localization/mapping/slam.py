"""Mapping without truth: readings in, where every sweep was taken out, and the cloud of them all.

Odometry is made of wheels, gyro and KISS-ICP; key frames are compared with earlier visits to the same
place; a pose graph spreads what is found over the way between; and in the end all sweeps are held against
each other. Nothing is known beforehand but how the robot is built.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from localization.evaluation.metrics import transformed
from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, wrap_angle
from localization.mapping.cloud_builder import CloudBuilder, MappingConfig
from localization.mapping.loop_closure import Closure, ClosureConfig, Refusals
from localization.mapping.loop_optimization import Progress as Progress, close_loops, raised, way_of
from localization.mapping.odometry_front_end import Odometer, OdometerConfig, Step
from localization.mapping.submap import FlatSweep, between, compose
from localization.mapping.trajectory_refinement import RefinementConfig, refined
from localization.maps.cloud import Cloud
from localization.motion.sensor_configuration import SensorConfiguration
from localization.types import SECOND, Mounts, Pose, Reading


class SlamError(ValueError):
    """Readings that no map can be made of; one line says why and what would do."""


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """Settings of mapping without truth."""

    odometer: OdometerConfig = field(default_factory=OdometerConfig)
    closures: ClosureConfig = field(default_factory=ClosureConfig)
    refinement: RefinementConfig = field(default_factory=RefinementConfig)
    kept_way: float = 0.02
    """A sweep is kept after so much way [m] ..."""
    kept_turn: float = np.deg2rad(1.0)
    """... or turning [rad] ..."""
    kept_pause: int = SECOND // 2
    """... or time [ns]: of a robot that stands, a few sharpen what it sees."""
    key_way: float = 0.5
    """A key frame is made after so much way [m] ..."""
    key_turn: float = np.deg2rad(20.0)
    """... or turning [rad]."""
    edge_floor: tuple[float, float] = (0.003, np.deg2rad(0.05))
    """Odometry between key frames is never better than this [m, rad]."""
    passes: int = 4
    """Loops closed make others easier to find: how often they are looked for at most."""
    least_way: float = 2.0
    """A drive shorter than this is no survey [m]."""

    @classmethod
    def of(cls, suite: SensorConfiguration, *, level: bool = True) -> SlamConfig:
        """Return the settings for a suite of sensors, on level ground or not."""
        flat = suite.flat or level
        return cls(
            odometer=OdometerConfig(sensors=SensorConfiguration(suite.motion, flat=flat)),
            refinement=RefinementConfig(level=flat),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """Where the sweeps of a drive were taken, and what that rests on."""

    steps: tuple[Step, ...]
    """The sweeps that were kept."""
    keys: tuple[int, ...]
    """Numbers of the key frames among them."""
    odometry: Trajectory
    """Where each was taken as odometry has it."""
    closed: Trajectory
    """Where each was taken with loops closed."""
    trajectory: Trajectory
    """Where each was taken with loops closed and all sweeps held against each other: ``map_from_base``."""
    closures: tuple[Closure, ...]
    refusals: Refusals
    way: float
    """Length of the drive [m]."""
    refused: int
    """Readings that were turned away as impossible."""

    def cloud(self, name: str, config: MappingConfig = MappingConfig()) -> Cloud:  # noqa: B008
        """Fuse all scanners' points into one cloud.

        Raises:
            CloudError: if too little was seen to make one.
            ImportError: if Open3D is missing.
        """
        builder = CloudBuilder(replace(config, upright=_one_height(self.steps)))
        for i, step in enumerate(self.steps):
            builder.add(step.sweep, self.trajectory.pose(i))
        return builder.build(name)


def survey_of(
    readings: Iterable[Reading],
    mounts: Mounts,
    config: SlamConfig = SlamConfig(),
    *,
    start: Pose | None = None,
    progress: Progress = lambda share, text: None,
) -> Survey:
    """Find where the sweeps of a drive were taken.

    Args:
        readings: of the whole drive, in the order of arrival.
        mounts: ``base_from_scanner`` of each scanner.
        config: all settings.
        start: ``map_from_base`` where the readings begin, roll and pitch apart; the map's origin unless
            given.
        progress: called with the share done and a line of text.

    Raises:
        SlamError: if there are no sweeps of a horizontal scanner, or the robot hardly moved.
        ImportError: if Open3D is missing.
    """
    odometer = Odometer(mounts, config.odometer)
    steps, keys, edges = _drive(readings, odometer, config, progress)
    odometry = np.array([steps[k].at for k in keys])
    way = way_of(odometry)
    if way[-1] < config.least_way:
        raise SlamError(
            f"the robot moved {way[-1]:.1f} m only; a map wants a drive of {config.least_way:g} m at least"
        )
    sweeps = [FlatSweep.of(steps[k].sweep, *steps[k].tilt) for k in keys]
    heights = np.array([steps[k].height for k in keys])
    patches = _patches(steps, keys)
    closed = close_loops(
        sweeps,
        odometry,
        heights,
        edges,
        config.closures,
        patches,
        passes=config.passes,
        progress=lambda share, text: progress(0.6 + 0.1 * share, text),
    )
    origin = Pose.identity()
    if start is not None:
        origin = Pose.from_euler(start.position, yaw=start.yaw)
    # Where the map's origin is must not tell on its shape: cells of clouds lie in the drive's own axes.
    placed = _placed(steps, keys, closed.poses, closed.heights)
    mapping = replace(config.refinement.mapping, upright=_one_height(steps))
    refinement = replace(config.refinement, mapping=mapping)
    finest = refined(
        steps, placed, refinement, lambda share: progress(0.7 + 0.2 * share, "refining")
    )
    return Survey(
        steps=tuple(steps),
        keys=tuple(keys),
        odometry=Trajectory.from_poses((s.sweep.stamp, origin @ s.pose) for s in steps),
        closed=transformed(placed, origin),
        trajectory=transformed(finest, origin),
        closures=closed.closures,
        refusals=closed.refusals,
        way=float(way[-1]),
        refused=odometer.refused,
    )


def _drive(
    readings: Iterable[Reading], odometer: Odometer, config: SlamConfig, progress: Progress
) -> tuple[list[Step], list[int], list[FloatArray]]:
    """Run the odometer; return the steps kept, the key frames, and the covariance between these."""
    steps: list[Step] = []
    keys: list[int] = []
    edges: list[FloatArray] = []
    between_keys = _EdgeSum()
    stamp = 0
    for reading in readings:
        step = odometer.add(reading)
        if step is None or not step.sweep.horizontal.any():
            continue
        if steps:
            between_keys.add(step)
        if steps and not _worth_keeping(steps[-1], step, config):
            continue
        if not keys or _moved(steps[keys[-1]], step, config.key_way, config.key_turn):
            if keys:
                edges.append(between_keys.covariance(step, config.edge_floor))
            between_keys = _EdgeSum()
            keys.append(len(steps))
        steps.append(step)
        if step.sweep.stamp - stamp > 1_000_000_000:
            stamp = step.sweep.stamp
            progress(0.3, f"odometry, {len(keys)} key frames")
    if not steps:
        raise SlamError(
            "there are no sweeps of a horizontal scanner with readings of motion around them; "
            "a map wants laser scans, and wheels, gyro or odometry beside them"
        )
    return steps, keys, edges


def _patches(steps: Sequence[Step], keys: Sequence[int]) -> list[FlatSweep]:
    """Return what was seen from each key frame on until the next, as seen from the key frame."""
    patches = []
    for first, last in zip(keys, [*keys[1:], len(steps)], strict=True):
        at = steps[first].at
        parts = [FlatSweep.of(s.sweep, *s.tilt).moved(between(at, s.at)) for s in steps[first:last]]
        patches.append(FlatSweep.joined(parts))
    return patches


class _EdgeSum:
    """Adds up what is known of the way from one key frame to the next."""

    def __init__(self) -> None:
        self._predicted: list[tuple[float, FloatArray]] = []
        self._seen: list[FloatArray] = []

    def add(self, step: Step) -> None:
        self._predicted.append((float(step.at[2]), step.predicted))
        self._seen.append(_turned(step.seen, float(step.at[2])))

    def covariance(self, last: Step, floor: tuple[float, float]) -> FloatArray:
        """Covariance (3, 3) of x, y, yaw in the axes of the last step.

        The wheels' errors add up; KISS-ICP's do not over so short a way, for it holds each sweep against
        the same local map: what it saw counts as one sight of average sharpness.
        """
        wheels = np.sum([_turned(p, yaw) for yaw, p in self._predicted], axis=0)
        seen = np.mean(self._seen, axis=0)
        least = np.diag(np.square([floor[0], floor[0], floor[1]]))
        both = np.linalg.inv(np.linalg.inv(wheels) + seen)
        covariance: FloatArray = _turned(both, -float(last.at[2])) + least
        return covariance


def _turned(matrix: FloatArray, yaw: float) -> FloatArray:
    """Return a matrix (3, 3) of x, y, yaw in axes turned back by yaw."""
    turn = np.eye(3)
    c, s = np.cos(yaw), np.sin(yaw)
    turn[:2, :2] = [[c, -s], [s, c]]
    turned: FloatArray = turn @ matrix @ turn.T
    return turned


def _one_height(steps: Sequence[Step]) -> bool:
    """Return whether nothing but horizontal scanners saw anything: no plane shows in what they see."""
    return all(step.sweep.horizontal.all() for step in steps)


def _worth_keeping(a: Step, b: Step, config: SlamConfig) -> bool:
    waited = b.sweep.stamp - a.sweep.stamp >= config.kept_pause
    return waited or _moved(a, b, config.kept_way, config.kept_turn)


def _moved(a: Step, b: Step, way: float, turn: float) -> bool:
    step = between(a.at, b.at)
    return float(np.hypot(step[0], step[1])) > way or abs(float(step[2])) > turn


_STOOD = (1e-3, np.deg2rad(0.5))
"""Before the first sweep a robot that moved and turned by less stood still [m, rad]: no wheel turns
slower, and a bias of 2 deg/s seems like that in the quarter of a second it takes."""


def _placed(
    steps: list[Step], keys: list[int], poses: FloatArray, heights: FloatArray
) -> Trajectory:
    """Return where all sweeps were taken: between key frames each takes over its share of both."""
    # The map begins where the odometer did, a little before the first sweep. If the robot stood
    # meanwhile, what it seemed to turn by was the gyro's bias, not known yet.
    begun = raised(steps[0].at, steps[0].height)
    if float(np.hypot(*steps[0].at[:2])) < _STOOD[0] and abs(begun.yaw) < _STOOD[1]:
        begun = Pose.from_euler([0.0, 0.0, steps[0].height])
    to_map = begun @ raised(poses[0], float(heights[0])).inverse()
    placed = []
    segment = np.searchsorted(keys, np.arange(len(steps)), side="right") - 1
    for i, step in enumerate(steps):
        k = int(segment[i])
        pose, height = _carried(step, steps[keys[k]], poses[k], float(heights[k]))
        if k + 1 < len(keys):
            share = (i - keys[k]) / (keys[k + 1] - keys[k])
            other, above = _carried(step, steps[keys[k + 1]], poses[k + 1], float(heights[k + 1]))
            turn = wrap_angle(float(other[2] - pose[2]))
            pose = pose + share * np.array([*(other - pose)[:2], turn])
            height += share * (above - height)
        roll, pitch = step.tilt
        tilted = Pose.from_euler(
            [pose[0], pose[1], height], roll=roll, pitch=pitch, yaw=float(pose[2])
        )
        placed.append((step.sweep.stamp, to_map @ tilted))
    return Trajectory.from_poses(placed)


def _carried(step: Step, key: Step, pose: FloatArray, height: float) -> tuple[FloatArray, float]:
    """Return where a step is, going by odometry from a key frame."""
    return compose(pose, between(key.at, step.at)), height + step.height - key.height
