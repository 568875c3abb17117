"""The briefing of an operator of the library: goals, and a way to them over free floor."""

from __future__ import annotations

from localization.types import SECOND
from robot_sim import World, WorldError
from robot_sim.survey.drivable_routes import drivable_route
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.operator import Briefing, GoalPlace, Point
from teleop.scenario.session.places import goal_points, start_pose


def briefing_of(scenario: Scenario, world: World) -> Briefing:
    """Return the briefing of a scenario's operator.

    Raises:
        GoalError: A goal cannot be driven to.
    """
    speed = getattr(scenario.operator, "speed", 0.6)
    points = goal_points(world, scenario)
    x, y = start_pose(world, scenario.start).position[:2].tolist()
    places, within = [(goal.x, goal.y) for goal in points], [goal.within for goal in points]
    if scenario.mission.tour:  # whose legs are drivable as they are
        ways: tuple[tuple[Point, ...], ...] = tuple((place,) for place in places)
    else:
        ways = drivable_route(world, (x, y), places, within=within)
    goals = tuple(
        GoalPlace((goal.x, goal.y), goal.within, goal.stay / SECOND, way)
        for goal, way in zip(points, ways, strict=True)
    )

    def find_way(here: Point, goal: Point) -> tuple[Point, ...]:
        """Return a way over free floor; empty if there is none."""
        try:
            return drivable_route(world, here, [goal])[0]
        except WorldError:
            return ()

    return Briefing(goals, scenario.seed, speed, tuple(world.tour), find_way)
