"""Logs of a robot whose wheels are as bad as real ones, and how well the localiser follows them.

A log is a list of moments, a tenth of a second apart: the odometry, and at some of them a scan. What time
is written beside a moment is another matter, and each test's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig, Stage
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Inertial,
    Odometry,
    Pose,
    Reading,
    Scan,
)
from tests.support_rooms import MOUNTS, Drive, Face, Place, box

SCANNER = "laser_horizontal"
BEGIN = 10 * SECOND
"""True time of the first moment [ns]."""
MOMENT = SECOND // 10
"""Time between moments [ns]."""
_BEAMS = np.deg2rad(np.arange(-90.0, 90.1, 1.0))
TRUSTED = (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)


def upright(faces: Sequence[Face]) -> list[Face]:
    """Of some faces those of walls."""
    return [face for face in faces if face.axis != 2]


def block(low: tuple[float, float], high: tuple[float, float]) -> list[Face]:
    """The walls of a block that reaches from the floor to the ceiling."""
    return upright(box((*low, -1.0), (*high, 2.5)))


OFFICE = Place(
    [
        *upright(box((0.0, 0.0, -1.0), (14.0, 9.0, 2.5), inside=True)),
        *block((3.2, 3.0), (10.6, 6.0)),
        *block((5.0, 0.0), (6.2, 0.4)),
        *block((8.3, 2.6), (8.9, 3.0)),
        *block((12.9, 7.2), (14.0, 9.0)),
        *block((4.0, 8.5), (7.0, 9.0)),
        *block((0.0, 5.6), (0.35, 6.9)),
        *block((13.5, 2.2), (14.0, 3.0)),
    ]
)
"""A corridor of 14 m x 9 m round a block, with cupboards: no place in it looks like another."""
LAP_START = Pose.planar(2.0, 1.5, 0.0)
ROUNDS = (
    (1.0, 0.0, 0.0),
    (6.0, 0.5, 0.0),
    (1.5, 0.0, 1.2),
    (1.5, 0.0, -1.2),
    (6.0, 0.5, 0.0),
    (np.pi, 0.0, 1.0),
    (1.0, 0.0, 0.0),
    (np.pi, 0.0, -1.0),
    (6.0, 0.5, 0.0),
    (0.5 * np.pi, 0.0, 1.0),
    (6.0, 0.5, 0.0),
    (1.0, 0.0, 0.0),
)
"""Orders of a drive that turns on the spot, as skid-steer robots do."""

PASSAGE = Place(
    [
        *upright(box((-18.0, -1.0, -1.0), (18.0, 1.0, 2.5), inside=True)),
        *block((-16.4, 0.6), (-15.2, 1.0)),
        *block((-13.5, -1.0), (-13.0, -0.5)),
        *block((12.4, 0.7), (13.1, 1.0)),
        *block((15.0, -1.0), (16.2, -0.6)),
    ]
)
"""A corridor of 36 m: for 25 m in its middle there is nothing on its walls."""
PASSAGE_START = Pose.planar(-16.5, 0.0, 0.0)
PASSAGE_REACH = 8.0
"""Of the scanner that is driven through it [m]."""
PASSING = ((1.0, 0.0, 0.0), (52.0, 0.6, 0.0), (1.0, 0.0, 0.0))
"""Orders of a drive through it."""


def lap(speed: float = 0.6) -> tuple[tuple[float, float, float], ...]:
    """Orders of a drive of 23 m through three sides of it, with arcs of a metre at the corners."""
    corner = (0.5 * np.pi / speed, speed, speed)
    long, short, last = ((way / speed, speed, 0.0) for way in (9.0, 3.6, 7.2))
    return ((1.0, 0.0, 0.0), long, corner, short, corner, last)


@dataclass(frozen=True, slots=True)
class Wheels:
    """How a base counts its way."""

    turn: float = 1.0
    """Counted over true turning."""
    way: float = 1.02
    """Counted over true distance."""
    heading: float = np.deg2rad(2.0)
    """Random error of the heading [rad/sqrt(m)], one sigma."""
    backwards: tuple[float, float] | None = None
    """First and last second of the drive in which distances are counted with the wrong sign."""
    late: tuple[float, float] | None = None
    """First and last second of the drive in which no turn is counted."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One moment of a drive."""

    true: int
    """When it was [ns]."""
    odometry: Pose
    """What the base counts."""
    scan: Scan | None
    """What is seen, if anything, stamped with the true time."""


