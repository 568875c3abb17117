"""Places made of flat faces, and drives through them: geometry gives the right answer to every test."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from localization.geometry import FloatArray
from localization.logs.mcap_writer import ReadingsWriter
from localization.maps.cloud import Cloud
from localization.maps.prepared_map import PreparedMap, prepare
from localization.motion.displacement import with_turn
from localization.types import (
    SECOND,
    Inertial,
    Mounts,
    Odometry,
    Pose,
    Reading,
    Scan,
    Sweep,
    WheelSpeeds,
)

MOUNTS = {
    "laser_horizontal": Pose.from_euler([0.15, 0.0, 0.35]),
    # Transverse: its x axis points up, its y axis to the left.
    "laser_vertical": Pose.from_euler([-0.1, 0.0, 0.5], pitch=-np.pi / 2),
}
TICK = 20_000_000
"""[ns]"""
TRACK = 0.578
"""Effective track of the robots that drive here [m]."""

_ANGLES = np.deg2rad(np.arange(-135.0, 135.1, 1.0))
_BEAM_TIME = 100_000
"""Between two beams [ns]."""
_RANGE_MAX = 30.0


@dataclass(frozen=True, slots=True)
class Face:
    """An axis-aligned rectangle that is seen from one side."""

    axis: int
    at: float
    """Its coordinate along ``axis`` [m]."""
    facing: float
    """+1 or -1: the side it is seen from."""
    low: tuple[float, float]
    """Of the other two axes, in their order [m]."""
    high: tuple[float, float]

    @property
    def others(self) -> tuple[int, int]:
        a, b = (k for k in range(3) if k != self.axis)
        return a, b


def box(low: Sequence[float], high: Sequence[float], *, inside: bool = False) -> list[Face]:
    """The six faces of a box, seen from outside or from ``inside``."""
    faces = []
    for axis in range(3):
        a, b = (k for k in range(3) if k != axis)
        for at, facing in ((low[axis], -1.0), (high[axis], 1.0)):
            facing = -facing if inside else facing
            faces.append(Face(axis, at, facing, (low[a], low[b]), (high[a], high[b])))
    return faces


class Place:
    """Faces; its cloud is a grid on each, its scans are rays cut with each."""

    def __init__(self, faces: Sequence[Face]) -> None:
        self.faces = tuple(faces)

    def cloud(self, spacing: float = 0.08) -> Cloud:
        """Points on a grid, with exact normals."""
        points, normals = [], []
        for face in self.faces:
            a, b = face.others
            u, v = np.meshgrid(
                np.arange(face.low[0] + 0.5 * spacing, face.high[0], spacing),
                np.arange(face.low[1] + 0.5 * spacing, face.high[1], spacing),
            )
            grid = np.empty((u.size, 3))
            grid[:, face.axis], grid[:, a], grid[:, b] = face.at, u.ravel(), v.ravel()
            points.append(grid)
            normals.append(np.tile(face.facing * np.eye(3)[face.axis], (len(grid), 1)))
        return Cloud(np.concatenate(points), np.concatenate(normals), name="place")

    def prepared(self) -> PreparedMap:
        return prepare(self.cloud())

    def cast(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Distance (N,) [m] along unit directions (N, 3) to the first face; inf where there is none."""
        nearest = np.full(len(origins), np.inf)
        for face in self.faces:
            a, b = face.others
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                far = (face.at - origins[:, face.axis]) / directions[:, face.axis]
                hit = origins + far[:, None] * directions
                met = (far > 1e-9) & (directions[:, face.axis] * face.facing < 0.0)
                met &= (hit[:, a] >= face.low[0]) & (hit[:, a] <= face.high[0])
                met &= (hit[:, b] >= face.low[1]) & (hit[:, b] <= face.high[1])
            nearest = np.where(met & (far < nearest), far, nearest)
        return nearest

    def sweep(
        self,
        pose: Pose,
        *,
        noise: float = 0.0,
        seed: int = 0,
        stamp: int = 0,
        vertical: bool = True,
    ) -> Sweep:
        """What both scanners see from a pose, at one instant."""
        rng = np.random.default_rng(seed)
        points, origins, horizontal = [], [], []
        for name, mount in MOUNTS.items():
            if name == "laser_vertical" and not vertical:
                continue
            beams = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES], axis=1)
            directions = beams @ mount.rotation.T
            start = np.tile(mount.position, (len(beams), 1))
            far = self.cast(pose.apply(start), directions @ pose.rotation.T)
            seen = far < _RANGE_MAX
            far = (far + noise * rng.standard_normal(len(far)))[seen]
            points.append(start[seen] + far[:, None] * directions[seen])
            origins.append(start[seen])
            horizontal.append(np.full(int(seen.sum()), name == "laser_horizontal"))
        return Sweep(stamp, *(np.concatenate(part) for part in (points, origins, horizontal)))


