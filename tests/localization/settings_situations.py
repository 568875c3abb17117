"""Short drives in which every part of the localiser has something to do, and all that it answers, bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from localization.config import LocalizerConfig
from localization.maps.cloud_from_grid import cloud_from_grid
from localization.maps.prepared_map import PreparedMap, prepare
from localization.matching.matchers import Matcher
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer
from localization.types import (
    SECOND,
    Estimate,
    Hint,
    Inertial,
    Odometry,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)  # fmt: skip
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    LAP_START,
    OFFICE,
    SCANNER,
    Wheels,
    gyro_of,
    moments,
)  # fmt: skip
from tests.support_rooms import HALL, MOUNTS, SQUARE, Drive, Place, box

START = Pose.planar(3.0, 2.0, 0.3)
FRIDGE = box((4.4, 1.2, 0.0), (5.0, 2.0, 1.8))
_SIGMA = np.diag([0.04, 0.04, 0.0, 0.0, 0.0, 0.01])
Readings = list[Reading]
Answers = Iterator[object]
"""What is answered one after the other, so that a comparison can end with the first difference."""


@dataclass(frozen=True, slots=True)
class Situation:
    """A drive, and the settings from which one is changed."""

    config: LocalizerConfig
    run: Callable[[LocalizerConfig], Answers]
    """Yields what the localiser answers under some settings."""


def all_of(e: Estimate) -> object:
    """All that an estimate says, to be compared."""
    poses = [p for p in (e.map_from_base, e.odom_from_base) if p is not None]
    poses += [c.map_from_base for c in e.hypotheses]
    arrays = [a for pose in poses for a in (pose.position, pose.quaternion_wxyz)]
    arrays += [e.covariance, e.twist.linear, e.twist.angular]
    if e.match is not None:
        arrays += [e.match.map_from_base.position, e.match.information]
    verdict = e.verdict and (e.verdict.verdict, e.verdict.reason)
    said = repr((e.health, e.reasons, e.nis, e.consistency, verdict))
    return said, b"".join(a.tobytes() for a in arrays)


def answers(
    world: PreparedMap,
    config: LocalizerConfig,
    readings: Iterable[Reading | Callable[[Localizer], object]],
    scanners: Iterable[str] = tuple(MOUNTS),
) -> Answers:
    """Yield a localiser's answers to readings, and to what is asked of it in between."""
    localizer = Localizer(world, {name: MOUNTS[name] for name in scanners}, config)
    for item in readings:
        yield repr(item(localizer)) if callable(item) else all_of(localizer.add(item))


def hinted(
    readings: Readings, at: int, pose: Pose, covariance: np.ndarray | None = None
) -> Readings:
    """Readings with a hint when time has come to a stamp [ns]."""
    place = next(i for i, r in enumerate(readings) if r.stamp >= at)
    hint = Hint(at, pose, np.zeros((6, 6)) if covariance is None else covariance)
    return [*readings[: place + 1], hint, *readings[place + 1 :]]


@cache
def hall() -> PreparedMap:
    return HALL.prepared()


@cache
def square() -> PreparedMap:
    return SQUARE.prepared()


@cache
def grid() -> PreparedMap:
    """The office as an occupancy grid whose cells are wrong here and there."""
    cell, rng = 0.05, np.random.default_rng(0)
    occupied = np.zeros((240, 340), dtype=bool)
    for face in OFFICE.faces:
        along = np.arange(face.low[0], face.high[0], 0.2 * cell)
        at = np.zeros((len(along), 2))
        at[:, face.axis], at[:, face.others[0]] = face.at, along
        at += cell * 0.5 * rng.standard_normal(at.shape)
        column, row = np.floor((at + 1.0) / cell).astype(int).T
        occupied[row, column] = True
    return prepare(
        cloud_from_grid(occupied, ~occupied, cell, Pose.planar(-1.0, -1.0, 0.0), name="g")
    )


@cache
def drive() -> tuple[Reading, ...]:
    """A drive through the hall, and a stop."""
    orders = (0.6, 0.0, 0.0), (1.6, 0.5, 0.4), (0.8, 0.0, 0.0)
    return tuple(Drive(HALL, START, *orders, seed=1).readings())


