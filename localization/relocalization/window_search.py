"""Find the robot in a window around a hint: search all of it, refine the best, verify, and answer.

Correlative search (Olson 2009): the horizontal scanner's points are laid over a floor plan of the cloud
at the scanner's height, at every position and heading of the window. The best few places are refined
against the whole cloud with both scanners. The work is a generator that gives control back after a fixed
number of candidates, so that it costs each tick the same and the result never depends on the clock.
The localiser itself uses ``whole_map.search_map``, which finds the same in a window without trying all of it.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from localization.geometry import FloatArray, rotation_from_euler, so3_exp, wrap_angle
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig, difference, register
from localization.types import Candidate, Match, Pose, Sweep

_NEAR = (0.05, 0.05, 0.03, 0.01, 0.01, 0.02)
"""How near a pose is that only has to settle: x, y, z [m], roll, pitch, yaw [rad], one sigma."""


@dataclass(frozen=True, slots=True)
class SearchConfig:
    """How a window is searched and what counts as found."""

    step: float = 0.10
    """Distance between candidate positions [m]."""
    step_yaw: float = np.deg2rad(2.0)
    """Between candidate headings [rad]."""
    beams: int = 72
    """How many points of the horizontal scanner are laid over the floor plan."""
    field_sigma: float = 0.12
    """A point this far from the nearest wall counts exp(-1/2) [m]."""
    cell: float = 0.05
    """Of the floor plan [m]."""
    refine: int = 8
    """How many of the best places are refined against the cloud."""
    compared: int = 2
    """How many of the distinct places are compared with their neighbours along the weakest direction."""
    neighbours: float = 0.5
    """... which lie so far to either side at most [m]."""
    budget: int = 6000
    """Candidates per tick; a refinement counts as many as this."""
    smallest_window: float = 0.5
    """Half width of the window at least [m]."""
    smallest_window_yaw: float = np.deg2rad(10.0)
    """The same for heading [rad]."""
    largest_window: float = 3.0
    """Half width at most [m]; more would be a search of the whole map."""
    default_sigma: float = 0.5
    """Of a hint with all-zero covariance, in x and y [m]."""
    default_sigma_yaw: float = np.deg2rad(15.0)
    """The same for heading [rad]."""
    min_inlier_ratio: float = 0.55
    """A pose must explain this share of the sweep to be believed."""
    least_margin: float = 0.1
    """... and this share more of it than any other distinct place,"""
    decisive: float = 2.0
    """or leave so many times less of it unexplained than any other place does,"""
    decisive_floor: float = 0.04
    """beside this share, which noise and clutter leave unexplained anywhere."""
    most_tilt: float = np.deg2rad(2.0)
    """A place that is explained only by tilting the robot from level by more is none [rad]: pitched
    far enough, the points of a wall that is not there come to lie on the floor."""
    most_tilt_uneven: float = np.deg2rad(4.5)
    """The same from how uneven ground slopes there [rad]: 3 cm, the grain of such ground, under a wheel
    0.39 m from the next."""
    same_place: float = 0.3
    """Poses nearer than this are one place [m]."""
    same_yaw: float = np.deg2rad(10.0)
    """The same for heading [rad]."""


@dataclass(frozen=True, slots=True)
class Window:
    """Where to search: centre in ``map`` and half widths."""

    x: float
    y: float
    yaw: float
    half_width: float
    """Of x and y [m]."""
    half_yaw: float
    """[rad]."""


class FloorPlan:
    """Distance to the nearest mapped surface at the horizontal scanner's height, on a grid.

    That height is counted from the ground under the surface, where the ground is not level.
    """

    def __init__(self, world: PreparedMap, height: float, *, cell: float, sigma: float) -> None:
        points = world.cloud.points
        # Half the cloud's point spacing and a degree of tilt at 10 m.
        above = points[:, 2] - world.ground.heights(points[:, :2])
        slice_ = points[np.abs(above - height) < 0.12]
        margin = 5.0
        low, high = world.cloud.bounds
        self.origin: FloatArray = low[:2] - margin
        self.cell = cell
        size = np.ceil((high[:2] - low[:2] + 2.0 * margin) / cell).astype(int) + 1
        occupied = np.zeros(tuple(size), dtype=bool)
        occupied[tuple(((slice_[:, :2] - self.origin) / cell).astype(int).T)] = True
        if occupied.any():
            distance = ndimage.distance_transform_edt(~occupied) * cell
        else:
            distance = np.full(occupied.shape, np.inf)
        self.likelihood = np.exp(-0.5 * (distance / sigma) ** 2).astype(np.float32)
        """(nx, ny) how well a point there lies on a surface, in [0, 1]."""
        self.free = distance > 0.15
        """(nx, ny) whether a scanner could be there."""

    def score(self, points: FloatArray, places: FloatArray) -> FloatArray:
        """Return for each place (M, 2) how well points (B, 2), turned already, lie on surfaces."""
        at = places[:, None, :] + points[None, :, :]
        cell = ((at - self.origin) / self.cell).astype(np.int64)
        limit = np.array(self.likelihood.shape) - 1
        cell = np.clip(cell, 0, limit)
        score = self.likelihood[cell[..., 0], cell[..., 1]].mean(axis=1)
        own = np.clip(((places - self.origin) / self.cell).astype(np.int64), 0, limit)
        free: FloatArray = np.where(self.free[own[:, 0], own[:, 1]], score, 0.0)
        return free


def search(
    sweep: Sweep,
    world: PreparedMap,
    plan: FloorPlan,
    window: Window,
    level: Pose,
    config: SearchConfig = SearchConfig(),
) -> Generator[None, None, tuple[Candidate, ...]]:
    """Search a window; yields after each budget's worth of work and returns the places found.

    Args:
        sweep: points in ``base_link`` at one instant.
        world: the prepared cloud.
        plan: its floor plan at the horizontal scanner's height.
        window: where to look.
        level: a pose whose height, roll and pitch the robot has on level ground; x, y and yaw are not
            used.
        config: steps and thresholds.

    Returns:
        Distinct places, best first, each with the share of the sweep that it explains.
    """
    flat = level_points(sweep, level)
    if len(flat) < 10:
        return ()
    flat = flat[np.linspace(0, len(flat) - 1, min(config.beams, len(flat))).astype(int)]

    steps = np.arange(
        -np.ceil(window.half_width / config.step), window.half_width / config.step + 1
    )
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2) * config.step
    places = grid + [window.x, window.y]
    turns = int(np.ceil(window.half_yaw / config.step_yaw))
    yaws = window.yaw + config.step_yaw * np.arange(-turns, turns + 1, dtype=np.float64)
    scores = np.empty((len(yaws), len(places)))
    spent = 0
    for i, yaw in enumerate(yaws):
        c, s = np.cos(yaw), np.sin(yaw)
        scores[i] = plan.score(flat @ np.array([[c, s], [-s, c]]), places)
        spent += len(places)
        if spent >= config.budget:
            spent = 0
            yield

    heading, place = np.divmod(np.arange(scores.size), len(places))
    peaks = best_places(scores.ravel(), places[place], yaws[heading], config, most=config.refine)
    return (yield from refined_places(sweep, world, peaks, level, config))


def level_points(sweep: Sweep, level: Pose) -> FloatArray:
    """Return the horizontal scanner's points (N, 2) as seen from above, were the robot at no yaw [m]."""
    roll, pitch, _ = level.euler
    flat: FloatArray = sweep.points[sweep.horizontal] @ rotation_from_euler(roll, pitch, 0.0).T
    return flat[:, :2]


