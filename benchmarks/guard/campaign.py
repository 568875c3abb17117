"""``python -m benchmarks guard FOLDER [SECONDS | operators] [--out FOLDER]``: adversarial drivers with and without the guard.

Each drive is 120 s in one of ten worlds, of one driver and one seed, with physics and scanners and without localiser or
socket. It appends a line to ``FOLDER/drives.jsonl``; those that are there already are not driven again, so that a campaign
goes on where it ended. ``operators`` has the library's own drive over links of 0 to 1 s, likewise.
"""

from __future__ import annotations

import json
import re
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.common.figures import Figure
from benchmarks.common.progress import with_progress
from benchmarks.common.sheet import Sheet
from benchmarks.guard import operators
from benchmarks.guard.drivers import DRIVERS
from localization.types import SECOND, Scan, Twist
from robot_sim import TICK_NS, Simulation, World, WorldOptions, load_world
from teleop.joystick import VelocityRequest
from teleop.robot.drive import Drive
from teleop.robot.guard.guard import Guard
from teleop.robot.guard.verdict import GuardState
from teleop.robot.inbox import DriveCommand

TAKES_WORDS = True
SCENES = ("office", "warehouse", "corridor", "glasshouse", "courtyard")
WORLDS = tuple(product(SCENES, (False, True)))
"""Each as it was mapped, and with its people and with furniture moved."""
LENGTH = 120.0
"""Length of a drive [s]."""
_PLANE = (0.37, 0.43)
"""Heights that the horizontal scanner's plane crosses on level ground [m], with room for a tilt of 1 degree at 1.5 m."""
_STOOD = 0.05
"""Speed of its fastest point below which a robot stands [m/s]: what its brake takes away in 0.05 s."""
_AGAIN = 2 * SECOND
"""Time without a touch after which the next one by the same person counts as another contact [ns]: not that of the second leg."""
_PUSHED = 0.5
"""Way that a robot must have driven to be free of where a person pushed it [m]."""


@dataclass(frozen=True)
class Outcome:
    """What happened in a drive."""

    scene: str
    alive: bool
    driver: str
    seed: int
    guarded: bool
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