def tracked(config: LocalizerConfig) -> Answers:
    return answers(
        hall(),
        config,
        [
            *hinted(list(drive()), 400_000_000, START @ Pose.planar(0.1, -0.1, 0.1)),
            lambda localizer: localizer.preview(START @ Pose.planar(0.9, 0.2, 0.7)),
        ],
    )


def searched(config: LocalizerConfig) -> Answers:
    """No hint: the whole map is searched, and the places found are compared on the way."""
    readings = Drive(HALL, START, (0.3, 0.0, 0.0), (4.0, 0.6, 0.3), seed=2).readings()
    return answers(hall(), config, [*readings[:25], Localizer.relocalize, *readings[25:]])


def ambiguous(config: LocalizerConfig) -> Answers:
    """A room that looks like itself from four sides, and nobody who asks for a search."""
    readings = Drive(SQUARE, START, (0.4, 0.0, 0.0), (9.0, 0.4, 0.8), seed=3).readings()
    return answers(square(), config, readings)


def narrow_hint(config: LocalizerConfig) -> Answers:
    """A hint with a covariance, and a second one that is wrong."""
    readings = hinted(list(drive()), 400_000_000, START @ Pose.planar(0.3, 0.2, 0.2), _SIGMA)
    wrong = Pose.planar(6.0, 3.0, 2.0)
    return answers(hall(), config, hinted(readings, 1_500_000_000, wrong, _SIGMA))


def carried(config: LocalizerConfig) -> Answers:
    """A robot that is set down elsewhere, on its way, without its wheels noticing."""
    before = Drive(HALL, START, (0.5, 0.0, 0.0), (1.0, 0.4, 0.0), seed=4)
    after = Drive(HALL, Pose.planar(6.0, 3.0, 2.5), (5.0, 0.4, -0.5), begin=before.end, seed=5)
    readings = hinted(before.readings(), 300_000_000, START)
    return answers(hall(), config, [*readings, *after.readings()])


def changed_room(config: LocalizerConfig) -> Answers:
    """A room where a fridge stands that is not mapped, and the shelf is gone."""
    there = Place([*HALL.faces[:-6], *FRIDGE])
    readings = Drive(there, START, (0.6, 0.0, 0.0), (3.0, 0.4, 0.5), seed=6).readings()
    return answers(hall(), config, hinted(readings, 400_000_000, START))


def slipping(config: LocalizerConfig) -> Answers:
    """The wheels of one side spin, then both, then the robot is pushed."""
    readings = []
    for r in drive():
        if isinstance(r, WheelSpeeds) and 1.2 < r.stamp / SECOND < 1.5:
            r = WheelSpeeds(r.stamp, float(np.float32(2.0 * r.left)), r.right)
        elif isinstance(r, WheelSpeeds) and 1.7 < r.stamp / SECOND < 2.0:
            r = WheelSpeeds(
                r.stamp, float(np.float32(r.left + 1.0)), float(np.float32(r.right + 1.0))
            )
        elif isinstance(r, WheelSpeeds) and 2.1 < r.stamp / SECOND < 2.3:
            r = WheelSpeeds(r.stamp, 0.0, 0.0)
        readings.append(r)
    return answers(hall(), config, hinted(readings, 400_000_000, START))


def blind(config: LocalizerConfig) -> Answers:
    """The scanners are silent for a while, one longer than the other, and so is the gyro."""
    readings = Drive(HALL, START, (0.6, 0.0, 0.0), (4.0, 0.5, 0.4), seed=7).readings()
    silent = {"laser_horizontal": (1.0, 2.5), "laser_vertical": (1.0, 3.5)}
    kept = [
        r
        for r in readings
        if not (
            isinstance(r, Scan) and silent[r.scanner][0] < r.stamp / SECOND < silent[r.scanner][1]
        )
    ]
    return answers(hall(), config, hinted(kept, 400_000_000, START))


