"""Registration of a sweep against the prebuilt cloud: point-to-plane, with the filter's prediction as prior.

The step minimises ``e' P^-1 e + sum_i w_i r_i^2`` over the pose, where ``e`` is the departure from the
filter's prediction, ``P`` its covariance and ``r_i`` the distance of sweep point i from the plane of its
nearest cloud point. Walls seen from behind are ignored (back-face culling), so that a thin wall's far face
cannot attract points.

In a rough map, such as one made of an occupancy grid, a normal is a guess. There the distance of a point from
its nearest cloud point counts along the wall too, with a smaller weight; both faces of a wall are one; and the
pose is that which all beams support, while the information is limited by the errors that they share.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from localization.compiled.surfaces import (
    IndexArray,
    Scales,
    aligned,
    normal_equations,
    plane_distances,
    point_weights,
)
from localization.filter.covariance import pose_covariance
from localization.filter.pose_error import LEVER
from localization.geometry import FloatArray, hat, so3_exp
from localization.maps.map_noise import MapNoise
from localization.maps.prepared_map import PreparedMap
from localization.types import Match, Pose, RangeFit, Sweep


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
    iterations: int = 20
    """The largest number of iterations; most sweeps need only as many as the annealing takes, but in rough maps each step
    along a wall is a part of the way."""
    effective_points: float = 120.0
    """A sweep informs like at most this many independent points, for the errors of neighbouring beams are
    correlated. Set so that the normalised errors (NEES) on the shipped scenes are consistent."""
    inlier_distance: float = 0.10
    """A point this near to its plane counts as explained [m]."""
    normal_noise: float = 0.04
    """The least angular noise of the map's normals, one sigma [rad], for the debiasing; what is measured on
    the map counts if it is more (see ``map_noise``). In a smooth map, points around which the normals differ by more, as
    where a wall ends, count the less."""
    debias: float = 4.0
    """A direction is observable if its information exceeds this many times the spurious information of noisy
    normals: two sigma squared (after Hatleskog and Alexis, arXiv:2410.10784)."""
    rough: float = 0.1
    """Normals with more noise than this make a map rough, one sigma [rad]: clouds that were surveyed have 0.03
    to 0.05, occupancy grids 0.14 to 0.24."""
    tangential: float = 0.3
    """Weight, in rough maps, of a point's distance from its nearest cloud point along the wall, as a share of
    the weight of its distance across."""
    rough_kernel: float = 0.1
    """The scale of the kernel in rough maps [m]: two cells of an occupancy grid."""
    rough_kernel_wide: float = 0.3
    """As ``kernel_wide`` in rough maps [m]. A prediction that is surely nearer than the gate of ``rough_kernel``
    begins with that: wider ones begin with the walls of other rooms."""


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Sweep points against the cloud at one pose: the linearised problem."""

    distance: FloatArray
    """(N,) signed distance to the plane [m]; NaN where the cloud has no front-facing point near."""
    jacobian: FloatArray
    """(N, 6) derivative by (position in map, rotation in base)."""
    nearest: IndexArray
    """(N,) index of the nearest cloud point; -1 where there is none."""
    across: FloatArray
    """(N,) part of each beam along the surface's normal [m]; negative where the beam meets its front."""
    along: FloatArray
    """(N,) signed distance from the nearest cloud point along its wall, horizontally [m]; 0 on surfaces that are
    not upright. Empty unless the map is rough."""
    along_jacobian: FloatArray
    """(N, 6) derivative of ``along``."""
    beyond: np.typing.NDArray[np.bool_]
    """(N,) whether the point lies above all that is mapped: a map that was cut there says nothing of it."""

    @property
    def valid(self) -> np.typing.NDArray[np.bool_]:
        """(N,) whether the point has a plane to be compared with."""
        return np.isfinite(self.distance)

    def share_explained(self, within: float) -> float:
        """Return the share of the points on what is mapped that lie so near to it [m]; 0 without any."""
        explained = np.abs(self.distance[~self.beyond]) < within
        return float(explained.mean()) if len(explained) else 0.0


