"""Verification of places: how much of a sweep a pose explains there, and what that says for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from localization.filter.pose_error import difference
from localization.geometry import FloatArray, so3_exp, wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig, register
from localization.matching.scan_consistency import BeamClassifier
from localization.monitoring.belief import BeliefConfig, evidence_of
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.types import Candidate, Match, Pose, Sweep

SETTLING_SIGMA = (0.05, 0.05, 0.03, 0.01, 0.01, 0.02)
"""Assumed error of a pose that only has to settle: x, y, z [m], roll, pitch, yaw [rad], one sigma."""
HELD_OFF_SIGMA = (0.2, 0.2, 0.03, 0.01, 0.01, 0.1)
"""The same of an estimate that sweeps may have held off its place, as along the wrong side of a thin wall."""
FIXED_SIGMA = (0.001,) * 6
"""The same of an estimate that is judged where it is."""
SETTLING_REACH = 3.0 * SETTLING_SIGMA[0]
"""A pose that settles farther away than this [m] has settled at another place than it claims to be."""


def same_place(a: Pose, b: Pose, config: SearchConfig) -> bool:
    """Return whether two poses are one place within the search's resolution."""
    near = float(np.hypot(*(a.position - b.position)[:2])) < config.same_place
    return near and abs(wrap_angle(a.yaw - b.yaw)) < config.same_yaw


@dataclass(frozen=True, slots=True, eq=False)
class Weighing:
    """What weighs places: the evidence of sweeps, as it weighs the pose that stands."""

    beams: BeamClassifier
    """Classifies the beams that a place does not explain."""
    belief: BeliefConfig = field(default_factory=BeliefConfig)
    """What the classes say."""

    def of(self, sweep: Sweep, seen: Candidate, match: Match) -> tuple[Candidate, float]:
        """Return a place where a match has settled a sweep with the evidence of that, and the share that is mapped there.

        Args:
            sweep: points in ``base_link``.
            seen: the place.
            match: the registration there.
        """
        found = self.beams.classify(sweep, seen.map_from_base, match.distances)
        if found is None:
            return seen, 1.0
        return replace(seen, evidence=evidence_of(found, self.belief)), 1.0 - found.unmapped


def outside_map(world: PreparedMap, x: float, y: float, *, margin: float) -> str | None:
    """Return that a place is farther outside the map than ``margin`` [m], with the map's extent; None if it is not."""
    if world.contains(x, y, margin=margin):
        return None
    low, high = world.cloud.bounds
    return (
        f"({x:.1f}, {y:.1f}) lies outside the map, which spans x {low[0]:.1f} to {high[0]:.1f} "
        f"and y {low[1]:.1f} to {high[1]:.1f} m"
    )


def standing(world: PreparedMap, x: float, y: float, yaw: float, level: Pose) -> Pose:
    """Return the pose of a robot that stands on the ground: on its slope if uneven, else with the tilt given."""
    if not world.ground.level:
        return world.ground.stand(x, y, yaw)
    roll, pitch, _ = level.euler
    return Pose.from_euler([x, y, level.position[2]], roll=roll, pitch=pitch, yaw=yaw)


def explain(
    sweep: Sweep, world: PreparedMap, pose: Pose, registration: RegistrationConfig
) -> Candidate:
    """Settle a pose on the cloud within a few centimetres and return the share that it explains there.

    The pose's own tilt takes part: two planes of points hardly constrain pitch, and alone would allow any.
    """
    seen, _ = settled(sweep, world, pose, registration)
    return seen


def settled(
    sweep: Sweep,
    world: PreparedMap,
    pose: Pose,
    registration: RegistrationConfig,
    assumed: tuple[float, ...] = SETTLING_SIGMA,
) -> tuple[Candidate, Match]:
    """Settle a pose of an assumed error; return what it explains, and the match that did it."""
    sigma = np.array(assumed)
    match = register(sweep, world, pose, np.diag(sigma**2), registration)
    pull = match.information @ difference(pose, match.map_from_base)
    step = np.linalg.solve(np.diag(sigma**-2) + match.information, pull)
    level = Pose.from_rotation(pose.position + step[:3], pose.rotation @ so3_exp(step[3:]))
    # Where a room shows place and heading only together, the match's information leaves that direction out, and the pose
    # would stay off by decimetres. The match has found it all the same; what the sweep does not show, its prior held.
    position = np.append(match.map_from_base.position[:2], level.position[2])
    roll, pitch, _ = level.euler
    at = Pose.from_euler(position, roll=roll, pitch=pitch, yaw=match.map_from_base.yaw)
    return Candidate(at, match.inlier_ratio), match


def settled_estimate(
    sweep: Sweep,
    world: PreparedMap,
    estimate: Pose,
    registration: RegistrationConfig,
    own: Callable[[Pose], bool],
    assumed: Sequence[tuple[float, ...]] = (SETTLING_SIGMA,),
) -> tuple[Candidate, Match]:
    """Return what an estimate explains at its best around where it is, and the match that did it.

    A sweep may pull a pose by decimetres, to the right place. What it explains there does not speak for the estimate,
    which is then judged where it is.

    Args:
        sweep: the newest one.
        world: the prepared map.
        estimate: at the sweep's stamp.
        registration: how a sweep is registered.
        own: whether a pose is still the estimate's place.
        assumed: errors of the estimate, each of which is tried.
    """
    tried = [settled(sweep, world, estimate, registration, sigma) for sigma in assumed]
    found = [(seen, match) for seen, match in tried if own(seen.map_from_base)]
    if found:
        return max(found, key=lambda one: one[0].score)
    return settled(sweep, world, estimate, registration, FIXED_SIGMA)


def unseen_within(match: Match, window: Window) -> FloatArray | None:
    """Return what a sweep leaves open of a place that was found within a window, as along a bare corridor.

    Args:
        match: The sweep's registration at the place.
        window: Where it was searched for; a place may be anywhere in it.

    Returns:
        Covariance (6, 6) as in ``Estimate``, of an even distribution over the window in the directions of the floor
        that the sweep does not show; None if it shows all of them.
    """
    spread = window.half_width**2 / 3.0
    values, directions = np.linalg.eigh(match.information[:2, :2])
    open_ = directions[:, values * spread < 1.0]
    if not open_.size:
        return None
    covariance = np.zeros((6, 6))
    covariance[:2, :2] = spread * open_ @ open_.T
    return covariance
