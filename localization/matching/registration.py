"""Registration of a sweep against the prebuilt cloud: point-to-plane, with the filter's prediction as prior.

The step minimises ``e' P^-1 e + sum_i w_i r_i^2`` over the pose, where ``e`` is the departure from the
filter's prediction, ``P`` its covariance and ``r_i`` the distance of sweep point i from the plane of its
nearest cloud point. Walls seen from behind are ignored (back-face culling), so that a thin wall's far face
cannot attract points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from localization.filter.covariance import pose_covariance
from localization.filter.pose_error import LEVER, difference
from localization.geometry import FloatArray, hat, so3_exp
from localization.maps.map_noise import MapNoise
from localization.maps.prepared_map import PreparedMap
from localization.types import Match, Pose, Sweep


@dataclass(frozen=True, slots=True)
class RegistrationConfig:
    """How a sweep is registered.

    The method is that of a robust maximum a posteriori step; its scales were chosen on the shipped
    scenes, and the ablation table in ``docs/accuracy.md`` shows what each part is worth.
    """

    sigma: float = 0.02
    """The distance of a true point from its plane, one sigma [m]: range noise, for which data sheets of planar
    scanners give 1 to 3 cm, and a good map's own noise; the noise measured on the map is added."""
    kernel: float = 0.04
    """The scale of the Geman-McClure kernel at the end of the annealing [m]: at two sigma a point counts a
    quarter."""
    kernel_wide: float = 0.15
    """The largest scale at the beginning of the annealing [m]; it is twice the prediction's largest sigma, up to
    this."""
    gate: float = 3.0
    """Points farther from their plane than this many kernels are left out: they would count a hundredth."""
    iterations: int = 8
    """The largest number of iterations; most sweeps need only as many as the annealing takes."""
    effective_points: float = 120.0
    """A sweep informs like at most this many independent points, for the errors of neighbouring beams are
    correlated. Set so that the normalised errors (NEES) on the shipped scenes are consistent."""
    inlier_distance: float = 0.10
    """A point this near to its plane counts as explained [m]."""
    normal_noise: float = 0.04
    """The least angular noise of the map's normals, one sigma [rad], for the debiasing; what is measured on
    the map counts if it is more (see ``map_noise``)."""
    debias: float = 4.0
    """A direction is observable if its information exceeds this many times the spurious information of noisy
    normals: two sigma squared (after Hatleskog and Alexis, arXiv:2410.10784)."""
    max_sigma: float = 0.3
    """A direction known no better than this, one sigma [m], is not observable."""
    backface_culling: bool = True
    """Whether walls seen from behind are ignored; otherwise a thin wall's far face attracts points."""


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Sweep points against the cloud at one pose: the linearised problem."""

    distance: FloatArray
    """(N,) signed distance to the plane [m]; NaN where the cloud has no front-facing point near."""
    jacobian: FloatArray
    """(N, 6) derivative by (position in map, rotation in base)."""

    @property
    def valid(self) -> np.typing.NDArray[np.bool_]:
        """(N,) whether the point has a plane to be compared with."""
        return np.isfinite(self.distance)


def residuals(
    sweep: Sweep, world: PreparedMap, map_from_base: Pose, *, backface_culling: bool = True
) -> Residuals:
    """Compare a sweep with the cloud at a pose, by default only with what faces the scanner."""
    rotation, position = map_from_base.rotation, map_from_base.position
    points = sweep.points @ rotation.T + position
    index = world.grid.nearest(points)
    normals = world.cloud.normals[index].astype(float)
    offset = points - world.cloud.points[index]
    distance = np.einsum("ij,ij->i", normals, offset)
    distance[index < 0] = np.nan
    if backface_culling:
        to_sensor = sweep.origins @ rotation.T + position - points + offset
        distance[np.einsum("ij,ij->i", normals, to_sensor) <= 0.0] = np.nan
    jacobian = np.empty((len(points), 6))
    jacobian[:, :3] = normals
    # d(n . R Exp(t) p)/dt = (p x R'n)'
    jacobian[:, 3:] = np.cross(sweep.points, normals @ rotation)
    return Residuals(distance, jacobian)


def register(
    sweep: Sweep,
    world: PreparedMap,
    prior: Pose,
    covariance: FloatArray,
    config: RegistrationConfig = RegistrationConfig(),
) -> Match:
    """Find the most probable pose, given prediction and sweep.

    Args:
        sweep: points in ``base_link``.
        world: the prepared cloud.
        prior: predicted ``map_from_base``.
        covariance: (6, 6) of the prediction: position error in ``map``, rotation error in base; may be
            singular.
        config: scales and gates.

    Returns:
        The match; its information is the sweep's alone (the prior is not in it), in the observable
        directions, and zero if nothing was near.

    Raises:
        CovarianceError: if the covariance is not finite, or has a negative variance in some direction.
    """
    # The covariance may be singular; the floor makes it invertible.
    prior_information = np.linalg.inv(pose_covariance(covariance, "covariance of the prediction"))
    pose = prior
    config = adapted(config, world.noise)
    kernel = _first_kernel(covariance, config)
    for _ in range(config.iterations):
        seen = residuals(sweep, world, pose, backface_culling=config.backface_culling)
        weight = _weights(seen, kernel, config)
        hessian, gradient = _normal_equations(seen, weight)
        departure = difference(prior, pose)
        pull = gradient + prior_information @ departure
        step = -np.asarray(np.linalg.solve(prior_information + hessian, pull), dtype=float)
        pose = Pose.from_rotation(pose.position + step[:3], pose.rotation @ so3_exp(step[3:]))
        settled = kernel <= config.kernel and _size(step) < 5e-4
        if settled:
            break
        kernel = max(config.kernel, 0.6 * kernel)
    return _conclude(sweep, world, pose, config)


def adapted(config: RegistrationConfig, noise: MapNoise) -> RegistrationConfig:
    """Return the scales for a map whose points and normals have some noise.

    Half of the variance of a map's points is taken as common to those around a place. A sweep of N points
    that have it holds a direction to sigma / sqrt(N / 2) where half of them face it: N is limited such that
    this is not less than the common error.
    """
    sigma = math.hypot(config.sigma, noise.distance)
    common = 0.5 * noise.distance**2
    most = 2.0 * sigma**2 / common if common > 0.0 else math.inf
    return replace(
        config,
        sigma=sigma,
        kernel=config.kernel * sigma / config.sigma,
        effective_points=min(config.effective_points, most),
        normal_noise=max(config.normal_noise, noise.normal),
    )


def _first_kernel(covariance: FloatArray, config: RegistrationConfig) -> float:
    scaled = np.diag(covariance) * np.array([1, 1, 1, LEVER**2, LEVER**2, LEVER**2])
    return float(np.clip(2.0 * np.sqrt(scaled.max()), config.kernel, config.kernel_wide))


def _weights(seen: Residuals, kernel: float, config: RegistrationConfig) -> FloatArray:
    """Geman-McClure weights over sigma^2, scaled down for the correlation of neighbouring beams."""
    distance = np.where(seen.valid, seen.distance, np.inf)
    inside = np.abs(distance) < config.gate * kernel
    square = np.where(inside, distance, 0.0) ** 2
    weight = np.where(inside, (kernel**2 / (kernel**2 + square)) ** 2, 0.0)
    total = float(weight.sum())
    scale = min(1.0, config.effective_points / total) if total > 0.0 else 0.0
    scaled: FloatArray = weight * (scale / config.sigma**2)
    return scaled


def _normal_equations(seen: Residuals, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    weighted = seen.jacobian * weight[:, None]
    return seen.jacobian.T @ weighted, weighted.T @ np.nan_to_num(seen.distance)


def _size(step: FloatArray) -> float:
    return float(np.sqrt(step[:3] @ step[:3] + LEVER**2 * (step[3:] @ step[3:])))


def _conclude(sweep: Sweep, world: PreparedMap, pose: Pose, config: RegistrationConfig) -> Match:
    seen = residuals(sweep, world, pose, backface_culling=config.backface_culling)
    weight = _weights(seen, config.kernel, config)
    hessian, gradient = _normal_equations(seen, weight)
    fake = _information_of_normal_noise(sweep, pose, weight, hessian, config.normal_noise)
    directions = observable_directions(hessian, fake, config)
    information, offset = np.zeros((6, 6)), np.zeros(6)
    if len(directions):
        # Project on the observable directions W (rows, orthonormal in the scaled space).
        scale = np.diag([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
        w = directions @ scale
        unscaled = directions @ np.linalg.inv(scale)
        small = unscaled @ hessian @ unscaled.T
        information = w.T @ small @ w
        offset = -unscaled.T @ np.linalg.solve(small, unscaled @ gradient)
    explained = seen.valid & (np.abs(np.nan_to_num(seen.distance)) < config.inlier_distance)
    # The prior still pulls at the pose found; the sweep alone gives a slightly different one.
    alone = Pose.from_rotation(pose.position + offset[:3], pose.rotation @ so3_exp(offset[3:]))
    distances = seen.distance.copy()
    distances.flags.writeable = False
    return Match(
        stamp=sweep.stamp,
        map_from_base=alone,
        information=information,
        observable_directions=directions,
        distances=distances,
        inlier_ratio=float(explained.mean()) if len(explained) else 0.0,
    )


def _information_of_normal_noise(
    sweep: Sweep, pose: Pose, weight: FloatArray, hessian: FloatArray, noise: float
) -> FloatArray:
    """Return the spurious information of noisy normals: ``s^2 sum w A (I - n n') A'``, ``A = [I; [p]x R']``.

    After Hatleskog and Alexis 2024 (arXiv:2410.10784): the normals of a wall, scattered by noise, seem to
    constrain the robot along the wall as well.
    """
    points = sweep.points
    first = weight @ points
    second = points.T @ (points * weight[:, None])
    total = np.empty((6, 6))
    total[:3, :3] = weight.sum() * np.eye(3)
    total[3:, :3] = hat(first) @ pose.rotation.T
    total[:3, 3:] = total[3:, :3].T
    total[3:, 3:] = np.trace(second) * np.eye(3) - second
    fake: FloatArray = noise**2 * (total - hessian)
    return fake


def observable_directions(
    hessian: FloatArray, fake: FloatArray, config: RegistrationConfig
) -> FloatArray:
    """Return the directions (k, 6) in which the sweep truly constrains the pose, rotations scaled by ``LEVER``.

    Args:
        hessian: (6, 6) information of the sweep.
        fake: (6, 6) spurious information in it.
        config: thresholds.
    """
    inverse_scale = np.array([1, 1, 1, 1 / LEVER, 1 / LEVER, 1 / LEVER])
    both = np.outer(inverse_scale, inverse_scale)
    values, vectors = np.linalg.eigh(hessian * both)
    faked = np.einsum("ji,jk,ki->i", vectors, fake * both, vectors)
    keep = (values > config.debias * faked) & (values > 1.0 / config.max_sigma**2)
    directions: FloatArray = np.ascontiguousarray(vectors[:, keep].T)
    directions.flags.writeable = False
    return directions
