"""Checks of a scenario against its world, before anything is run: what can never be, and what would work.

Each finds the field that is wrong, so that a file's reader can name its line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np

from robot_sim import (
    INERTIAL_UNITS,
    LIDARS,
    DriveConfig,
    World,
    WorldError,
    doorways,
    scene_names,
)
from robot_sim.actors.extras import check_path, door_named
from robot_sim.arm.arm_table import load_arm
from robot_sim.errors import ArmError, nearest
from robot_sim.layout.footprints import Footprint
from robot_sim.layout.path_collisions import check_ways
from robot_sim.scene_objects.floor_surfaces import SURFACES
from robot_sim.survey.drivable_routes import GoalError, checked_pose, drivable_route
from robot_sim.worlds.from_floorplan import plan_blocks
from teleop.scenario.files.errors import FieldPath, ScenarioError
from teleop.scenario.files.faults import (
    BoardUnplugged,
    Box,
    DoorClosed,
    Fault,
    Kidnap,
    Link,
    ScannerDead,
    ScannerDirty,
    Walker,
)
from teleop.scenario.files.operator_settings import Hand, Station
from teleop.scenario.files.scenario import NO_SCANNERS, Scenario, WorldSettings
from teleop.scenario.files.schema import Place
from teleop.scenario.session.places import heading_of, position_of, start_pose
from teleop.scenario.session.world_extras import extra_of

_MAX_SPEED = DriveConfig().max_speed
"""Greatest forward speed of the robot [m/s]."""
_FILES = (".toml", ".xml")
"""Endings of floor plans and MJCF files."""


def check_settings(settings: WorldSettings, folder: Path | None = None) -> None:
    """Raise a ScenarioError if there is no such scene or sensor.

    Args:
        settings: World of a scenario.
        folder: Folder of the scenario's file, in which scenes of its own are looked for.
    """
    _check_scene(settings.scene, folder)
    for field, models in (("scanner", LIDARS), ("inertial", INERTIAL_UNITS)):
        name = getattr(settings, field)
        known = ("default", *models, *((NO_SCANNERS,) if field == "scanner" else ()))
        if name not in known:
            raise ScenarioError(("world", field), f"no {field} {name!r}; {nearest(name, known)}")
    if settings.arm is not None:
        try:
            mounts = load_arm(settings.arm).mounts
        except ArmError as error:
            raise ScenarioError(("world", "arm"), str(error)) from None
        if (mount := settings.arm_mount) not in mounts:
            near = nearest(mount, mounts)
            raise ScenarioError(("world", "arm_mount"), f"the arm has no mount {mount!r}; {near}")
    if settings.surface is not None and settings.surface not in SURFACES:
        near = nearest(settings.surface, SURFACES)
        raise ScenarioError(("world", "surface"), f"no surface {settings.surface!r}; {near}")


def check(scenario: Scenario, world: World) -> None:
    """Raise a ScenarioError if a scenario can never be run in its world as it says, or never be passed.

    Args:
        scenario: The scenario.
        world: Its world, with or without what comes into it at its time.
    """
    if isinstance(scenario.operator, Station) and not scenario.mission.tour:
        raise ScenarioError(
            ("operator", "kind"),
            "a station drives tours, in straight lines; add mission.tour = true, or take a follower",
        )
    _check_arm(scenario)
    start = _check_start(scenario, world)
    least = _check_goals(scenario, world, start)
    _check_limits(scenario, least)
    for number, fault in enumerate(scenario.fault):
        path: FieldPath = ("fault", number)
        _check_times(fault, path, scenario.mission.time_limit)
        _check_fault(fault, path, world, start)


_OF_ARMS = (
    *("picked", "placed", "dropped", "arm_contacts", "load", "load_max", "slip", "tip_moved"),
    *("tip_off", "pointing_off", "wheels_off", "mirror_error"),
)
"""Limits of a robot with an arm."""


def _check_arm(scenario: Scenario) -> None:
    world, mission, limits = scenario.world, scenario.mission, scenario.limits
    names = [parcel.name for parcel in world.parcels]
    for number, delivery in enumerate(mission.deliver):
        if delivery.parcel not in names:
            raise ScenarioError(
                ("mission", "deliver", number, "parcel"),
                f"no parcel {delivery.parcel!r}; {nearest(delivery.parcel, names)}",
            )
    boards = [n for n, f in enumerate(scenario.fault) if isinstance(f, BoardUnplugged)]
    if world.board is None and (boards or limits.mirror_error is not None):
        path: FieldPath = ("fault", boards[0]) if boards else ("limits", "mirror_error")
        raise ScenarioError(path, "there is no second arm; give world.board, such as degree")
    if world.arm is not None:
        return
    given = [name for name in _OF_ARMS if getattr(limits, name) is not None]
    for path, wanted in (
        (("limits", *given[:1]), given),
        (("world", "parcels"), world.parcels),
        (("world", "board"), world.board),
        (("operator", "kind"), isinstance(scenario.operator, Hand)),
        (("second", "kind"), isinstance(scenario.second, Hand)),
    ):
        if wanted:
            raise ScenarioError(path, "the robot carries no arm; give world.arm, such as s2")


def _check_scene(scene: str, folder: Path | None) -> None:
    path: FieldPath = ("world", "scene")
    if scene in scene_names():
        return
    beside = Path(scene) if folder is None else folder / scene
    if folder is not None and not beside.resolve().is_relative_to(folder.resolve()):
        raise ScenarioError(
            path, f"{scene!r} is outside the scenario's folder; copy the scene beside the scenario"
        )
    if beside.is_dir() or (beside.suffix in _FILES and beside.is_file()):
        return
    raise ScenarioError(
        path,
        f"no scene {scene!r}, nor a scene folder, floor plan (.toml) or MJCF file (.xml) beside the"
        f" scenario; {nearest(scene, scene_names())}",
    )


def _check_start(scenario: Scenario, world: World) -> tuple[float, float]:
    """Return x and y of the start [m]."""
    start = scenario.start
    if start.at is None:
        x, y = start_pose(world, start).position[:2].tolist()
        return x, y
    with _blamed(("start", "at")):
        x, y = position_of(world, start.at)
        checked_pose(world, x, y, heading_of(world, start.at))
    if start.known != "about" and (start.off or start.turned):
        field = "off" if start.off else "turned"
        raise ScenarioError(
            ("start", field),
            f'a wrong start is given only with known = "about", but known is {start.known!r}',
        )
    return x, y


def _check_goals(scenario: Scenario, world: World, start: tuple[float, float]) -> float:
    """Return the least time that the goals can take [s]."""
    goals = scenario.mission.goals
    if goals and scenario.mission.tour:
        raise ScenarioError(
            ("mission", "tour"), "the way-points of the tour are the goals; give these or others"
        )
    places = []
    for number, goal in enumerate(goals):
        with _blamed(("mission", "goals", number, "at")):
            places.append(position_of(world, goal.at))
    if not goals:
        return 0.0
    within = [goal.within for goal in goals]
    try:
        drivable_route(world, start, places, within=within)
    except GoalError as error:
        raise ScenarioError(("mission", "goals", error.number, "at"), error.reason) from None
    except WorldError as error:
        raise ScenarioError(("start", "at"), str(error)) from None
    if not scenario.limits.goals:
        return 0.0  # they say where to drive, and need not be reached
    if any(isinstance(fault, Kidnap) for fault in scenario.fault):
        return sum(goal.stay for goal in goals)  # it may be carried to where it is to drive
    apart = [math.dist(a, b) for a, b in pairwise([start, *places])]
    slack = [b + a for a, b in pairwise([0.0, *within])]
    way = sum(max(0.0, d - s) for d, s in zip(apart, slack, strict=True))
    least = way / _MAX_SPEED + sum(goal.stay for goal in goals)
    limit = scenario.mission.time_limit
    if least > limit:
        raise ScenarioError(
            ("mission", "time_limit"),
            f"{limit:g} s is too short: the goals take {least:.0f} s at least, at {_MAX_SPEED:g} m/s in"
            " straight lines",
        )
    return least


def _check_limits(scenario: Scenario, least: float) -> None:
    limits, time = scenario.limits, scenario.mission.time_limit
    if limits.nees is not None:
        low, high = limits.nees
        if not 0.0 <= low < high:
            raise ScenarioError(
                ("limits", "nees"),
                f"the bounds must be [least, greatest] with 0 <= least < greatest, got [{low:g}, {high:g}];"
                " 6 is consistent",
            )
    farthest = _MAX_SPEED * time
    if limits.distance is not None and limits.distance > farthest:
        raise ScenarioError(
            ("limits", "distance"),
            f"{limits.distance:g} m cannot be driven within the time limit of {time:g} s: at"
            f" {_MAX_SPEED:g} m/s it is {farthest:g} m at most",
        )
    if limits.duration is not None:
        if not scenario.mission.goals:
            raise ScenarioError(
                ("limits", "duration"),
                "there is no goal that could be reached in time; give mission.goals",
            )
        if limits.duration < least:
            raise ScenarioError(
                ("limits", "duration"),
                f"{limits.duration:g} s can never be kept: the goals take {least:.0f} s at least, at"
                f" {_MAX_SPEED:g} m/s in straight lines",
            )


def _check_times(fault: Fault, path: FieldPath, time_limit: float) -> None:
    if fault.at >= time_limit:
        raise ScenarioError(
            (*path, "at"),
            f"{fault.at:g} s is not before the end of the run: mission.time_limit is {time_limit:g} s",
        )
    lasting = getattr(fault, "lasting", None)
    if lasting is not None and not lasting > 0.0:
        raise ScenarioError((*path, "lasting"), "a fault must last > 0 s, got 0")


def _check_fault(fault: Fault, path: FieldPath, world: World, start: tuple[float, float]) -> None:
    match fault:
        case Kidnap() if fault.to != "anywhere":
            with _blamed((*path, "to")):
                x, y = position_of(world, fault.to)
                checked_pose(world, x, y, heading_of(world, fault.to))
        case ScannerDead() | ScannerDirty():
            mounts = tuple(world.robot.mounts)
            if fault.scanner != "both" and fault.scanner not in mounts:
                raise ScenarioError(
                    (*path, "scanner"),
                    f"the robot has no scanner {fault.scanner!r}; {nearest(fault.scanner, mounts)}",
                )
        case Box():
            _check_box(fault, path, world, start)
        case Walker():
            _check_walker(fault, path, world)
        case DoorClosed():
            with _blamed((*path, "door")):
                door_named(fault.door, {} if world.plan is None else doorways(world.plan))
        case Link() if not (fault.delay or fault.jitter or fault.rate or fault.blackout):
            raise ScenarioError(path, "this link is no worse; give delay, jitter, rate or blackout")
        case _:
            pass


def _check_box(box: Box, path: FieldPath, world: World, start: tuple[float, float]) -> None:
    _check_on_floor(box.to, (*path, "to"), world)
    with _blamed((*path, "size")):
        extra_of(box, world)
    x, y = position_of(world, box.to)
    half = (0.5 * box.size[0], 0.5 * box.size[1])
    outline = Footprint(x, y, half, heading_of(world, box.to))
    if box.at == 0.0 and outline.distance(np.array(start)) < world.robot.half_width:
        raise ScenarioError(
            (*path, "to"), f"at 0 s the robot itself stands there, at {start[0]:g}, {start[1]:g}"
        )


def _check_walker(walker: Walker, path: FieldPath, world: World) -> None:
    for number, place in enumerate(walker.path):
        _check_on_floor(place, (*path, "path", number), world)
    ways = [[position_of(world, place) for place in walker.path]]
    with _blamed((*path, "path"), lambda text: text.removeprefix("person 1 ")):
        if world.plan is not None:
            check_ways(ways, plan_blocks(world.plan))
        # Corners that cannot be walked are found as the body is made.
        check_path(ways[0], walker.speed)


def _check_on_floor(place: Place, path: FieldPath, world: World) -> None:
    with _blamed(path):
        x, y = position_of(world, place)
    x0, y0, x1, y1 = world.bounds
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        raise ScenarioError(
            path,
            f"[{x:g}, {y:g}] is off the floor, which reaches from [{x0:g}, {y0:g}] to [{x1:g}, {y1:g}]",
        )


@contextmanager
def _blamed(path: FieldPath, text: Callable[[str], str] = str) -> Iterator[None]:
    """Turn errors of the world into those of a field."""
    try:
        yield
    except WorldError as error:
        raise ScenarioError(path, text(str(error))) from None
