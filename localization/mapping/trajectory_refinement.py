"""Refinement of a mapped trajectory by bundle adjustment with planes, as in BALM (Liu and Zhang 2021).

Loop closure leaves the drive bent by some millimetres. Here the cloud of the whole drive is treated as a set
of small planes. Each plane may move along its normal and the drive may bend from knot to knot; both are
estimated together, so that all points lie on their planes and the motion from knot to knot agrees with
odometry. The planes' shifts, about a hundred thousand, are eliminated beforehand (Schur complement).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import sparse

from localization.evaluation.trajectory import Trajectory
from localization.geometry import FloatArray, rotation_from_euler, wrap_angle
from localization.mapping.cloud_builder import CloudBuilder
from localization.mapping.drive_knots import DriveKnots, RefinementConfig
from localization.mapping.odometry_front_end import OdometrySweep
from localization.mapping.planar_pose import between
from localization.maps.prepared_map import PreparedMap, prepare
from localization.types import Pose

_FREE = 4
"""Degrees of freedom of a knot: x, y, z [m] and yaw [rad]; roll and pitch are known from gravity."""
_HELD = 1e10
"""Information that keeps an unknown fixed."""
_BATCH = 50
"""Number of sweeps processed at once: their equations take some ten megabytes."""

Progress = Callable[[float], None]
"""Function that is called with the fraction done, in [0, 1]."""


def refined_trajectory(
    steps: Sequence[OdometrySweep],
    trajectory: Trajectory,
    config: RefinementConfig = RefinementConfig(),  # noqa: B008  (frozen)
    progress: Progress = lambda share: None,
) -> Trajectory:
    """Return the poses for which the sweeps agree best with each other; the first pose stays fixed.

    Args:
        steps: The sweeps with their odometry.
        trajectory: ``map_from_base`` of each, correct within some centimetres.
        config: All settings.
        progress: Called with the fraction done.

    Raises:
        CloudError: If there are too few points for planes.
        ImportError: If Open3D is missing.
    """
    if not config.rounds:
        return trajectory
    bending = DriveKnots.of(steps, config)
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


def _poses(steps: Sequence[OdometrySweep], places: FloatArray) -> list[Pose]:
    return [
        Pose.from_euler(place[:3], roll=step.tilt[0], pitch=step.tilt[1], yaw=float(place[3]))
        for step, place in zip(steps, places, strict=True)
    ]


def _correction(
    bending: DriveKnots, planes: PreparedMap, poses: Sequence[Pose], places: FloatArray
) -> FloatArray:
    """Return the correction (K, 4) of the knots that best agrees with sweeps, planes and odometry."""
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
        # Successive sweeps depend on few knots.
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
    # A plane's best shift is the weighted mean of its points' distances; eliminating it couples the knots.
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
    bending: DriveKnots, planes: PreparedMap, poses: Sequence[Pose], part: slice
) -> tuple[sparse.csr_array, FloatArray, np.typing.NDArray[np.int32]]:
    """Return the distances of some sweeps' points from the planes, linearised.

    Returns:
        Derivatives (M, 4 K) of the distances by the knots' corrections, the distances (M,) [m] and the
        numbers of the planes (M,).
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


def _odometry(bending: DriveKnots, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the normal equations of the odometry, (4 K, 4 K) and (4 K,), with the first knot fixed."""
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
