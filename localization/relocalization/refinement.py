"""Refinement of coarse places against the cloud, and the distinct ones among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig, register
from localization.matching.scan_consistency import BeamClassifier
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_work import REFINEMENT, SearchWork, Work
from localization.relocalization.verification import (
    SETTLING_SIGMA,
    explain,
    same_place,
    settled,
    standing,
)
from localization.types import Candidate, Match, Pose, Sweep

_LEAST_SCORE = 0.3
"""Places on the floor plan that score less are not refined."""
_WIDER, _LONGER = 2.0, 6
"""From a place on the floor plan registration begins with so many times the usual scale, and takes so many more steps."""
_MOST_EXAMINED = 20_000
"""Number of the best-scoring places among which distinct ones are chosen."""


def best_places(
    scores: FloatArray, places: FloatArray, yaws: FloatArray, config: SearchConfig, *, most: int
) -> list[tuple[float, float, float]]:
    """Return the best x, y, yaw, none within another's place (non-maximum suppression).

    Args:
        scores: (N,).
        places: (N, 2) [m].
        yaws: (N,) [rad].
        config: what counts as one place.
        most: largest number of places.
    """
    kept = np.flatnonzero(scores >= _LEAST_SCORE)
    if len(kept) > _MOST_EXAMINED:
        kept = np.sort(kept[np.argpartition(-scores[kept], _MOST_EXAMINED - 1)[:_MOST_EXAMINED]])
    kept = kept[np.argsort(-scores[kept], kind="stable")]
    x, y, yaw = places[kept, 0], places[kept, 1], yaws[kept]
    left = np.ones(len(kept), dtype=bool)
    chosen: list[tuple[float, float, float]] = []
    while len(chosen) < most and left.any():
        i = int(left.argmax())
        chosen.append((float(x[i]), float(y[i]), float(yaw[i])))
        near = np.hypot(x - x[i], y - y[i]) <= config.same_place
        turned = np.remainder(yaw - yaw[i] + np.pi, 2.0 * np.pi) - np.pi
        left &= ~(near & (np.abs(turned) <= config.same_yaw))
        left[i] = False
    return chosen


def refined_places(
    sweep: Sweep,
    world: PreparedMap,
    peaks: Sequence[tuple[float, float, float]],
    level: Pose,
    config: SearchConfig,
    registration: RegistrationConfig,
    beams: BeamClassifier,
) -> SearchWork:
    """Refine places (x, y, yaw) against the cloud; yields the amount of work, returns the distinct ones."""
    max_tilt = config.max_tilt if world.ground.level else config.max_tilt_uneven
    found: list[Candidate] = []
    for x, y, yaw in peaks:
        yield REFINEMENT
        start = standing(world, x, y, yaw, level)
        candidate = _refined(sweep, world, start, config, registration)
        # The third rows are the map's vertical in the robot's axes.
        upright = candidate.map_from_base.rotation[2] @ start.rotation[2] > np.cos(max_tilt)
        if upright:
            found.append(candidate)
    distinct = _distinct(found, config)
    for i, candidate in enumerate(distinct[: config.compared]):
        distinct[i] = yield from _best_along(sweep, world, candidate, config, registration, beams)
    # A neighbour along a corridor may be a place that was found already.
    return tuple(_distinct(distinct, config))


def _distinct(places: Sequence[Candidate], config: SearchConfig) -> list[Candidate]:
    """Return the best candidate of each place, best first."""
    distinct: list[Candidate] = []
    for one in sorted(places, key=lambda c: -c.score):
        if not any(same_place(one.map_from_base, d.map_from_base, config) for d in distinct):
            distinct.append(one)
    return distinct


def _best_along(
    sweep: Sweep,
    world: PreparedMap,
    place: Candidate,
    config: SearchConfig,
    registration: RegistrationConfig,
    beams: BeamClassifier,
) -> Work[Candidate]:
    """Compare a place with its neighbours in the direction that constrains the robot least.

    Refining ends where walls lie on walls. In a corridor or between shelves that is so every few
    decimetres, and of neighbours as near as that only one was refined.
    """

    def fits(at: Pose) -> tuple[Candidate, float, Match]:
        """Settle a pose; the closeness is that of the beams that end where something is mapped."""
        seen, closeness, match = settled(sweep, world, at, registration)
        classes = beams.classify(sweep, seen.map_from_base, match.distances, every=True)
        mapped = 1.0 if classes is None else 1.0 - classes.unmapped
        return seen, closeness / max(mapped, config.min_inlier_ratio), match

    best, closest, match = fits(place.map_from_base)
    _, directions = np.linalg.eigh(match.information[:2, :2])
    pose = best.map_from_base
    for way in np.arange(1, round(config.neighbours / config.step) + 1) * config.step:
        yield REFINEMENT
        for sign in (-1.0, 1.0):
            offset = np.append(sign * way * directions[:, 0], 0.0)
            shifted = Pose(pose.position + offset, pose.quaternion_wxyz)
            other, closeness, _ = fits(shifted)
            # A horizontal scan fits nothing more closely than the floor, once it has sunk there.
            climb = abs(float(other.map_from_base.position[2] - pose.position[2]))
            if closeness > closest and climb < 3.0 * SETTLING_SIGMA[2]:
                best, closest = other, closeness
    return best


def _refined(
    sweep: Sweep,
    world: PreparedMap,
    start: Pose,
    config: SearchConfig,
    registration: RegistrationConfig,
) -> Candidate:
    wide = replace(
        registration,
        kernel_wide=_WIDER * registration.kernel_wide,
        iterations=registration.iterations + _LONGER,
    )
    sigma = np.array([config.step, config.step, 0.03, 0.02, 0.02, config.step_yaw])
    near = register(sweep, world, start, np.diag((2.0 * sigma) ** 2), wide).map_from_base
    # A wall that is too far away from the start can be reached by pitch as well. The robot's tilt is known
    # better than that: restore it, and settle the rest.
    x, y = float(near.position[0]), float(near.position[1])
    return explain(sweep, world, standing(world, x, y, near.yaw, start), registration)