def residuals(
    sweep: Sweep,
    world: PreparedMap,
    map_from_base: Pose,
    *,
    backface_culling: bool = True,
    rough: bool = False,
) -> Residuals:
    """Compare a sweep with the cloud at a pose, by default only with what faces the scanner.

    Args:
        sweep: points in ``base_link``.
        world: the prepared cloud.
        map_from_base: the pose.
        backface_culling: whether points are not compared with surfaces seen from behind.
        rough: whether distances along walls are wanted too, and the nearest points exactly.
    """
    position, rotation = map_from_base.position, map_from_base.rotation
    found = plane_distances(
        sweep.points, sweep.origins, position, rotation, world.arrays, backface_culling, rough
    )
    return Residuals(*found, beyond=world.cut_below(map_from_base.apply(sweep.points)))


GRAZING = 0.1
"""Sine of the incidence, 6 degrees, below which a beam says the less of a surface: a transversal scanner under the edge of
a wall that it stands parallel to sees the ceiling, and a level one whose tilt only the ground constrains the floor."""


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
    known = np.linalg.inv(pose_covariance(covariance, "covariance of the prediction"))
    rough = world.noise.normal > config.rough
    config = adapted(config, world.noise)
    position, rotation, *_ = found = aligned(
        sweep.points,
        sweep.origins,
        lengths := sweep.beam_lengths(),
        prior.position,
        prior.rotation,
        known.astype(np.float64),
        world.arrays,
        world.spread,
        rough,
        *_first_kernels(covariance, config, rough=rough),
        config.iterations,
        _STEP_SHARE * config.sigma,
        _scales(config),
    )
    pose = Pose.from_rotation(position, rotation)
    seen = Residuals(*found[2:], beyond=world.cut_below(pose.apply(sweep.points)))
    return _conclude(sweep, world, pose, seen, lengths, config, rough=rough)


_UNSEEN = 1e-9
"""A direction in which a sweep has a smaller share of its most information is not observed, however exact the normals
are: rounding alone makes that much."""
_SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
_STEP_SHARE = 0.025
"""A step shorter than this share of a point's error ends the iterations: 0.5 mm in a smooth map, 1 mm in a grid."""


def _scales(config: RegistrationConfig) -> Scales:
    c = config
    return Scales(
        c.sigma, c.kernel, c.gate, c.tangential, c.effective_points, c.normal_noise, GRAZING, LEVER
    )


def adapted(config: RegistrationConfig, noise: MapNoise) -> RegistrationConfig:
    """Return the scales for a map whose points and normals have some noise.

    Half of the variance of a map's points is taken as common to those around a place. A sweep of N points
    that have it holds a direction to sigma / sqrt(N / 2) where half of them face it: N is limited such that
    this is not less than the common error.
    """
    sigma = math.hypot(config.sigma, noise.distance)
    common = 0.5 * noise.distance**2
    most = 2.0 * sigma**2 / common if common > 0.0 else math.inf
    config = replace(
        config,
        sigma=sigma,
        kernel=config.kernel * sigma / config.sigma,
        effective_points=min(config.effective_points, most),
        normal_noise=max(config.normal_noise, noise.normal),
    )
    if noise.normal <= config.rough:
        return config
    return replace(config, kernel=config.rough_kernel, kernel_wide=config.rough_kernel_wide)


def _first_kernels(
    covariance: FloatArray, config: RegistrationConfig, *, rough: bool
) -> tuple[float, float]:
    """Return the scales that the annealing begins with [m], for upright surfaces and for floors and ceilings.

    Each is two sigma of the least known direction that such surfaces show; an angle counts by what it moves at the
    lever. A heading that is not known well must not have the legs around a level scanner be taken for the floor.
    """
    x, y, z, roll, pitch, yaw = (2.0 * np.sqrt(np.diag(covariance)) * _SCALE).tolist()
    upright = max(x, y, roll, pitch, yaw)
    if rough and upright < config.gate * config.kernel:
        return config.kernel, config.kernel
    low, high = config.kernel, config.kernel_wide
    return min(max(upright, low), high), min(max(z, roll, pitch, low), high)