def moments(
    place: Place,
    drive: Drive,
    wheels: Wheels,
    *,
    scan_every: int = 2,
    reach: float = 12.0,
    seed: int = 0,
) -> list[Moment]:
    """The moments of a drive; every beam of a scan is of one instant.

    Args:
        place: where it is.
        drive: which began at ``BEGIN``.
        wheels: of the base.
        scan_every: moments from one scan to the next.
        reach: of the scanner [m].
        seed: of all noise.
    """
    rng = np.random.default_rng(seed)
    counted, before, log = Pose.planar(4.0, -7.0, 1.1), drive.pose(BEGIN), []
    for number, true in enumerate(range(BEGIN, drive.end, MOMENT)):
        now = drive.pose(true)
        step = before.inverse() @ now
        counted = counted @ _counted(step, (true - BEGIN) / SECOND, wheels, rng)
        scan = scan_of(place, now, true, reach, rng) if number % scan_every == 0 else None
        log.append(Moment(true, counted, scan))
        before = now
    return log


def _counted(step: Pose, since: float, wheels: Wheels, rng: np.random.Generator) -> Pose:
    """What wheels make of a true step."""
    x, y = step.position[:2].tolist()
    if wheels.backwards is not None and wheels.backwards[0] <= since < wheels.backwards[1]:
        x, y = -x, -y
    way = float(np.hypot(x, y))
    counts = wheels.late is None or not wheels.late[0] <= since < wheels.late[1]
    turn = (wheels.turn * step.yaw if counts else 0.0) + wheels.heading * np.sqrt(
        way
    ) * rng.standard_normal()
    # Of arcs, the chord lies half way between the headings.
    more = 0.5 * (turn - step.yaw)
    c, s = np.cos(more), np.sin(more)
    return Pose.planar(wheels.way * (c * x - s * y), wheels.way * (s * x + c * y), turn)


def scan_of(place: Place, pose: Pose, stamp: int, reach: float, rng: np.random.Generator) -> Scan:
    """Return what a scanner with a reach [m] sees from a pose of the base, all beams at one instant."""
    mount = MOUNTS[SCANNER]
    beams = np.stack([np.cos(_BEAMS), np.sin(_BEAMS), 0.0 * _BEAMS], axis=1)
    start = np.tile(pose.apply(mount.position[None]), (len(beams), 1))
    far = place.cast(start, beams @ (pose.rotation @ mount.rotation).T)
    far = np.where(far < reach, far + 0.01 * rng.standard_normal(len(far)), np.inf)
    return Scan.uniform(
        stamp,
        SCANNER,
        angle_min=float(_BEAMS[0]),
        angle_increment=float(np.deg2rad(1.0)),
        time_increment=0.0,
        ranges=far,
        range_min=0.05,
        range_max=reach,
    )


def gyro_of(
    drive: Drive,
    *,
    bias: float = 0.0,
    silent: tuple[float, float] | None = None,
    seed: int = 0,
) -> list[Inertial]:
    """The readings of a level inertial unit, fifty a second.

    Args:
        drive: which began at ``BEGIN``.
        bias: of the gyro's z axis [rad/s].
        silent: first and last second of the drive in which the unit says nothing.
        seed: of the noise.
    """
    rng, tick = np.random.default_rng(seed), SECOND // 50
    stamps = np.arange(BEGIN, drive.end, tick, dtype=np.int64)
    yaw = np.unwrap([drive.pose(int(stamp)).yaw for stamp in stamps])
    rates = np.diff(yaw, prepend=yaw[0]) * SECOND / tick + bias
    rates += np.deg2rad(0.02) / np.sqrt(tick / SECOND) * rng.standard_normal(len(rates))
    level = np.array([0.0, 0.0, 9.81])
    return [
        Inertial(stamp, np.array([0.0, 0.0, rate]), level)
        for stamp, rate in zip(stamps.tolist(), rates.tolist(), strict=True)
        if silent is None or not silent[0] <= (stamp - BEGIN) / SECOND < silent[1]
    ]