def late(config: LocalizerConfig) -> Answers:
    """Scans that arrive a third of a second late, and one that is three seconds late."""
    readings = hinted(list(drive()), 400_000_000, START)
    due = [
        (r.stamp + (SECOND // 3 if isinstance(r, Scan) else 0), i) for i, r in enumerate(readings)
    ]
    return answers(hall(), config, [readings[i] for _, i in sorted(due)])


def standing(config: LocalizerConfig) -> Answers:
    """A robot that stands, and is turned by hand; its gyro has a bias."""
    readings = []
    for r in Drive(HALL, START, (3.0, 0.0, 0.0), seed=8).readings():
        if isinstance(r, Inertial):
            turn = 0.004 + (0.2 if r.stamp > 2.6 * SECOND else 0.0)
            r = Inertial(r.stamp, np.array([0.002, 0.001, turn]), np.array([0.1, 0.05, 9.75]))
        readings.append(r)
    return answers(hall(), config, hinted(readings, 400_000_000, START))


def corridor_drive() -> Drive:
    orders = (0.8, 0.0, 0.0), (4.0, 0.6, 0.0), (1.4, 0.3, 1.2), (1.5, 0.5, 0.0)
    return Drive(OFFICE, LAP_START, *orders, begin=BEGIN)


def by_odometry(config: LocalizerConfig, *, gyro: bool = False, turn: float = 1.6) -> Answers:
    """Poses of bad wheels and one scanner, in an occupancy grid; a pose is late, and another stamped wrongly."""
    going = corridor_drive()
    due: Readings = list(gyro_of(going, bias=0.01)) if gyro else []
    for number, moment in enumerate(moments(OFFICE, going, Wheels(turn=turn), scan_every=3)):
        due.append(Odometry(moment.true, moment.odometry))
        due += [moment.scan] if moment.scan is not None else []
        due += [Hint(moment.true, going.pose(moment.true), np.zeros((6, 6)))] if number == 4 else []
    due.sort(key=lambda r: r.stamp)
    return answers(grid(), config, due, scanners=(SCANNER,))


def shaken_stamps(config: LocalizerConfig) -> Answers:
    """Odometry whose stamps are off by up to a fifth of a second, against the order of arrival."""
    going, rng = corridor_drive(), np.random.default_rng(1)
    due: Readings = []
    for number, moment in enumerate(moments(OFFICE, going, Wheels(), scan_every=2)):
        stamp = moment.true + int(rng.integers(-SECOND // 5, SECOND // 5))
        due.append(Odometry(stamp, moment.odometry))
        due += [replace(moment.scan, stamp=stamp)] if moment.scan is not None else []
        due += [Hint(stamp, going.pose(moment.true), np.zeros((6, 6)))] if number == 4 else []
    return answers(grid(), config, due, scanners=(SCANNER,))


DEFAULT = LocalizerConfig()
ODOMETRY = LocalizerConfig.of(SensorConfiguration(Motion.ODOMETRY, flat=True))
WITH_GYRO = LocalizerConfig.of(SensorConfiguration(Motion.ODOMETRY_AND_GYRO, flat=True))
SITUATIONS = {
    "tracked": Situation(DEFAULT, tracked),
    "flat": Situation(LocalizerConfig.of(SensorConfiguration(flat=True)), tracked),
    "odometry": Situation(ODOMETRY, by_odometry),
    "odometry and gyro": Situation(WITH_GYRO, lambda c: by_odometry(c, gyro=True)),
    "slipping": Situation(DEFAULT, slipping),
    "slipping, flat": Situation(LocalizerConfig.of(SensorConfiguration(flat=True)), slipping),
    "standing": Situation(DEFAULT, standing),
    "narrow hint": Situation(DEFAULT, narrow_hint),
    "blind": Situation(DEFAULT, blind),
    "changed room": Situation(DEFAULT, changed_room),
    "late": Situation(DEFAULT, late),
    "searched": Situation(DEFAULT, searched),
    "carried": Situation(DEFAULT, carried),
    "shaken stamps": Situation(ODOMETRY, shaken_stamps),
    "ambiguous": Situation(DEFAULT, ambiguous),
    "kiss": Situation(replace(DEFAULT, matcher=Matcher.KISS), tracked),
}
