"""Refining a survey: all sweeps are held against the surfaces that they saw together.

Loops hold a drive together where it comes by again; what is left is a bend of some millimetres. Here the
cloud of the whole drive is taken for a set of small planes. A plane may move along its normal, the drive
may bend from knot to knot, and both are solved for at once, so that all points lie on their planes and
the way from knot to knot is what odometry says (bundle adjustment with planes, as in BALM by Liu and
Zhang 2021). The planes' shifts are eliminated beforehand (Schur complement), for there are a hundred
thousand of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, rotation_from_euler, wrap_angle
from localization.mapping.cloud_builder import CloudBuilder, MappingConfig
from localization.mapping.odometry_front_end import Step
from localization.mapping.submap import between, compose
from localization.maps.prepared_map import PreparedMap, prepare
from localization.types import IntArray, Pose

_FREE = 4
"""Of a knot: x, y, z [m] and yaw [rad]; roll and pitch are gravity's."""
_HELD = 1e10
"""Information that holds what must not move."""
_BATCH = 50
"""Sweeps taken at once: their equations take some ten megabytes."""

Progress = Callable[[float], None]
"""Called now and then with the share done."""


@dataclass(frozen=True, slots=True)
class RefinementConfig:
    """How sweeps are held against what they saw together."""

    rounds: int = 2
    """How often the planes are made again of the sweeps as they then lie; a third round moves no knot
    of an office by more than a millimetre. Zero refines nothing."""
    knot_way: float = 0.25
    """The drive may bend at knots, which are made after so much way [m] ..."""
    knot_turn: float = np.deg2rad(10.0)
    """... or turning [rad]."""
    sigma: float = 0.02
    """Distance of a true point from its plane, one sigma [m]."""
    kernel: float = 0.04
    """Geman-McClure scale [m]; what is three times as far is on another surface."""
    reach: float = 0.12
    """Farther along its plane a point belongs to another [m]."""
    edge: tuple[float, float, float] = (0.003, 0.003, np.deg2rad(0.05))
    """Error of wheels and gyro from knot to knot, one sigma: level, in height [m], and in heading [rad]."""
    level: bool = True
    """Whether the ground is: heights then stay as they are."""
    mapping: MappingConfig = field(default_factory=lambda: MappingConfig(raw_spacing=0.04))
    """How planes are made: with points averaged coarser than for a finished cloud, in half the time."""