def noting(stages: list[str]) -> Stage:
    """A stage that notes its name each time."""

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        stages.append(name)
        yield

    return stage


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Followed:
    """How a drive was followed: one row for each sweep with a pose."""

    true: FloatArray
    """(N,) time since the beginning [s]."""
    off: FloatArray
    """(N,) horizontal error [m]."""
    turned: FloatArray
    """(N,) error of the heading [rad]."""
    ratio: FloatArray
    """(N,) horizontal error over the sigma that is claimed along it."""
    said: tuple[Health, ...]
    """State after each."""
    health: tuple[Health, ...]
    """State after each reading, since there is a pose."""
    refused: int
    """Number of readings that were refused."""
    searched: int
    """Number of ticks of searching after the first pose."""
    estimates: tuple[Estimate, ...]

    @property
    def sigma(self) -> FloatArray:
        """(N,) horizontal sigma that is claimed [m]."""
        return np.array([np.sqrt(np.trace(e.covariance[:2, :2])) for e in self.estimates])

    @property
    def wrong(self) -> float:
        """Share of the sweeps that are more than 0.5 m off."""
        return float(np.mean(self.off > 0.5))

    @property
    def trusted_though_wrong(self) -> float:
        """Share of the sweeps that are more than 0.5 m off, and the state does not say so."""
        said = np.array([h in TRUSTED for h in self.said])
        return float(np.mean((self.off > 0.5) & said))

    def share(self, *states: Health) -> float:
        """Share of the readings after which the robot is in one of some states."""
        return float(np.mean([h in states for h in self.health]))


def follow(
    world: PreparedMap,
    drive: Drive,
    log: Sequence[Moment],
    stamps: Sequence[int] | None = None,
    *,
    twice: bool = False,
    hint: Pose | None = None,
    gyro: Sequence[Inertial] = (),
) -> Followed:
    """Localise a log with odometry and one scanner, hinted where the robot was at first.

    Args:
        world: map.
        drive: truth.
        log: what is logged.
        stamps: written beside each moment [ns]; the true ones by default.
        twice: whether the odometry of a scan's instant is written before it and after it, as CARMEN does.
        hint: error of the hint.
        gyro: readings of an inertial unit, if there is one; each is written when it is due.
    """
    stages: list[str] = []
    motion, due = Motion.ODOMETRY_AND_GYRO if gyro else Motion.ODOMETRY, list(gyro[::-1])
    suite = SensorConfiguration(motion, flat=True)
    config, mounts = LocalizerConfig.of(suite), {SCANNER: MOUNTS[SCANNER]}
    localizer = Localizer(world, mounts, config, stage=noting(stages))
    written = stamps if stamps is not None else [moment.true for moment in log]
    true_at: dict[int, int] = {}
    rows, said, health, estimates, begun = [], [], [], [], 0
    for number, (moment, stamp) in enumerate(zip(log, written, strict=True)):
        true_at[stamp] = moment.true
        readings: list[Reading] = []
        while due and due[-1].stamp <= stamp:
            readings.append(due.pop())
        readings.append(Odometry(stamp, moment.odometry))
        if moment.scan is not None:
            readings.append(replace(moment.scan, stamp=stamp))
            readings += [Odometry(stamp, moment.odometry)] if twice else []
        if number == 4:
            about = drive.pose(moment.true) @ (hint or Pose.planar(0.1, -0.1, 0.05))
            readings.append(Hint(stamp, about, np.zeros((6, 6))))
        for reading in readings:
            estimate = localizer.add(reading)
            if estimate.map_from_base is None:
                continue
            health.append(estimate.health)
            if estimate.sweep is None:
                continue
            begun = begun or len(stages)
            # The stamp of a moment that was written in the wrong order is put right.
            true_then = true_at.get(estimate.stamp, moment.true)
            error = drive.pose(true_then).inverse() @ estimate.map_from_base
            shift = (drive.pose(true_then).rotation @ error.position)[:2]
            spread = np.linalg.solve(estimate.covariance[:2, :2], shift)
            rows.append(
                [
                    (true_then - BEGIN) / SECOND,
                    np.hypot(*shift),
                    abs(error.yaw),
                    np.sqrt(shift @ spread),
                ]
            )
            said.append(estimate.health)
            estimates.append(estimate)
    true, off, turned, ratio = np.array(rows).T
    return Followed(
        true, off, turned, ratio, tuple(said), tuple(health), localizer.refused,
        stages[begun:].count("search"), tuple(estimates),
    )  # fmt: skip


def summary(followed: Followed) -> str:
    """One line of figures, for a test that fails."""
    return (
        f"{len(followed.off)} sweeps, off {followed.off.mean():.3f} / {np.percentile(followed.off, 95):.3f} "
        f"/ {followed.off.max():.2f} m, {np.rad2deg(followed.turned).max():.1f} deg, wrong {followed.wrong:.1%}, "
        f"trusted though wrong {followed.trusted_though_wrong:.1%}, "
        f"ratio rms {np.sqrt(np.mean(followed.ratio**2)):.1f} max {followed.ratio.max():.1f}, "
        f"refused {followed.refused}, searched {followed.searched}, "
        + ", ".join(f"{h.value} {followed.share(h):.0%}" for h in Health if followed.share(h))
    )
