"""Refinement of coarse places against the cloud, and the distinct ones among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from localization.geometry import FloatArray, wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig, register
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window
from localization.relocalization.search_work import REFINEMENT, SearchWork, Work
from localization.relocalization.verification import (
    SETTLING_SIGMA,
    Weighing,
    same_place,
    settled,
    standing,
    unseen_within,
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
    weighing: Weighing,
    window: Window | None = None,
) -> SearchWork:
    """Refine places (x, y, yaw) against the cloud; yields the amount of work, returns the distinct ones, best first.

    In a window, where the best may be believed at once, a neighbour that the sweep does not distinguish from it is
    another place, however near.
    """
    max_tilt = config.max_tilt if world.ground.level else config.max_tilt_uneven
    found: list[Candidate] = []
    for x, y, yaw in peaks:
        yield REFINEMENT
        start = standing(world, x, y, yaw, level)
        candidate = _refined(sweep, world, start, config, registration, weighing)
        # The third rows are the map's vertical in the robot's axes.
        upright = candidate.map_from_base.rotation[2] @ start.rotation[2] > np.cos(max_tilt)
        if upright:
            found.append(candidate)
    distinct, rivals = _distinct(found, config), dict[Candidate, Candidate]()
    for i, candidate in enumerate(distinct[: config.compared]):
        best, match, rival = yield from _best_along(
            sweep, world, candidate, config, registration, weighing
        )
        distinct[i] = best
        # Along a bare corridor all neighbours are alike, which the covariance of the placement says.
        if rival is not None and window is not None and unseen_within(match, window) is None:
            rivals[best] = rival
    # A neighbour along a corridor may be a place that was found already.
    places = _distinct(distinct, config)
    others = places[1:] + [rivals[best] for best in places[:1] if best in rivals]
    return (*places[:1], *sorted(others, key=lambda c: -c.evidence))


def _distinct(places: Sequence[Candidate], config: SearchConfig) -> list[Candidate]:
    """Return the best candidate of each place, best first."""
    distinct: list[Candidate] = []
    for one in sorted(places, key=lambda c: -c.evidence):
        if not any(same_place(one.map_from_base, d.map_from_base, config) for d in distinct):
            distinct.append(one)
    return distinct


def _best_along(
    sweep: Sweep,
    world: PreparedMap,
    place: Candidate,
    config: SearchConfig,
    registration: RegistrationConfig,
    weighing: Weighing,
) -> Work[tuple[Candidate, Match, Candidate | None]]:
    """Compare a place with its neighbours in the direction that constrains the robot least.

    Refining ends where walls lie on walls. In a corridor or between shelves that is so every few
    decimetres, and of neighbours as near as that only one was refined.

    Returns:
        The best of them and its match, and another that fits as closely within the error of the comparison.
    """

    def fits(at: Pose) -> _Fit:
        """Settle a pose. The share counts points within 10 cm; neighbours explain almost as much, but less closely."""
        seen, match = settled(sweep, world, at, registration)
        seen, mapped = weighing.of(sweep, seen, match)
        kernel2 = registration.kernel**2
        closeness = np.nan_to_num((kernel2 / (kernel2 + match.distances**2)) ** 2)
        return seen, closeness / max(mapped, weighing.belief.mostly), match

    tried = [fits(place.map_from_base)]
    _, directions = np.linalg.eigh(tried[0][2].information[:2, :2])
    pose = tried[0][0].map_from_base
    for way in np.arange(1, round(config.default_sigma / config.step) + 1) * config.step:
        yield REFINEMENT
        for sign in (-1.0, 1.0):
            offset = np.append(sign * way * directions[:, 0], 0.0)
            shifted = Pose(pose.position + offset, pose.quaternion_wxyz)
            fit = fits(shifted)
            # A horizontal scan fits nothing more closely than the floor, once it has sunk there.
            climb = abs(float(fit[0].map_from_base.position[2] - pose.position[2]))
            if climb < 3.0 * SETTLING_SIGMA[2]:
                tried.append(fit)
    best = max(tried, key=_closeness)
    alike = [fit for fit in tried if _rivals(best, fit, config, registration)]
    return best[0], best[2], max(alike, key=_closeness)[0] if alike else None


_Fit = tuple[Candidate, FloatArray, Match]
"""A settled place, how closely it fits each point (N,) in [0, 1], over the share of points where something is mapped,
and the match."""


def _closeness(fit: _Fit) -> float:
    return float(fit[1].mean()) if len(fit[1]) else 0.0


def _rivals(
    best: _Fit, other: _Fit, config: SearchConfig, registration: RegistrationConfig
) -> bool:
    """Return whether another place, farther off than the steps of the search, fits as closely within one standard error.

    The error is that of the mean difference, of as many independent points as a sweep has.
    """
    a, b = best[0].map_from_base, other[0].map_from_base
    near = float(np.hypot(*(a.position - b.position)[:2])) <= config.step
    if near and abs(wrap_angle(a.yaw - b.yaw)) <= config.step_yaw:
        return False
    off = best[1] - other[1]
    return float(off.mean()) < float(np.sqrt((off**2).mean() / registration.effective_points))


def _refined(
    sweep: Sweep,
    world: PreparedMap,
    start: Pose,
    config: SearchConfig,
    registration: RegistrationConfig,
    weighing: Weighing,
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
    seen, match = settled(sweep, world, standing(world, x, y, near.yaw, start), registration)
    return weighing.of(sweep, seen, match)[0]