def refined(
    steps: Sequence[Step],
    trajectory: Trajectory,
    config: RefinementConfig = RefinementConfig(),
    progress: Progress = lambda share: None,
) -> Trajectory:
    """Return where sweeps were taken, so that they agree best with each other; the first one stays.

    Args:
        steps: the sweeps, and the way between them as wheels and gyro have it.
        trajectory: ``map_from_base`` of each, right within some centimetres.
        config: all settings.
        progress: called with the share done.

    Raises:
        CloudError: if too little was seen to make planes of.
        ImportError: if Open3D is missing.
    """
    bending = _Bending.of(steps, config)
    places = bending.smoothed(trajectory)
    for i in range(config.rounds):
        builder = CloudBuilder(config.mapping)
        poses = _poses(steps, places)
        for step, pose in zip(steps, poses, strict=True):
            builder.add(step.sweep, pose)
        planes = prepare(builder.build("planes"))
        progress((i + 0.5) / config.rounds)
        places = places + bending.spread(_correction(bending, planes, poses, places))
        places[:, 3] = [wrap_angle(yaw) for yaw in places[:, 3].tolist()]
        progress((i + 1.0) / config.rounds)
    return Trajectory.from_poses(
        (step.sweep.stamp, pose)
        for step, pose in zip(steps, _poses(steps, places), strict=True)
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class _Bending:
    """Where a drive may bend, and what odometry says of the way between."""

    steps: Sequence[Step]
    config: RefinementConfig
    knots: IntArray
    """(K,) numbers of the steps at knots, the first and the last step among them."""
    segment: IntArray
    """(N,) of each step, the number of the knot before it."""
    share: FloatArray
    """(N,) how far each step is on the way to the knot after it, in [0, 1]."""

    @classmethod
    def of(cls, steps: Sequence[Step], config: RefinementConfig) -> _Bending:
        knots = [0]
        for i, step in enumerate(steps):
            way = between(steps[knots[-1]].rolled, step.rolled)
            far = float(np.hypot(way[0], way[1])) > config.knot_way
            if far or abs(float(way[2])) > config.knot_turn:
                knots.append(i)
        last = len(steps) - 1
        if knots[-1] != last:
            knots.append(last)
        at = np.array(knots)
        every = np.arange(len(steps))
        segment = np.clip(np.searchsorted(at, every, side="right") - 1, 0, len(at) - 2)
        share = (every - at[segment]) / (at[segment + 1] - at[segment])
        return cls(steps, config, at, segment, share)

    def smoothed(self, trajectory: Trajectory) -> FloatArray:
        """Return x, y, z and yaw (N, 4): at knots as they are, between them as wheels and gyro have it.

        KISS-ICP errs by some millimetres to and fro, from each sweep to the next.
        """
        poses = [trajectory.pose(i) for i in range(len(self.steps))]
        places = np.array([[*p.position, p.yaw] for p in poses])
        planar = places[:, [0, 1, 3]]
        smooth = places.copy()
        for i, (k, share) in enumerate(
            zip(self.segment.tolist(), self.share.tolist(), strict=True)
        ):
            before, after = (
                compose(planar[knot], between(self.steps[knot].rolled, self.steps[i].rolled))
                for knot in self.knots[k : k + 2].tolist()
            )
            turn = wrap_angle(float(after[2] - before[2]))
            smooth[i, :2] = before[:2] + share * (after - before)[:2]
            smooth[i, 3] = before[2] + share * turn
        return smooth

    def spread(self, correction: FloatArray) -> FloatArray:
        """Return the correction (N, 4) of each step, given those of the knots (K, 4)."""
        share = self.share[:, None]
        spread: FloatArray = (1.0 - share) * correction[self.segment]
        return spread + share * correction[self.segment + 1]


def _poses(steps: Sequence[Step], places: FloatArray) -> list[Pose]:
    return [
        Pose.from_euler(place[:3], roll=step.tilt[0], pitch=step.tilt[1], yaw=float(place[3]))
        for step, place in zip(steps, places, strict=True)
    ]


def _correction(
    bending: _Bending, planes: PreparedMap, poses: Sequence[Pose], places: FloatArray
) -> FloatArray:
    """Return the change (K, 4) of the knots that reconciles sweeps, planes and odometry best."""
    size = _FREE * len(bending.knots)
    hessian, gradient = _odometry(bending, places)
    weight, pull = np.zeros(len(planes.cloud.points)), np.zeros(len(planes.cloud.points))
    shared = []
    for start in range(0, len(poses), _BATCH):
        part = slice(start, min(start + _BATCH, len(poses)))
        rows, distance, plane = _rows(bending, planes, poses, part)
        kernel = bending.config.kernel
        trust = (kernel**2 / (kernel**2 + distance**2)) ** 2 / bending.config.sigma**2
        weighted = rows.multiply(trust[:, None]).tocsr()
        # Sweeps that follow each other know of few knots.
        first, last = bending.segment[[part.start, part.stop - 1]].tolist()
        here = slice(_FREE * first, _FREE * (last + 2))
        hessian[here, here] += np.asarray((rows.T @ weighted)[here, here].toarray(), dtype=float)
        gradient += weighted.T @ distance
        weight += np.bincount(plane, trust, len(weight))
        pull += np.bincount(plane, trust * distance, len(weight))
        index = (plane, np.arange(len(plane)))
        gathered = sparse.csr_array((np.ones(len(plane)), index), shape=(len(weight), len(plane)))
        shared.append((gathered @ weighted).tocoo())
    binding = _summed(shared, (len(weight), size))
    # A plane's best shift is the mean of its points' distances: what remains binds the knots together.
    mean = binding.multiply(1.0 / np.maximum(weight, 1e-9)[:, None]).tocsr()
    hessian -= np.asarray((binding.T @ mean).toarray(), dtype=float)
    gradient -= mean.T @ pull
    step = -np.asarray(np.linalg.solve(hessian, gradient), dtype=float)
    return step.reshape(-1, _FREE)


def _summed(parts: Sequence[sparse.coo_array], shape: tuple[int, int]) -> sparse.csr_array:
    data, rows, columns = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("data", "row", "col")
    )
    return sparse.csr_array((data, (rows, columns)), shape=shape)


