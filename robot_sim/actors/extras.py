"""Extras: what comes into a world after it was mapped, at its time: boxes, closed doors, people who walk once.

Spares are bodies that are parked until a running simulation puts them somewhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from robot_sim.actors.actor_bodies import (
    LEG_RADIUS,
    LEG_SPACING,
    MovingBody,
    person_parts,
    torso,
)
from robot_sim.actors.movers import Mover
from robot_sim.actors.schedules import Arrival, OpenSchedule, Poses, Scheduled, Standing
from robot_sim.errors import WorldError, nearest
from robot_sim.floorplan.doorways import Doorway
from robot_sim.floorplan.plan_ground import Heights, height_at
from robot_sim.number_checks import check_finite
from robot_sim.scene_objects.blocks import box, post
from robot_sim.scene_objects.plan_elements import Placement, Waypoint

MAX_EXTRA_SPEED: Final = 3.0
"""Greatest speed of a person who walks once [m/s]; that is a run."""
LEAF: Final = 0.04
"""Thickness of a closed door [m]."""
_SIDES: Final = (0.05, 5.0)
"""Least and greatest side of a box [m]."""
Size: TypeAlias = tuple[float, float, float]
"""Length, width and height [m]."""


@dataclass(frozen=True, slots=True)
class AddedBox:
    """A box that stands on the ground for some time."""

    size: Size
    """Length, width and height [m], each 0.05 to 5."""
    at: Placement
    """Where its middle stands."""
    start_ns: int = 0
    """Time at which it appears [ns]; later, if the robot stands there."""
    end_ns: int | None = None
    """Time at which it is gone [ns]; None for never."""

    def __post_init__(self) -> None:
        check_size("a box", self.size)
        _check_times("a box", self.start_ns, self.end_ns)


@dataclass(frozen=True, slots=True)
class ClosedDoor:
    """A door that is closed for some time: a leaf that fills its doorway."""

    door: str
    """Name of the doorway, see ``doorways``."""
    start_ns: int = 0
    """Time at which it is closed [ns]; later, if the robot stands in the doorway."""
    end_ns: int | None = None
    """Time at which it is open again [ns]; None for never."""

    def __post_init__(self) -> None:
        _check_times(f"door {self.door!r}", self.start_ns, self.end_ns)


@dataclass(frozen=True, slots=True)
class PassingPerson:
    """A person who appears, walks along a path, and is gone."""

    path: tuple[Waypoint, ...]
    """Way-points [m], two or more; corners are rounded."""
    start_ns: int = 0
    """Time at which the walk begins [ns]."""
    speed: float = 1.2
    """Walking speed [m/s], at most 3."""

    def __post_init__(self) -> None:
        _check_times("a person", self.start_ns, None)
        if not (math.isfinite(self.speed) and 0.0 < self.speed <= MAX_EXTRA_SPEED):
            raise WorldError(
                f"a person: speed must be > 0 and at most {MAX_EXTRA_SPEED:g} m/s, got {self.speed:g}"
            )


Extra: TypeAlias = AddedBox | ClosedDoor | PassingPerson
"""Anything that comes into a world at its time."""


@dataclass(frozen=True, slots=True)
class Spare:
    """A body that is parked until a simulation puts it somewhere."""

    name: str
    """Name of its mocap body."""
    kind: Literal["box", "person"]
    """What it is."""
    size: Size
    """Length, width and height [m]."""


PERSON_SIZE: Final[Size] = (0.24, 0.44, 1.74)
"""Depth, breadth and height of a person [m]."""


def extra_bodies(
    extras: Sequence[Extra], doors: Mapping[str, Doorway], ground: Heights
) -> Iterator[MovingBody]:
    """Yield the bodies of extras, parked before and after their time.

    Args:
        extras: The extras; their bodies are numbered in this order, each kind by itself.
        doors: Doorways of the world by name.
        ground: Height of the ground.

    Raises:
        WorldError: There is no such door, or a path cannot be walked.
    """
    numbers = {AddedBox: 0, PassingPerson: 0, ClosedDoor: 0}
    for extra in extras:
        numbers[type(extra)] += 1
        number = numbers[type(extra)]
        if isinstance(extra, AddedBox):
            at = extra.at
            pose = Standing(at.x, at.y, height_at(ground, at.x, at.y), at.yaw)
            mover = Arrival(f"added_box_{number}", pose, extra.start_ns, extra.end_ns)
            yield _box(mover, extra.size)
        elif isinstance(extra, ClosedDoor):
            yield _closed(extra, number, doors, ground)
        else:
            yield from _passing(extra, f"added_person_{number}", ground)


def spares(boxes: Sequence[Size], people: int) -> Iterator[Spare]:
    """Yield the spares of a world: boxes of these sizes, and so many people."""
    for number, size in enumerate(boxes, 1):
        check_size("a spare box", size)
        yield Spare(f"spare_box_{number}", "box", size)
    for number in range(1, people + 1):
        yield Spare(f"spare_person_{number}", "person", PERSON_SIZE)


def spare_body(spare: Spare) -> MovingBody:
    """Return the body of a spare."""
    mover = OpenSchedule(spare.name)
    if spare.kind == "box":
        return _box(mover, spare.size)
    name = spare.name
    legs = (
        post(f"{name}_{side}_leg", 0.0, sign * 0.5 * LEG_SPACING, 0.0, 0.85, LEG_RADIUS, "dark_fabric")
        for side, sign in (("left", 1.0), ("right", -1.0))
    )  # fmt: skip
    return MovingBody(mover, (*torso(name), *legs))


def check_size(what: str, size: Size) -> None:
    """Raise a WorldError if a box of this size is not allowed."""
    least, most = _SIDES
    if not all(math.isfinite(side) and least <= side <= most for side in size):
        sides = " x ".join(f"{side:g}" for side in size)
        raise WorldError(f"{what}: each side must be {least:g} to {most:g} m, got {sides} m")


def check_path(path: Sequence[Waypoint], speed: float) -> None:
    """Raise a WorldError if nobody can walk along a path at a speed [m/s]."""
    if len(path) < 2:
        raise WorldError(f"a person's path must have 2 way-points or more, got {len(path)}")
    for x, y in path:
        check_finite("a person's path", x=x, y=y)
    try:
        list(person_parts("person", path, speed, 0.0))
    except WorldError as error:
        raise WorldError(f"a person's {error}") from None


def door_named(name: str, doors: Mapping[str, Doorway]) -> Doorway:
    """Return a doorway.

    Raises:
        WorldError: No doorway has this name; the message lists similar ones, or all.
    """
    if name in doors:
        return doors[name]
    if not doors:
        raise WorldError(f"no door {name!r}: the world has no doorways that are known by name")
    raise WorldError(f"no door {name!r}: {nearest(name, doors)}")


def _box(mover: Mover, size: Size) -> MovingBody:
    slab = box(f"{mover.name}_side", 0.0, 0.0, 0.0, size[2], (size[0], size[1]), "cardboard")
    return MovingBody(mover, (slab,), hard=True)


def _closed(
    extra: ClosedDoor, number: int, doors: Mapping[str, Doorway], ground: Heights
) -> MovingBody:
    door = door_named(extra.door, doors)
    pose = Standing(door.x, door.y, height_at(ground, door.x, door.y), door.yaw)
    name = f"closed_door_{number}"
    leaf = box(f"{name}_leaf", 0.0, 0.0, 0.0, door.height, (door.width, LEAF), "wood")
    mover = Arrival(name, pose, extra.start_ns, extra.end_ns)
    return MovingBody(mover, (leaf,), hard=True)


def _passing(extra: PassingPerson, name: str, ground: Heights) -> Iterator[MovingBody]:
    check_path(extra.path, extra.speed)
    height = height_at(ground, *extra.path[0])
    for part, duration in person_parts(name, extra.path, extra.speed, height):
        end = extra.start_ns + duration
        walk = part.mover.pose_at
        schedule = [(extra.start_ns, _later(walk, extra.start_ns)), (end, None)]
        mover = Scheduled(part.mover.name, schedule)
        yield MovingBody(mover, part.blocks)


def _later(motion: Poses, start: int) -> Poses:
    return lambda times: motion(times - start)


def _check_times(what: str, start: int, end: int | None) -> None:
    if start < 0:
        raise WorldError(f"{what}: the start must be >= 0 ns, got {start}")
    if end is not None and end <= start:
        raise WorldError(f"{what}: the end must be after the start, got {start} to {end} ns")
