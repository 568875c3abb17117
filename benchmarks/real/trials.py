"""Short stretches of a real log: places to begin at, and what a localiser says on them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.real.log_tracks import odometry_at_scans
from benchmarks.real.logs import RealDrive
from benchmarks.real.scores import Answer
from localization.geometry import FloatArray, wrap_angle
from localization.types import SECOND, Pose, Reading, Scan

RIGHT, RIGHT_TURN = 0.3, float(np.deg2rad(10.0))
"""A pose nearer than this is right [m, rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Scans:
    """The scans of an excerpt: where in its readings each is, when it came and how far the robot drove."""

    readings: Sequence[Reading]
    """Of the whole excerpt."""
    places: tuple[int, ...]
    """(S,) number of each scan among the readings."""
    stamps: FloatArray
    """(S,) stamps [s]."""
    driven: FloatArray
    """(S,) way by odometry since the first scan [m]."""

    @classmethod
    def of(cls, drive: RealDrive) -> Scans:
        """Return those of an excerpt."""
        places = tuple(i for i, r in enumerate(drive.readings) if isinstance(r, Scan))
        stamps = np.array([drive.readings[i].stamp for i in places]) / SECOND
        at = np.array([pose.position[:2] for pose in odometry_at_scans(drive.readings)])
        steps = np.hypot(*np.diff(at, axis=0).T) if len(at) > 1 else np.zeros(0)
        return cls(drive.readings, places, stamps, np.concatenate([[0.0], np.cumsum(steps)]))

    def until(self, first: int, seconds: float) -> int:
        """Return the number of the first scan that is so much later than another; S if there is none."""
        return int(np.searchsorted(self.stamps, self.stamps[first] + seconds))

    def between(self, first: int, last: int) -> Sequence[Reading]:
        """Return the readings from one scan to before another."""
        end = self.places[last] if last < len(self.places) else len(self.readings)
        return self.readings[self.places[first] : end]

    def beginnings(self, seconds: float, way: float) -> list[int]:
        """Return the scans after which the log lasts so long [s] and the robot drives so far in it [m]."""
        ends = np.searchsorted(self.stamps, self.stamps + seconds)
        inside = np.flatnonzero(ends < len(self.stamps))
        far = self.driven[ends[inside]] - self.driven[inside] >= way
        found: list[int] = inside[far].tolist()
        return found


def place_at(drive: RealDrive, scan: int) -> Pose:
    """Return ``map_from_base`` at a scan."""
    x, y = drive.track[scan].tolist()
    return Pose.planar(x, y, float(drive.heading[scan])) @ drive.mount.inverse()


def off_by(drive: RealDrive, answer: Answer, scan: int) -> tuple[float, float]:
    """Return the error of an answer at a scan [m, rad]; infinite without a pose."""
    here = answer.map_from_scanner
    if here is None:
        return np.inf, np.inf
    far = float(np.hypot(*(here.position[:2] - drive.track[scan])))
    return far, abs(wrap_angle(here.yaw - float(drive.heading[scan])))


def right(drive: RealDrive, answer: Answer, scan: int) -> bool:
    """Return whether an answer is right at a scan."""
    far, turned = off_by(drive, answer, scan)
    return far < RIGHT and turned < RIGHT_TURN


def spread(candidates: Sequence[int], count: int, rng: np.random.Generator) -> Iterator[int]:
    """Yield so many of the candidates: one drawn from each of as many equal parts of them, in order."""
    for part in np.array_split(np.array(candidates), min(count, len(candidates))):
        yield int(rng.choice(part))
