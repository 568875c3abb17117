"""Bodies of people, door leaves and carts: their shapes and the movers that carry them."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from robot_sim.actors.movers import Mover, SwingingDoor, WalkingBody, quaternions_of
from robot_sim.actors.schedules import CELLAR, Scheduled
from robot_sim.actors.walking import Walk
from robot_sim.errors import WorldError
from robot_sim.floorplan.actors_in_plan import Cart, DoorLeaf, Person
from robot_sim.robot.bumper_geom import make_firm, make_yielding
from robot_sim.scene_objects.blocks import Block, box, ellipsoid, post
from robot_sim.scene_objects.plan_elements import Waypoint

SPEEDS: Final = (0.8, 1.4)
"""Range from which walking speeds are drawn [m/s]; chosen around pedestrians' 1.3 m/s."""
PAUSES: Final = (2.0, 6.0)
"""Range from which stops at the ends of a path are drawn [s]; chosen."""
WALK_RATIO: Final = 0.0065
"""Step length over cadence [m per step/min], nearly the same at all speeds above 1 m/s (Murakami and
Otaka, 2017); Sekiya and Nagasaki's value for adults, as quoted by others."""
LEG_RADIUS: Final = 0.065
"""Radius of a leg [m]: a calf of 0.38 m circumference, in trousers; chosen."""
LEG_SPACING: Final = 0.18
"""Distance between the legs' axes [m]; chosen."""
LEG_SHARE: Final = 0.55
"""Swing of a leg at the height of the scanner over that of the foot: 0.40 m high, hip at 0.90 m."""
ARM_REACH: Final = 0.45
"""Distance from the person who pushes a cart to its rear edge [m]; chosen."""
_KINDS: Final = {Person: "person", Cart: "cart", DoorLeaf: "leaf"}
"""Table of a floor plan that each actor is read from, for messages."""


