"""Places of a scenario in its world: names and coordinates become poses and goals."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from localization.geometry import FloatArray
from localization.types import SECOND, Hint, Pose
from robot_sim import World, WorldError
from robot_sim.errors import nearest
from robot_sim.standing_pose import standing_pose
from teleop.scenario.files.scenario import Scenario, Start
from teleop.scenario.files.schema import Place
from teleop.scenario.referee.referee import GoalPoint

_EXACT = 0.05
"""Uncertainty of a pose that the robot is given exactly [m]: it looks no further than this around it."""
_EXACT_HEADING = math.radians(1.0)
"""Uncertainty of its heading [rad]."""
_LEAST_SIGMA = 0.5
"""Least uncertainty of a pose that the robot is given [m]."""
_LEAST_SIGMA_HEADING = math.radians(10.0)
"""Least uncertainty of a heading that it is given [rad]."""

_PASSED: Final = 1.0
"""Distance at which a way-point of a tour is passed [m]: who drives by a look-ahead turns before a blind alley's end."""
_TOUR_END: Final = 0.5
"""Distance from the end of a tour at which the robot must stand [m]."""
_TOUR_REST: Final = 2 * SECOND
"""Time for which it must be there [ns]: it brakes from 0.6 m/s in 1.6 s, and is seen to stand."""


def named_poses(world: World) -> dict[str, Pose]:
    """Return ``map_from_base`` at each start pose and each place of a world; a place goes before a start."""
    return {**world.spawns, **world.places}


def position_of(world: World, place: Place) -> tuple[float, float]:
    """Return x and y of a place in ``map`` [m].

    Raises:
        WorldError: The world has no place of this name; the message lists the nearest ones.
    """
    if not isinstance(place, str):
        return place[0], place[1]
    x, y = _named(world, place).position[:2].tolist()
    return x, y


def heading_of(world: World, place: Place) -> float:
    """Return the heading of a place in ``map`` [rad], 0 if it has none.

    Raises:
        WorldError: The world has no place of this name; the message lists the nearest ones.
    """
    if isinstance(place, str):
        return _named(world, place).yaw
    return math.radians(place[2]) if len(place) == 3 else 0.0


def pose_of(world: World, place: Place) -> Pose:
    """Return ``map_from_base`` of a robot that stands at a place.

    Raises:
        WorldError: The world has no place of this name, or there is no ground.
    """
    if isinstance(place, str):
        return _named(world, place)
    return standing_pose(world, place[0], place[1], heading_of(world, place))


def start_pose(world: World, start: Start) -> Pose:
    """Return ``map_from_base`` at which the robot starts."""
    return world.spawn if start.at is None else pose_of(world, start.at)


def goal_points(world: World, scenario: Scenario) -> tuple[GoalPoint, ...]:
    """Return the goals of a scenario with their positions."""
    if scenario.mission.tour:
        return _tour_points(world)
    points = []
    for goal in scenario.mission.goals:
        x, y = position_of(world, goal.at)
        name = goal.at if isinstance(goal.at, str) else f"{x:g}, {y:g}"
        points.append(GoalPoint(name, x, y, goal.within, round(goal.stay * SECOND)))
    return tuple(points)


def _tour_points(world: World) -> tuple[GoalPoint, ...]:
    """Return the way-points of a world's tour as goals; at the last one the robot must stand."""
    last = len(world.tour) - 1
    return tuple(
        GoalPoint(f"{x:g}, {y:g}", x, y, *((_TOUR_END, _TOUR_REST) if n == last else (_PASSED, 0)))
        for n, (x, y) in enumerate(world.tour)
    )


def given_pose(scenario: Scenario, true: Pose) -> Hint | None:
    """Return what the robot knows of its start: a hint at time zero; None for nothing."""
    start = scenario.start
    if start.known == "nothing":
        return None
    if start.known == "exactly":
        return Hint(0, true, _covariance(_EXACT, _EXACT_HEADING))
    turned = math.radians(start.turned)
    sigma, heading = (
        max(_LEAST_SIGMA, start.off / 2.0),
        max(_LEAST_SIGMA_HEADING, abs(turned) / 2.0),
    )
    covariance = _covariance(sigma, heading)
    return Hint(0, displaced(true, start.off, turned, seed=scenario.seed, stream=1), covariance)


def _covariance(sigma: float, heading: float) -> FloatArray:
    """Return the covariance of a hint (6, 6) from the standard deviations of x and y [m] and yaw [rad]."""
    return np.diag([sigma**2, sigma**2, 0.0, 0.0, 0.0, heading**2])


def displaced(pose: Pose, off: float, turned: float, *, seed: int, stream: int) -> Pose:
    """Return a pose that is wrong: moved and turned in a direction drawn by a seed.

    Args:
        pose: The right pose.
        off: Distance by which it is moved on the floor [m].
        turned: Angle by which it is turned [rad], to the left or right.
        seed: Seed of the scenario.
        stream: Number by which different draws of one seed differ.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, stream]))
    bearing = float(rng.uniform(-math.pi, math.pi))
    side = float(rng.choice([-1.0, 1.0]))
    position = pose.position + off * np.array([math.cos(bearing), math.sin(bearing), 0.0])
    turn = Pose.from_euler(np.zeros(3), yaw=side * turned)
    return Pose(position, (pose @ turn).quaternion_wxyz)


def _named(world: World, name: str) -> Pose:
    poses = named_poses(world)
    if name in poses:
        return poses[name]
    raise WorldError(f"{world.name} has no place {name!r}; {nearest(name, sorted(poses))}")