def _rows(
    bending: _Bending, planes: PreparedMap, poses: Sequence[Pose], part: slice
) -> tuple[sparse.csr_array, FloatArray, np.typing.NDArray[np.int32]]:
    """Compare some sweeps with the planes.

    Returns:
        Derivatives (M, 4 K) of the distances by the knots' corrections, the distances (M,) [m] and the
        planes' numbers (M,).
    """
    c = bending.config
    cloud = planes.cloud
    parts = []
    for i, pose in enumerate(poses[part], start=part.start):
        sweep = bending.steps[i].sweep
        points, origins = pose.apply(sweep.points), pose.apply(sweep.origins)
        plane = planes.grid.nearest(points)
        normals, offset = cloud.normals[plane], points - cloud.points[plane]
        distance = np.einsum("ij,ij->i", normals, offset)
        kept = (plane >= 0) & (np.abs(distance) < 3.0 * c.kernel)
        kept &= np.einsum("ij,ij->i", normals, origins - points + offset) > 0.0
        kept &= np.einsum("ij,ij->i", offset, offset) - distance**2 < c.reach**2
        arm, normals = (points - pose.position)[kept], normals[kept]
        turn = normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]
        own = np.column_stack([normals, turn])
        share = bending.share[i]
        both = np.hstack([(1.0 - share) * own, share * own])
        first = np.full(len(own), _FREE * bending.segment[i])
        parts.append((both, first, distance[kept], plane[kept]))
    values, first, distances, plane = (np.concatenate(a) for a in zip(*parts, strict=True))
    width = 2 * _FREE
    columns = (first[:, None] + np.arange(width)).ravel()
    ends = np.arange(0, width * len(values) + 1, width)
    shape = (len(values), _FREE * len(bending.knots))
    return sparse.csr_array((values.ravel(), columns, ends), shape=shape), distances, plane


def _odometry(bending: _Bending, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the equations of the way from knot to knot: (4 K, 4 K) and (4 K,); the first knot is held."""
    c, steps, knots = bending.config, bending.steps, bending.knots
    size = _FREE * len(knots)
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    sigmas = np.array([c.edge[0], c.edge[0], c.edge[1], c.edge[2]])
    trust = np.diag(1.0 / sigmas**2)
    flat = [0, 1, 3]
    for k, (i, j) in enumerate(zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True)):
        rolled = between(steps[i].rolled, steps[j].rolled)
        seen = between(places[i, flat], places[j, flat])
        off = seen - rolled
        climb = places[j, 2] - places[i, 2] - (steps[j].height - steps[i].height)
        error = np.array([off[0], off[1], climb, wrap_angle(float(off[2]))])
        back = rotation_from_euler(0.0, 0.0, float(places[i, 3])).T
        later = np.eye(_FREE)
        later[:3, :3] = back
        earlier = -later
        earlier[:2, 3] = [seen[1], -seen[0]]
        jacobian = np.hstack([earlier, later])
        here = slice(_FREE * k, _FREE * (k + 2))
        hessian[here, here] += jacobian.T @ trust @ jacobian
        gradient[here] += jacobian.T @ trust @ error
    held = [*range(_FREE), *(range(2, size, _FREE) if c.level else ())]
    hessian[held, held] += _HELD
    return hessian, gradient