def _conclude(
    sweep: Sweep,
    world: PreparedMap,
    pose: Pose,
    seen: Residuals,
    lengths: FloatArray,
    config: RegistrationConfig,
    *,
    rough: bool,
) -> Match:
    """Return the match of a sweep that was seen at a pose."""
    weight = point_weights(
        seen.distance, seen.jacobian, seen.along, seen.across, seen.nearest, lengths, world.spread,
        config.kernel, config.kernel, True, _scales(config),
    )  # fmt: skip
    hessian, gradient = normal_equations(seen.jacobian, seen.distance, weight)
    # Noise s of a normal under a weight of 1/s^2 fakes as much as usual noise does under the whole weight.
    fake = _information_of_normal_noise(sweep, pose, weight, hessian, config.normal_noise)
    directions = observable_directions(hessian, fake, config)
    information, offset, ranges = np.zeros((6, 6)), np.zeros(6), None
    if len(directions):
        # Project on the observable directions W (rows, orthonormal in the scaled space).
        w, unscaled = directions * _SCALE, directions / _SCALE
        held = unscaled @ hessian @ unscaled.T
        information = w.T @ held @ w
        if rough:
            # What is held along a wall by its nearest points is where the sweep was put, no information.
            tangential = config.tangential * weight
            aside, pull = normal_equations(seen.along_jacobian, seen.along, tangential)
            held, gradient = held + unscaled @ aside @ unscaled.T, gradient + pull
        offset = -unscaled.T @ np.linalg.solve(held, unscaled @ gradient)
        if not rough:
            ranges = _range_fit(sweep, seen, lengths, weight, unscaled, held, offset)
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
        inlier_ratio=seen.share_explained(config.inlier_distance),
        ranges=ranges,
    )


def _range_fit(
    sweep: Sweep,
    seen: Residuals,
    lengths: FloatArray,
    weight: FloatArray,
    unscaled: FloatArray,
    held: FloatArray,
    offset: FloatArray,
) -> RangeFit:
    """Return what a sweep says of a range bias when its pose is left open: the Schur complement of the pose.

    Args:
        sweep: the sweep.
        seen: it against the cloud at a pose.
        lengths: (N,) of its beams [m].
        weight: (N,) of its points.
        unscaled: (k, 6) observable directions.
        held: (k, k) information of the pose in them.
        offset: (6,) from the pose to where the sweep alone fits best.
    """
    # The derivative of a distance by its range: the cosine between beam and normal.
    slope = seen.across / lengths
    slopes = slope[:, None] * np.stack([sweep.horizontal, ~sweep.horizontal], axis=1)
    weighted = weight[:, None] * slopes
    mixed = seen.jacobian.T @ weighted
    moved = np.linalg.solve(held, unscaled @ mixed)
    return RangeFit(
        gradient=weighted.T @ np.where(seen.valid, seen.distance, 0.0) + mixed.T @ offset,
        information=slopes.T @ weighted - (unscaled @ mixed).T @ moved,
        shift=-unscaled.T @ moved,
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
    # The sum of [p]x [p]x' = (p'p) I - p p'.
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
    # Eigenvectors mean directions only where metres and radians are made comparable.
    both = np.outer(_SCALE, _SCALE)
    values, vectors = np.linalg.eigh(hessian / both)
    faked = np.einsum("ji,jk,ki->i", vectors, fake / both, vectors)
    least = np.maximum(config.debias * faked, _UNSEEN * values[-1])
    directions: FloatArray = np.ascontiguousarray(vectors[:, values > least].T)
    directions.flags.writeable = False
    return directions