@dataclass(frozen=True, slots=True, eq=False)
class MovingBody:
    """A mover and the solids that make up its body."""

    mover: Mover
    """Where the body is at any time."""
    blocks: tuple[Block, ...]
    """Solids in the body's own frame: x forward, z = 0 at the floor."""
    hard: bool = False
    """Whether it stands like furniture; otherwise it yields like a person."""

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the body to a specification as a mocap body: at its pose at time zero, or below the floor."""
        positions, yaws = self.mover.pose_at(np.zeros(1, dtype=np.int64))
        if isinstance(self.mover, Scheduled):
            positions, yaws = np.array([[0.0, 0.0, CELLAR]]), np.zeros(1)
        body = spec.worldbody.add_body(
            name=self.mover.name, mocap=True, pos=positions[0], quat=quaternions_of(yaws)[0]
        )
        for block in self.blocks:
            geom = block.add_to(spec, body)
            if self.hard:
                make_firm(geom)
            elif geom.contype:
                make_yielding(geom)


def moving_bodies(
    actors: Sequence[Person | DoorLeaf | Cart], *, seed: int = 0
) -> Iterator[MovingBody]:
    """Yield the moving bodies of the actors of a world.

    Args:
        actors: People, door leaves and carts; their names must differ.
        seed: Seed of everything the plan leaves open; each actor draws by the seed and its own name.

    Raises:
        WorldError: a path cannot be walked, or two actors have the same name; the message names them.
    """
    names: set[str] = set()
    for one in actors:
        kind = _KINDS[type(one)]
        if one.name in names:
            raise WorldError(f"{kind} {one.name!r}: two actors have this name")
        names.add(one.name)
        rng = np.random.default_rng([seed, zlib.crc32(one.name.encode())])
        if isinstance(one, DoorLeaf):
            yield _leaf(one, rng)
            continue
        try:
            yield from _walkers(one, rng)
        except WorldError as error:
            raise WorldError(f"{kind} {one.name!r}: {error}") from None


def _leaf(leaf: DoorLeaf, rng: np.random.Generator) -> MovingBody:
    # One centimetre off the floor, so that thresholds are no obstacle.
    size = (leaf.width, leaf.thickness)
    slab = box(f"{leaf.name}_slab", 0.5 * leaf.width, 0.0, 0.01, leaf.height, size, leaf.material)
    return MovingBody(SwingingDoor(leaf, rng), (slab,))


def _walkers(one: Person | Cart, rng: np.random.Generator) -> Iterator[MovingBody]:
    drawn_speed, drawn_pause, phase = rng.uniform(*SPEEDS), rng.uniform(*PAUSES), rng.uniform()
    speed = one.speed if one.speed is not None else drawn_speed
    step = _step_length(speed)
    walk = Walk(
        one.path,
        speed=speed,
        step_length=step,
        pause=one.pause if one.pause is not None else drawn_pause,
        loop=one.loop,
    )
    delayed = one.start is not None
    offset = -round(1e9 * one.start) if one.start is not None else int(phase * walk.cycle)

    if isinstance(one, Cart):
        ahead = ARM_REACH + 0.5 * one.size[0] if one.pushed else 0.0
        mover = WalkingBody(one.name, walk, offset, delayed, ahead)
        yield MovingBody(mover, tuple(_cart(one.name, one.size)))
        if not one.pushed:
            return
    name = f"{one.name}_driver" if isinstance(one, Cart) else one.name
    yield from _person(name, walk, offset, step, delayed=delayed)


def person_parts(
    name: str, path: Sequence[Waypoint], speed: float, ground: float
) -> Iterator[tuple[MovingBody, int]]:
    """Yield the parts of a person who sets out on a path at time zero, and the duration of the way [ns].

    Raises:
        WorldError: the path cannot be walked.
    """
    step = _step_length(speed)
    walk = Walk(path, speed=speed, step_length=step)
    for part in _person(name, walk, 0, step, delayed=False, height=ground):
        yield part, walk.first_arrival


def _person(
    name: str, walk: Walk, offset: int, step: float, *, delayed: bool, height: float = 0.0
) -> Iterator[MovingBody]:
    """Yield torso and legs of a person with a step length [m] on a walk."""
    mover = WalkingBody(f"{name}_torso", walk, offset, delayed, height=height)
    yield MovingBody(mover, tuple(torso(name)))
    # The feet are a step apart when both are down.
    reach = 0.5 * step * LEG_SHARE
    for side, sign in (("left", 1.0), ("right", -1.0)):
        leg = post(f"{name}_{side}_leg_limb", 0.0, 0.0, 0.0, 0.85, LEG_RADIUS, "dark_fabric")
        left, swing = sign * 0.5 * LEG_SPACING, sign * reach
        mover = WalkingBody(f"{name}_{side}_leg", walk, offset, delayed, 0.0, left, swing, height)
        yield MovingBody(mover, (leg,))


def _step_length(speed: float) -> float:
    """Return the step length at a walking speed: cadence is speed over it, and the ratio of both is known [m]."""
    return math.sqrt(WALK_RATIO * 60.0 * speed)


def torso(name: str) -> Iterator[Block]:
    """Yield the trunk with arms, and the head, of a person 1.74 m tall; dimensions chosen."""
    yield box(f"{name}_trunk", 0.0, 0.0, 0.85, 1.45, (0.24, 0.44), "fabric")
    yield ellipsoid(f"{name}_head", 0.0, 0.0, 1.48, 1.74, (0.20, 0.16), "skin")


def _cart(name: str, size: tuple[float, float, float]) -> Iterator[Block]:
    """Yield a platform trolley: castors, deck, load, and two posts with a handle at the rear."""
    length, width, height = size
    rear = -0.5 * length + 0.02
    for i, (sx, sy) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        x, y = sx * (0.5 * length - 0.08), sy * (0.5 * width - 0.08)
        yield post(f"{name}_castor_{i}", x, y, 0.0, 0.14, 0.05, "rubber")
    yield box(f"{name}_deck", 0.0, 0.0, 0.14, 0.18, (length, width), "wood")
    load = (0.75 * length, 0.85 * width)
    yield box(f"{name}_load", 0.05 * length, 0.0, 0.18, 0.75 * height, load, "cardboard")
    for i, y in enumerate((0.5 * width - 0.03, 0.03 - 0.5 * width)):
        yield post(f"{name}_post_{i}", rear, y, 0.18, height, 0.02, "metal")
    yield box(f"{name}_handle", rear, 0.0, height - 0.04, height, (0.04, width), "metal")
