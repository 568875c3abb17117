"""The least-squares problem behind ``extrinsics``: poses of a drive, and the mounts common to them.

A stretch of the drive is one block: its poses are eliminated, and what is left is what it says of the
mounts. Corrections are displacement and small rotation along and about ``base_link``'s axes, through the
scanner's origin; beside them all share the point that the robot turns about.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from localization.calibration.calibration_sample import Station
from localization.geometry import FloatArray, hat, so3_exp, so3_log
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import residuals
from localization.types import Mounts, Pose

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
"""Of a correction: displacement and small rotation, about ``base_link``'s axes through the scanner."""


@dataclass(frozen=True, slots=True)
class ExtrinsicsConfig:
    """What is known beforehand and what measurements are worth; one sigma."""

    prior: tuple[float, float] = (0.05, np.deg2rad(3.0))
    """Of a mount as it was written down [m, rad]."""
    sigma: float = 0.02
    """Of a point from its plane [m]; as in ``RegistrationConfig``."""
    effective_points: float = 60.0
    """Of one scan, however many it has: neighbouring beams err together."""
    kernels: tuple[float, ...] = (0.15, 0.15, 0.10, 0.07, 0.05, 0.04, 0.04)
    """Geman-McClure scale of each iteration [m]."""
    gate: float = 3.0
    """Points farther from their plane than this many kernels are left out."""
    grazing: float = 0.1
    """Surfaces met at less than this (sine of 6 degrees) are left out: tilted a little, and nothing but
    the ground may tell how it is tilted, a level scanner's points would come to lie on the ground."""
    side: float = 0.006
    """Of the way sideways while driving [m/sqrt(s)]; as in ``EkfConfig``."""
    forward: float = 0.03
    """Of the way forward, as a share of it."""
    pivot: float = 0.10
    """How far the point that the robot turns about may lie from where it is taken to be [m]; the same
    throughout the drive."""
    ground: tuple[float, float] = (0.005, np.deg2rad(0.2))
    """How well the ground's height [m] and level [rad] hold for the whole drive."""
    uneven: tuple[float, float] = (0.02, np.deg2rad(1.5))
    """How far the robot departs from ground that is not level, sweep by sweep [m, rad]."""
    floor: tuple[float, float] = (0.001, np.deg2rad(0.03))
    """No mount is told better by any drive [m, rad]."""
    group: int = 12
    """Sweeps of a stretch: what errs together."""
    most: int = 300
    """Sweeps used at most, evenly chosen: more cost time and tell little."""
    told: float = 0.4
    """An axis is told if its sigma falls to this share of the prior's."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Normal equations of a stretch of the drive: of its poses, and reduced to what all share."""

    shared: FloatArray
    pull: FloatArray
    poses: FloatArray
    cross: FloatArray
    poses_pull: FloatArray

    def reduced(self) -> tuple[FloatArray, FloatArray]:
        """Return information and pull on what is shared, the poses eliminated."""
        solved = np.linalg.solve(
            self.poses, np.column_stack([self.cross.T, self.poses_pull[:, None]])
        )
        return (
            self.shared - self.cross @ solved[:, :-1],
            self.pull - self.cross @ solved[:, -1],
        )

    def poses_step(self, step: FloatArray) -> FloatArray:
        """Return the step of the poses that belongs to a step of what is shared."""
        left = self.poses_pull - self.cross.T @ step
        return np.asarray(np.linalg.solve(self.poses, left), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Some linearised measurements of one pose, or of two that follow each other."""

    shared: FloatArray
    """(M, n) derivative by what all stations share."""
    poses: FloatArray
    """(M, 6) or (M, 12) derivative by the pose or poses: position in ``map``, rotation in base."""
    residual: FloatArray
    """(M,)."""
    weight: FloatArray
    """(M,)."""


class OpenStretch:
    """A stretch in the making: measurements are put into it one after another."""

    def __init__(self, shared: int, poses: int) -> None:
        """Build for so many shared unknowns, and for so many poses at most."""
        m = 6 * poses
        self._shared, self._pull = np.zeros((shared, shared)), np.zeros(shared)
        self._poses, self._poses_pull = np.zeros((m, m)), np.zeros(m)
        self._cross = np.zeros((shared, m))

    def put(self, slot: int, rows: Rows) -> None:
        """Add measurements of the pose in a slot, or of it and the next one."""
        at = slice(6 * slot, 6 * slot + rows.poses.shape[1])
        weighted = rows.shared * rows.weight[:, None]
        self._shared += weighted.T @ rows.shared
        self._pull -= weighted.T @ rows.residual
        self._cross[:, at] += weighted.T @ rows.poses
        self._poses[at, at] += (rows.poses * rows.weight[:, None]).T @ rows.poses
        self._poses_pull[at] -= rows.poses.T @ (rows.weight * rows.residual)

    def closed(self, poses: int) -> Stretch:
        """Return the normal equations of the first so many poses."""
        m = slice(0, 6 * poses)
        return Stretch(
            self._shared, self._pull, self._poses[m, m], self._cross[:, m], self._poses_pull[m]
        )


class MountProblem:
    """The mounts, the poses, and Gauss-Newton on both; shared are the mounts and the pivot (x, y)."""

    def __init__(
        self,
        stations: Sequence[Station],
        world: PreparedMap,
        mounts: Mounts,
        config: ExtrinsicsConfig,
    ) -> None:
        self._stations, self._world, self._config = stations, world, config
        self._names = sorted(mounts)
        self._given = dict(mounts)
        self._poses = [s.map_from_base for s in stations]
        count = max(2, len(stations) // config.group)
        self._groups = [g.tolist() for g in np.array_split(np.arange(len(stations)), count)]
        self._size = 6 * len(self._names) + 2
        self._at = np.zeros(self._size)
        position, angle = config.prior
        each = np.repeat([position, angle], 3)
        self._prior = np.concatenate([*[each] * len(self._names), [config.pivot] * 2]) ** -2.0

    def step(self, kernel: float) -> None:
        """Take one step of Gauss-Newton."""
        stretches = [self._stretch(group, kernel) for group in self._groups]
        reduced = [s.reduced() for s in stretches]
        step = told_solution(reduced, self._prior, self._at, self._config.told) - self._at
        for group, stretch in zip(self._groups, stretches, strict=True):
            moves = stretch.poses_step(step).reshape(-1, 6)
            for k, move in zip(group, moves, strict=True):
                self._poses[k] = _moved(self._poses[k], move)
        self._at = self._at + step

    @property
    def corrections(self) -> FloatArray:
        """(S, 6) of the scanners, sorted by name."""
        return self._at[:-2].reshape(-1, 6).copy()

    def covariance(self) -> FloatArray:
        """Return the covariance (6 S, 6 S) of the corrections."""
        c = self._config
        reduced = [s.reduced() for s in (self._stretch(g, c.kernels[-1]) for g in self._groups)]
        floor = np.tile(np.repeat(np.square(c.floor), 3), len(self._names))
        n = len(floor)
        covariance: FloatArray = honest_covariance(reduced, self._prior)[:n, :n] + np.diag(floor)
        return covariance

    def _mount(self, i: int) -> Pose:
        correction = self._at[6 * i : 6 * i + 6]
        given = self._given[self._names[i]]
        return Pose.from_rotation(
            given.position + correction[:3], so3_exp(correction[3:]) @ given.rotation
        )

    def _stretch(self, group: Sequence[int], kernel: float) -> Stretch:
        stretch = OpenStretch(self._size, len(group))
        for slot, k in enumerate(group):
            for rows in self.seen(k, kernel):
                stretch.put(slot, rows)
            if slot:
                stretch.put(slot - 1, self.rolled(group[slot - 1], k))
        return stretch.closed(len(group))

    def seen(self, k: int, kernel: float) -> list[Rows]:
        """Return what scanners and ground say of station ``k``'s pose."""
        c, station, pose = self._config, self._stations[k], self._poses[k]
        told = [self._stood(pose)]
        for scan in station.scans:
            i = self._names.index(scan.scanner)
            mount = self._mount(i)
            sweep = station.sweep_of(scan, mount)
            seen = residuals(sweep, self._world, pose)
            near = np.abs(np.nan_to_num(seen.distance, nan=np.inf)) < c.gate * kernel
            beam = (sweep.points - sweep.origins) @ pose.rotation.T
            slope = np.abs(np.einsum("ij,ij->i", seen.jacobian[:, :3], beam))
            near &= slope > c.grazing * np.linalg.norm(beam, axis=1)
            if not near.any():
                continue
            distance, own = seen.distance[near], seen.jacobian[near]
            rows = np.zeros((len(distance), self._size))
            # A point moves in the base with the scanner's origin, and about it.
            facing = own[:, :3] @ pose.rotation
            rows[:, 6 * i : 6 * i + 3] = facing
            rows[:, 6 * i + 3 : 6 * i + 6] = np.cross(sweep.points[near] - mount.position, facing)
            weight = (kernel**2 / (kernel**2 + distance**2)) ** 2
            weight *= min(1.0, c.effective_points / weight.sum()) / c.sigma**2
            told.append(Rows(rows, own, distance, weight))
        return told

    def _stood(self, pose: Pose) -> Rows:
        """The robot stands on the ground: height, roll and pitch."""
        c, ground = self._config, self._world.ground
        x, y = float(pose.position[0]), float(pose.position[1])
        if ground.level:
            wanted = Pose.from_euler([x, y, 0.0], yaw=pose.yaw)
        else:
            wanted = ground.stand(x, y, pose.yaw)
        rows = np.zeros((3, 6))
        rows[0, 2] = rows[1, 3] = rows[2, 4] = 1.0
        tilt = so3_log(wanted.rotation.T @ pose.rotation)[:2]
        residual = np.array([pose.position[2] - wanted.position[2], *tilt])
        own = np.zeros(2) if ground.level else np.square(c.uneven)
        height, angle = len(self._stations) * np.square(c.ground) + own
        weight = 1.0 / np.array([height, angle, angle])
        return Rows(np.zeros((3, self._size)), rows, residual, weight)

    def rolled(self, j: int, k: int) -> Rows:
        """Between two stations the wheels roll forward, and turn the robot about its pivot."""
        c = self._config
        then, now = self._poses[j], self._poses[k]
        rolled = self._stations[j].odom_from_base.inverse() @ self._stations[k].odom_from_base
        moved = then.rotation.T @ (now.position - then.position)
        turn = rolled.yaw
        pivot = self._at[-2:]
        # About a pivot at (x, y), a turn moves the base by (1 - R)(x, y).
        lever = np.array([[1.0 - np.cos(turn), np.sin(turn)], [-np.sin(turn), 1.0 - np.cos(turn)]])
        residual = moved[:2] - rolled.position[:2] - lever @ pivot
        rows = np.zeros((2, 12))
        rows[:, :3], rows[:, 6:9] = -then.rotation.T[:2], then.rotation.T[:2]
        rows[:, 3:6] = hat(moved)[:2]
        shared = np.zeros((2, self._size))
        shared[:, -2:] = -lever
        seconds = (self._stations[k].stamp - self._stations[j].stamp) * 1e-9
        way = float(np.hypot(*rolled.position[:2]))
        sigma = np.array([c.forward * way + 0.003, np.sqrt(c.side**2 * seconds + 0.001**2)])
        # What slips counts for little.
        weight = sigma**-2 / (1.0 + np.square(residual / (3.0 * sigma))) ** 2
        return Rows(shared, rows, residual, weight)


def _moved(pose: Pose, move: FloatArray) -> Pose:
    return Pose.from_rotation(pose.position + move[:3], pose.rotation @ so3_exp(move[3:]))


def told_solution(
    reduced: Sequence[tuple[FloatArray, FloatArray]],
    prior: FloatArray,
    at: FloatArray,
    told: float,
) -> FloatArray:
    """Return what stretches say of what they share (n,), zero in directions that they do not tell.

    What is not told stays: noise would carry it about as far as the prior lets it.

    Args:
        reduced: information (n, n) and pull (n,) of each stretch.
        prior: (n,) information known beforehand, about zero.
        at: (n,) where the stretches were linearised.
        told: a direction is told if its sigma falls to this share of the prior's.
    """
    seen = np.asarray(sum(a for a, _ in reduced), dtype=np.float64)
    pull = sum(b for _, b in reduced) + seen @ at
    scale = 1.0 / np.sqrt(prior)
    values, vectors = np.linalg.eigh(seen * np.outer(scale, scale))
    kept = scale[:, None] * vectors[:, values > 1.0 / told**2 - 1.0]
    small = kept.T @ (np.diag(prior) + seen) @ kept
    return np.asarray(kept @ np.linalg.solve(small, kept.T @ pull), dtype=np.float64)


def honest_covariance(
    reduced: Sequence[tuple[FloatArray, FloatArray]], prior: FloatArray
) -> FloatArray:
    """Return the covariance (n, n) of what stretches share.

    That of the normal equations, and a cluster-robust part (Liang and Zeger 1986): stretches of the drive
    disagree by more than their noise, for maps have errors of their own.
    """
    inverse = np.linalg.inv(np.diag(prior) + sum(a for a, _ in reduced))
    pulls = np.array([b for _, b in reduced])
    pulls = pulls - pulls.mean(axis=0)
    spread = pulls.T @ pulls * len(pulls) / (len(pulls) - 1.0)
    return np.asarray(inverse + inverse @ spread @ inverse, dtype=np.float64)