HALL = Place(
    [
        *box((0.0, 0.0, 0.0), (8.0, 6.0, 2.5), inside=True),
        *box((6.6, 4.8, 0.0), (8.0, 6.0, 2.0)),
        *box((2.0, 4.4, 0.0), (2.4, 4.8, 2.5)),
        *box((0.0, 1.0, 0.0), (0.7, 2.6, 1.2)),
    ]
)
"""A hall of 8 m x 6 m with a cupboard, a pillar and a shelf: no place in it looks like another."""

SQUARE = Place(box((-3.0, -3.0, 0.0), (3.0, 3.0, 2.5), inside=True))
"""An empty square room: each place in it looks like three others."""

CORRIDOR = Place([f for f in box((-35.0, -1.0, 0.0), (35.0, 1.0, 2.5), inside=True) if f.axis != 0])
"""A corridor along x without ends."""


class Drive:
    """A robot that drives through a place by a schedule, and its sensor readings.

    Speed [m/s] and turn rate [rad/s] are constant over each tick and change by ramps between the
    ``(seconds, speed, turn)`` of the orders.
    """

    def __init__(
        self,
        place: Place,
        start: Pose,
        *orders: tuple[float, float, float],
        noise: float = 0.01,
        seed: int = 0,
        begin: int = 0,
        scanners: Sequence[str] = tuple(MOUNTS),
    ) -> None:
        self._place, self._noise, self._seed, self._begin = place, noise, seed, begin
        self._scanners = tuple(scanners)
        speeds, turns = [], []
        v = w = 0.0
        for seconds, speed, turn in orders:
            for _ in range(round(seconds * SECOND / TICK)):
                v += float(np.clip(speed - v, -0.02, 0.02))
                w += float(np.clip(turn - w, -0.04, 0.04))
                speeds.append(v)
                turns.append(w)
        self._v, self._w = np.array(speeds), np.array(turns)
        dt = TICK / SECOND
        yaw = start.yaw + np.concatenate([[0.0], np.cumsum(self._w) * dt])
        step = self._v * dt * np.sinc(0.5 * self._w * dt / np.pi)
        middle = yaw[:-1] + 0.5 * self._w * dt
        x = start.position[0] + np.concatenate([[0.0], np.cumsum(step * np.cos(middle))])
        y = start.position[1] + np.concatenate([[0.0], np.cumsum(step * np.sin(middle))])
        self._knots = np.stack([x, y, yaw], axis=1)

    @property
    def end(self) -> int:
        """[ns]"""
        return self._begin + len(self._v) * TICK

    def at(self, stamps: np.typing.NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Positions (N, 3) and rotations (N, 3, 3) at (N,) stamps: exact arcs."""
        since = stamps - self._begin
        k = np.clip(since // TICK, 0, len(self._v) - 1)
        dt = (since - k * TICK) / SECOND
        v, w, (x, y, yaw) = self._v[k], self._w[k], self._knots[k].T
        step, middle = v * dt * np.sinc(0.5 * w * dt / np.pi), yaw + 0.5 * w * dt
        position = np.stack([x + step * np.cos(middle), y + step * np.sin(middle), 0.0 * x], axis=1)
        turn = np.zeros((len(stamps), 3))
        turn[:, 2] = yaw + w * dt
        return position, Rotation.from_rotvec(turn).as_matrix()

    def pose(self, stamp: int) -> Pose:
        position, rotation = self.at(np.array([stamp], dtype=np.int64))
        return Pose.from_rotation(position[0], rotation[0])

    def scan(self, scanner: str, stamp: int) -> Scan:
        """A scan whose first beam is at ``stamp``: each beam from where the robot was at its time."""
        mount = MOUNTS[scanner]
        offsets = np.arange(len(_ANGLES), dtype=np.int64) * _BEAM_TIME
        position, rotation = self.at(stamp + offsets)
        beams = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES], axis=1)
        directions = np.einsum("nij,nj->ni", rotation, beams @ mount.rotation.T)
        far = self._place.cast(position + rotation @ mount.position, directions)
        rng = np.random.default_rng([self._seed, stamp, len(scanner)])
        return Scan.uniform(
            stamp,
            scanner,
            angle_min=float(_ANGLES[0]),
            angle_increment=float(np.deg2rad(1.0)),
            time_increment=_BEAM_TIME * 1e-9,
            ranges=far + self._noise * rng.standard_normal(len(far)),
            range_min=0.05,
            range_max=_RANGE_MAX,
        )

    def readings(self) -> list[Reading]:
        """All readings in the order of arrival; scans ten times a second, the two out of step."""
        readings: list[Reading] = []
        before = 0.0
        for i, (v, w) in enumerate(zip(self._v.tolist(), self._w.tolist(), strict=True)):
            now = self._begin + (i + 1) * TICK
            half = 0.5 * w * TRACK
            readings.append(
                WheelSpeeds(now, float(np.float32(v - half)), float(np.float32(v + half)))
            )
            if (i + 1) % 5 == 0:
                readings += [
                    self.scan(name, now - lag)
                    for name, lag in (
                        ("laser_horizontal", 50_000_000),
                        ("laser_vertical", 40_000_000),
                    )
                    if name in self._scanners
                ]
            force = np.array([(v - before) * SECOND / TICK, v * w, 9.81])
            readings.append(Inertial(now, np.array([0.0, 0.0, w]), force))
            before = v
        return readings


def by_odometry(
    drive: Drive, *, turn: float = 1.0, begin: Pose | None = None, level: bool = False
) -> list[Reading]:
    """The readings of a drive with the poses of an odometry in place of rim speeds.

    Args:
        drive: which began at stamp 0.
        turn: how many times the odometry counts each turn.
        begin: its first pose; that of the drive by default.
        level: whether the level scanner is the only one.
    """
    readings: list[Reading] = []
    before = drive.pose(0)
    counted = begin or before
    for reading in drive.readings():
        if level and isinstance(reading, Scan) and reading.scanner != "laser_horizontal":
            continue
        if isinstance(reading, WheelSpeeds):
            now = drive.pose(reading.stamp)
            step = before.inverse() @ now
            counted, before = counted @ with_turn(step, turn * step.yaw), now
            reading = Odometry(reading.stamp, counted)
        readings.append(reading)
    return readings


def write_log(
    path: Path, readings: Iterable[Reading], mounts: Mounts = MOUNTS, /, **metadata: str
) -> Path:
    """Write readings as our recorder does, each when time has come to its stamp; return the path."""
    with ReadingsWriter(path, mounts, metadata) as writer:
        now = 0
        for reading in readings:
            now = max(now, reading.stamp)
            writer.write(reading, now)
    return path


def apart(a: Pose, b: Pose) -> tuple[float, float]:
    """How far two poses are apart: [m] and [rad]."""
    step = a.inverse() @ b
    cosine = 0.5 * (np.trace(step.rotation) - 1.0)
    return float(np.linalg.norm(step.position)), float(np.arccos(np.clip(cosine, -1.0, 1.0)))
