"""``python -m benchmarks guard FOLDER [SECONDS]``: adversarial drivers against the guard, and the same without it.

Each drive is 120 s in one scene from one seed, with physics and scanners and without localiser or socket. Its driver
holds sticks for 0.2 to 4 s: full speed, arcs, spins, reversing, turbo, each as old as 0 to 0.9 s when it takes effect.
Every drive appends a line to ``FOLDER/drives.jsonl``; those that are there already are not driven again, so that the
campaign goes on where it ended. A contact with something that no scanner's plane crosses is counted apart.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.common.progress import with_progress
from localization.types import SECOND, Twist
from robot_sim import TICK_NS, Simulation, World, WorldOptions, load_world
from teleop.joystick import VelocityRequest
from teleop.robot.drive import Drive
from teleop.robot.guard.guard import Guard
from teleop.robot.inbox import DriveCommand

TAKES_WORDS = True
SCENES = ("office", "warehouse", "corridor", "glasshouse", "courtyard")
LENGTH = 120.0
"""Length of a drive [s]."""
_PLANE = (0.37, 0.43)
"""Heights that the horizontal scanner's plane crosses on level ground [m], with room for a tilt of 1 degree at 1.5 m."""


@dataclass(frozen=True)
class Outcome:
    """What happened in a drive."""

    scene: str
    seed: int
    guarded: bool
    alive: bool
    contacts: int
    """Times that the robot began to touch something."""
    unseen: int
    """Those of them with things that the horizontal plane does not cross."""
    names: dict[str, int]
    """What was touched, and how often."""
    way: float
    """Way driven [m]."""
    stopped: float
    """Time for which the guard stopped the robot [s]."""


def main(words: list[str] | None = None) -> int:
    """Drive what is missing, and print the sums."""
    if not words:
        print("guard FOLDER [SECONDS]: name a folder for the drives", file=sys.stderr)
        return 2
    file = Path(words[0]) / "drives.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text().splitlines() if file.exists() else []
    done = [Outcome(**json.loads(line)) for line in lines]
    known = {(o.scene, o.seed, o.guarded, o.alive) for o in done}
    drives = round(float(words[1] if len(words) > 1 else 100_000) / LENGTH)
    plan = [
        (SCENES[i % len(SCENES)], i // len(SCENES), guarded, i % 3 == 2)
        for i in range(drives)
        for guarded in (True, False)
    ]
    missing = [one for one in plan if one not in known]
    with file.open("a") as out:
        for one in with_progress(missing, len(missing), "drives"):
            done.append(drive(*one))
            out.write(json.dumps(asdict(done[-1])) + "\n")
            out.flush()
    for guarded in (True, False):
        mine = [o for o in done if o.guarded is guarded]
        names = sum((Counter(o.names) for o in mine), Counter[str]())
        print(
            f"{'with' if guarded else 'without'} guard: {len(mine) * LENGTH:.0f} s, {sum(o.way for o in mine):.0f} m,"
            f" {sum(o.contacts for o in mine)} contacts, {sum(o.unseen for o in mine)} of them with unseen things;"
            f" most: {', '.join(f'{n} {name}' for name, n in names.most_common(8)) or 'none'}"
        )
    return 0


def drive(scene: str, seed: int, guarded: bool, alive: bool) -> Outcome:
    """Make one drive."""
    world = _world(scene, alive)
    simulation = Simulation(world, seed=seed)
    guard = Guard(world.robot, simulation.mounts, simulation.config.drive) if guarded else None
    robot = Drive(simulation, guard=guard)
    rng = np.random.default_rng([seed, SCENES.index(scene)])
    until = contacts = unseen = age = 0
    forward = turn = way = stopped = 0.0
    touching: frozenset[str] = frozenset()
    names = Counter[str]()
    for tick in range(round(LENGTH * SECOND / TICK_NS)):
        if tick >= until:
            until = tick + int(rng.integers(10, 200))
            forward = float(rng.choice([0.7, 0.7, 0.5, -0.4, -0.7, 0.0]))
            turn = float(rng.choice([0.0, 0.0, rng.uniform(-1.2, 1.2), rng.uniform(-2.4, 2.4)]))
            age = int(rng.uniform(0.0, 0.9) * SECOND) if rng.random() < 0.3 else 0
        request = VelocityRequest(Twist.planar(forward, turn), enabled=True)
        record = robot.tick(
            simulation.stamp, (DriveCommand("driver", request, age=age, stream=True),)
        )
        now = frozenset(record.condition.touching)
        for name in sorted(now - touching):
            names[name] += 1
            contacts += 1
            unseen += not _crosses_plane(world, name)
        touching = now
        way += float(np.hypot(*record.truth.twist.linear[:2])) * TICK_NS / SECOND
        stopped += (record.guard.state.value == "stopped") * TICK_NS / SECOND
    return Outcome(
        scene, seed, guarded, alive, contacts, unseen, dict(names), round(way, 2), round(stopped, 2)
    )


@cache
def _world(scene: str, alive: bool) -> World:
    return load_world(scene, options=WorldOptions(alive=alive))


def _crosses_plane(world: World, name: str) -> bool:
    """Return whether a static thing reaches through the horizontal scanner's plane, at the height of its ground."""
    model = world.model
    geom = model.geom(name)
    middle, half = model.geom_aabb[geom.id][:3], model.geom_aabb[geom.id][3:]
    low = float(geom.pos[2] + middle[2] - half[2])
    high = float(geom.pos[2] + middle[2] + half[2])
    return low <= _PLANE[0] and high >= _PLANE[1]
