"""Judges a drive by the truth: what the robot touched, whose doing it was, how far it drove, how long it was stopped."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from benchmarks.guard.drivers import DRIVERS
from benchmarks.guard.worlds import SCENES
from localization.types import SECOND
from robot_sim import TICK_NS, World
from teleop.robot.guard.verdict import GuardState
from teleop.robot.tick_record import DriveRecord

DRIVE: Final = 120.0
"""Length of a drive [s]."""
_PLANE: Final = (0.37, 0.43)
"""Heights that the horizontal scanner's plane crosses on level ground [m], with room for a tilt of 1 degree at 1.5 m."""
_STOOD: Final = 0.05
"""Speed of its fastest point below which a robot stands [m/s]: what its brake takes away in 0.05 s."""
_AGAIN: Final = 2 * SECOND
"""Time without a touch after which the next one of the same thing or person counts as another contact [ns]: who leans on a leg
trembles, and people have two."""
_PUSHED: Final = 0.5
"""Way that a robot must have driven to be free of where a person pushed it [m]."""


@dataclass(frozen=True)
class Plan:
    """Which drive."""

    scene: str
    """Name of the scene."""
    alive: bool
    """Whether its people walk in it, and furniture has moved."""
    driver: str
    """Name of the driver."""
    seed: int
    """Seed of robot and driver."""
    guarded: bool
    """Whether the guard is on."""

    def rng(self) -> np.random.Generator:
        """Return what the driver draws its sticks by: the same with the guard and without it."""
        return np.random.default_rng(
            [self.seed, SCENES.index(self.scene), list(DRIVERS).index(self.driver)]
        )


@dataclass(frozen=True)
class Outcome(Plan):
    """What happened in a drive."""

    seen: int
    """Times that the robot began to touch a thing that the horizontal plane crosses."""
    unseen: int
    """The same for lower and higher things."""
    pushed: int
    """Times that it began to touch either where a person had pushed it."""
    met: int
    """Times that a person or what people move met the robot while the robot moved; two legs are one person."""
    walked_into: int
    """The same while the robot stood."""
    names: dict[str, int]
    """What was touched, and how often."""
    way: float
    """Way driven [m]."""
    stopped: float
    """Time for which the guard stopped the robot [s]."""


class Judge:
    """Owns what has happened in a drive so far."""

    def __init__(self, world: World) -> None:
        """Begin with a robot at rest that touches nothing."""
        self._contacts = Contacts(world)
        self._speed = self._way = self._stopped = 0.0

    def take(self, record: DriveRecord) -> None:
        """Take a tick."""
        self._contacts.take(record.condition.touching, record.stamp, self._speed, self._way)
        twist = record.truth.twist
        forward = float(np.hypot(*twist.linear[:2]))
        self._speed = forward + 0.3 * abs(float(twist.angular[2]))
        self._way += forward * TICK_NS / SECOND
        self._stopped += (record.guard.state is GuardState.STOPPED) * TICK_NS / SECOND

    def outcome(self, plan: Plan) -> Outcome:
        """Return what has happened."""
        kinds = self._contacts.kinds
        return Outcome(
            **asdict(plan),
            seen=kinds["seen"],
            unseen=kinds["unseen"],
            pushed=kinds["pushed"],
            met=kinds["met"],
            walked_into=kinds["walked into"],
            names=dict(self._contacts.names),
            way=round(self._way, 2),
            stopped=round(self._stopped, 2),
        )


class Contacts:
    """Owns what a robot has touched in a drive, and of what kind each contact was."""

    def __init__(self, world: World) -> None:
        """Begin with a robot that touches nothing."""
        self._model = world.model
        self._last: dict[str, int] = {}
        self._pushed_at = -_PUSHED
        self.names, self.kinds = Counter[str](), Counter[str]()

    def take(self, touching: Iterable[str], now: int, speed: float, way: float) -> None:
        """Take what is touched in a tick; the speed of the robot's fastest point before it [m/s], and the way driven [m]."""
        people = {name: self._person(name) for name in sorted(touching)}
        pushed = any(people.values()) or way - self._pushed_at < _PUSHED
        for name, who in people.items():
            thing = who or name
            if now - self._last.get(thing, -_AGAIN) >= _AGAIN:
                self.names[name] += 1
                if who:
                    self.kinds["walked into" if speed < _STOOD else "met"] += 1
                else:
                    self.kinds["pushed" if pushed else self._height(name)] += 1
            self._last[thing] = now
            if who:
                self._pushed_at = way

    def _person(self, name: str) -> str | None:
        """Return the name of a person or of what people move; None for what stands."""
        root = int(self._model.body_rootid[self._model.geom(name).bodyid[0]])
        if self._model.body_mocapid[root] < 0:
            return None
        return re.sub("_(left_leg|right_leg|torso)$", "", self._model.body(root).name)

    def _height(self, name: str) -> str:
        geom = self._model.geom(name)
        middle, half = self._model.geom_aabb[geom.id][:3], self._model.geom_aabb[geom.id][3:]
        low, high = (float(geom.pos[2] + middle[2] + side * half[2]) for side in (-1.0, 1.0))
        return "seen" if low <= _PLANE[0] and high >= _PLANE[1] else "unseen"