def refined_places(
    sweep: Sweep,
    world: PreparedMap,
    peaks: Sequence[tuple[float, float, float]],
    level: Pose,
    config: SearchConfig,
) -> Generator[None, None, tuple[Candidate, ...]]:
    """Refine places (x, y, yaw) against the cloud; yields before each, returns the distinct ones."""
    most_tilt = config.most_tilt if world.ground.level else config.most_tilt_uneven
    found: list[Candidate] = []
    for x, y, yaw in peaks:
        yield
        start = _standing(world, x, y, yaw, level)
        candidate = _refine(sweep, world, start, config)
        # The third rows are the map's vertical as the robot has it.
        upright = candidate.map_from_base.rotation[2] @ start.rotation[2] > np.cos(most_tilt)
        if upright:
            found.append(candidate)
    distinct = _distinct(found, config)
    for i, candidate in enumerate(distinct[: config.compared]):
        distinct[i] = yield from _best_along(sweep, world, candidate, config)
    # What was looked for along a corridor may be a place that was found already.
    return tuple(_distinct(distinct, config))


def _distinct(places: Sequence[Candidate], config: SearchConfig) -> list[Candidate]:
    """Return the best of what is one place, best first."""
    distinct: list[Candidate] = []
    for one in sorted(places, key=lambda c: -c.score):
        if not any(same_place(one.map_from_base, d.map_from_base, config) for d in distinct):
            distinct.append(one)
    return distinct


def _best_along(
    sweep: Sweep, world: PreparedMap, place: Candidate, config: SearchConfig
) -> Generator[None, None, Candidate]:
    """Look to and fro for a neighbour that fits closer, in the direction that holds the robot least.

    Refining ends where walls lie on walls. In a corridor or between shelves that is so every few
    decimetres, and of neighbours as near as that only one was refined.
    """
    best, closest, match = _settle(sweep, world, place.map_from_base)
    _, directions = np.linalg.eigh(match.information[:2, :2])
    pose = best.map_from_base
    for way in np.arange(1, round(config.neighbours / config.step) + 1) * config.step:
        yield
        for sign in (-1.0, 1.0):
            offset = np.append(sign * way * directions[:, 0], 0.0)
            shifted = Pose(pose.position + offset, pose.quaternion_wxyz)
            other, closeness, _ = _settle(sweep, world, shifted)
            # A level scan fits nothing closer than the floor, once it has sunk there.
            climb = abs(float(other.map_from_base.position[2] - pose.position[2]))
            if closeness > closest and climb < 3.0 * _NEAR[2]:
                best, closest = other, closeness
    return best