def main(words: Sequence[str] = (), out: Path | None = None) -> int:
    """Drive what is missing, and print the sums."""
    if not words:
        print("guard FOLDER [SECONDS | operators]: name a folder for the drives", file=sys.stderr)
        return 2
    folder, sheet = Path(words[0]), Sheet(out)
    folder.mkdir(parents=True, exist_ok=True)
    begin = time.process_time()
    if words[1:] == ["operators"]:
        sheet.put("operators", operators.campaign(folder), seconds=time.process_time() - begin)
        return 0
    file = folder / "drives.jsonl"
    lines = file.read_text().splitlines() if file.exists() else []
    done = [Outcome(**json.loads(line)) for line in lines]
    known = {(o.scene, o.alive, o.driver, o.seed, o.guarded) for o in done}
    rounds = range(round(float(words[1] if len(words) > 1 else 100_000) / LENGTH))
    names = list(DRIVERS)
    plan = [
        (*WORLDS[i % len(WORLDS)], names[i // len(WORLDS) % len(names)], i, guarded)
        for i in rounds
        for guarded in (True, False)
    ]
    missing = [one for one in plan if one not in known]
    with file.open("a") as kept:
        for one in with_progress(missing, len(missing), "drives"):
            done.append(drive(*one))
            kept.write(json.dumps(asdict(done[-1])) + "\n")
            kept.flush()
    sheet.put("campaign", list(_figures(done)), seconds=time.process_time() - begin)
    return 0


def _figures(done: Sequence[Outcome]) -> Iterator[Figure]:
    for guarded in (True, False):
        mine = [o for o in done if o.guarded is guarded]
        case, method = "adversarial drivers", f"{'with' if guarded else 'without'} guard"
        n = len(mine)
        none, all_of_it = (0.0, 100_000.0) if guarded else (None, None)
        yield Figure(case, method, "driven", n * LENGTH, "s", n, least=all_of_it)
        yield Figure(case, method, "way", sum(o.way for o in mine), "m", n)
        seen = sum(o.seen for o in mine)
        yield Figure(case, method, "contacts with what is seen", seen, n=n, most=none)
        met = sum(o.met for o in mine)
        yield Figure(case, method, "contacts with people, robot moving", met, n=n, most=none)
        for quantity, count in (
            ("contacts with people, robot standing", sum(o.walked_into for o in mine)),
            ("contacts where a person pushed it", sum(o.pushed for o in mine)),
            ("contacts with lower and higher things", sum(o.unseen for o in mine)),
        ):
            yield Figure(case, method, quantity, count, n=n)
        names = sum((Counter(o.names) for o in mine), Counter[str]())
        print(method, ", ".join(f"{n} {name}" for name, n in names.most_common(8)) or "no contact")


def drive(scene: str, alive: bool, driver: str, seed: int, guarded: bool) -> Outcome:
    """Make one drive."""
    world = _world(scene, alive)
    simulation = Simulation(world, seed=seed)
    guard = Guard(world.robot, simulation.mounts, simulation.config.drive) if guarded else None
    robot = Drive(simulation, guard=guard)
    rng = np.random.default_rng([seed, SCENES.index(scene), list(DRIVERS).index(driver)])
    draw, scan, until = DRIVERS[driver], None, 0
    way = stopped = 0.0
    contacts, speed = Contacts(world), 0.0
    for tick in range(round(LENGTH * SECOND / TICK_NS)):
        if tick >= until:
            stick = draw(rng, scan)
            until = tick + stick.ticks
        request = VelocityRequest(Twist.planar(stick.forward, stick.turn), enabled=True)
        command = DriveCommand("driver", request, age=stick.age, stream=True)
        record = robot.tick(simulation.stamp, (command,))
        scan = next((r for r in record.sensed if isinstance(r, Scan)), scan)
        contacts.take(record.condition.touching, simulation.stamp, speed, way)
        twist = record.truth.twist
        speed = float(np.hypot(*twist.linear[:2])) + 0.3 * abs(float(twist.angular[2]))
        way += float(np.hypot(*twist.linear[:2])) * TICK_NS / SECOND
        stopped += (record.guard.state is GuardState.STOPPED) * TICK_NS / SECOND
    kinds = contacts.kinds
    return Outcome(
        scene,
        alive,
        driver,
        seed,
        guarded,
        kinds["seen"],
        kinds["unseen"],
        kinds["pushed"],
        kinds["met"],
        kinds["walked into"],
        dict(contacts.names),
        round(way, 2),
        round(stopped, 2),
    )


class Contacts:
    """Owns what a robot has touched in a drive, and of what kind each contact was."""

    def __init__(self, world: World) -> None:
        """Begin with a robot that touches nothing."""
        self._model = world.model
        self._touching: frozenset[str] = frozenset()
        self._people: dict[str, int] = {}
        self._pushed_at = -_PUSHED
        self.names, self.kinds = Counter[str](), Counter[str]()

    def take(self, touching: Iterable[str], now: int, speed: float, way: float) -> None:
        """Take what is touched in a tick; the speed of the robot's fastest point before it [m/s], and the way driven [m]."""
        all_now = frozenset(touching)
        people = {name: who for name in all_now if (who := self._person(name)) is not None}
        for name in sorted(all_now - self._touching):
            self.names[name] += 1
            who = people.get(name)
            if who is None:
                pushed = bool(people) or way - self._pushed_at < _PUSHED
                self.kinds["pushed" if pushed else self._height(name)] += 1
            elif now - self._people.get(who, -_AGAIN) >= _AGAIN:
                self.kinds["walked into" if speed < _STOOD else "met"] += 1
                self._people[who] = now
        for who in people.values():
            self._people[who], self._pushed_at = now, way
        self._touching = all_now

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


@cache
def _world(scene: str, alive: bool) -> World:
    return load_world(scene, options=WorldOptions(alive=alive, rearranged=1 if alive else None))