def window_of(
    pose: Pose,
    covariance: FloatArray,
    config: SearchConfig = SearchConfig(),
) -> Window:
    """Return the three-sigma window around a pose; all-zero covariance means the default sigma.

    Args:
        pose: centre, ``map_from_base``.
        covariance: (6, 6) in ROS's order.
        config: defaults and limits.
    """
    if not covariance.any():
        sigma, sigma_yaw = config.default_sigma, config.default_sigma_yaw
    else:
        sigma = float(np.sqrt(max(covariance[0, 0], covariance[1, 1])))
        sigma_yaw = float(np.sqrt(covariance[5, 5]))
    return Window(
        float(pose.position[0]),
        float(pose.position[1]),
        pose.yaw,
        float(np.clip(3.0 * sigma, config.smallest_window, config.largest_window)),
        float(np.clip(3.0 * sigma_yaw, config.smallest_window_yaw, np.pi)),
    )


def same_place(a: Pose, b: Pose, config: SearchConfig = SearchConfig()) -> bool:
    """Return whether two poses are one place within the search's resolution."""
    near = float(np.hypot(*(a.position - b.position)[:2])) < config.same_place
    return near and abs(wrap_angle(a.yaw - b.yaw)) < config.same_yaw


def distinguishable(best: float, second: float, config: SearchConfig) -> bool:
    """Return whether two places' explained shares tell them apart."""
    clear = best - second >= config.least_margin
    return clear or 1.0 - second >= config.decisive * (1.0 - best) + config.decisive_floor


def explain(sweep: Sweep, world: PreparedMap, pose: Pose) -> Candidate:
    """Settle a pose on the cloud within a few centimetres and return the share it explains there.

    The pose's own tilt has a say: two planes of points hardly hold pitch, and alone would have it
    anything.
    """
    return _settle(sweep, world, pose)[0]


def _settle(sweep: Sweep, world: PreparedMap, pose: Pose) -> tuple[Candidate, float, Match]:
    """Settle a pose; return what it explains, how closely in [0, 1], and the match that did it."""
    sigma = np.array(_NEAR)
    match = register(sweep, world, pose, np.diag(sigma**2))
    pull = match.information @ difference(pose, match.map_from_base)
    step = np.linalg.solve(np.diag(sigma**-2) + match.information, pull)
    settled = Pose.from_rotation(pose.position + step[:3], pose.rotation @ so3_exp(step[3:]))
    # The shares count what is within 10 cm. Neighbours explain almost as much, but with centimetres left.
    square, kernel2 = match.distances**2, RegistrationConfig().kernel ** 2
    closeness = float(np.nansum((kernel2 / (kernel2 + square)) ** 2)) / max(len(square), 1)
    return Candidate(settled, match.inlier_ratio), closeness, match


def _refine(sweep: Sweep, world: PreparedMap, start: Pose, config: SearchConfig) -> Candidate:
    wide = RegistrationConfig(kernel_wide=0.3, iterations=14)
    sigma = np.array([config.step, config.step, 0.03, 0.02, 0.02, config.step_yaw])
    near = register(sweep, world, start, np.diag((2.0 * sigma) ** 2), wide).map_from_base
    # A wall that is too far off for the start's place can be reached by pitch as well. How the robot
    # stands is known better than that: stand it up again and settle the rest.
    x, y = float(near.position[0]), float(near.position[1])
    return explain(sweep, world, _standing(world, x, y, near.yaw, start))


def _standing(world: PreparedMap, x: float, y: float, yaw: float, level: Pose) -> Pose:
    """Stand the robot on uneven ground as it slopes there; on level ground as it stands by itself."""
    if not world.ground.level:
        return world.ground.stand(x, y, yaw)
    roll, pitch, _ = level.euler
    return Pose.from_euler([x, y, level.position[2]], roll=roll, pitch=pitch, yaw=yaw)


def best_places(
    scores: FloatArray, places: FloatArray, yaws: FloatArray, config: SearchConfig, *, most: int
) -> list[tuple[float, float, float]]:
    """Return the best x, y, yaw, none within another's place (non-maximum suppression).

    Args:
        scores: (N,).
        places: (N, 2) [m].
        yaws: (N,) [rad].
        config: what counts as one place.
        most: how many at most.
    """
    chosen: list[tuple[float, float, float]] = []
    order = np.argsort(-scores, kind="stable")
    if len(order) > 20_000:
        order = order[:20_000]
    for i in order.tolist():
        x, y, yaw = float(places[i, 0]), float(places[i, 1]), float(yaws[i])
        if scores[i] < 0.3:
            break
        if all(
            np.hypot(x - a, y - b) > config.same_place or abs(wrap_angle(yaw - c)) > config.same_yaw
            for a, b, c in chosen
        ):
            chosen.append((x, y, yaw))
            if len(chosen) == most:
                break
    return chosen
