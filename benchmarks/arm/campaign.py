"""A million steps of adversarial hands among boxes: does the arm ever come too near to anything?

Each part is a hundred thousand steps, 2000 s of robot time: in 125 scenes of twelve boxes two hands each, which reach at
up to 1.2 m/s for places anywhere in and out of reach, inside of boxes and of the vehicle as well, and tremble.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.arm.boxes import TABLE, boxes, free_poses, on_a_floor
from benchmarks.common.figures import OURS, Figure, share
from benchmarks.common.progress import with_progress
from localization.geometry import FloatArray
from localization.types import SECOND, Pose
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.hand_control import HandControl
from teleop.robot.arm.limits import Motion

SCENES, HANDS, STEPS = 125, 2, 400
TICK = 0.02
BETWEEN = (0.25, 0.5, 0.75, 1.0)
"""Where between two ticks distances are measured."""
LOOK = 0.01
"""Distance up to which they are [m]."""
REACH = ((0.0, -0.5, -0.25), (0.55, 0.5, 0.5))
"""Corners of the space in ``arm_base`` to which hands reach [m]; the floor is 20 cm below."""
SPEEDS = (0.2, 1.2)
"""Mean speeds of a reach [m/s]; the peak is 1.9 times as much."""
TURNING = 2.0
"""Greatest mean speed at which its roll, pitch and yaw change [rad/s]."""
NOISE = 0.001, 0.005
"""Trembling of a hand [m, rad]."""


@dataclass
class Tally:
    """What the hands did."""

    steps: int = 0
    held: int = 0
    contacts: int = 0
    close: int = 0
    """Steps nearer than 2 mm, but for rounding."""
    nearest: float = np.inf
    seconds: float = 0.0


def campaign(part: int) -> Iterator[Figure]:
    """Let the hands of a part move the arm, and yield how near it came to anything and how often it was held."""
    tally, clearance = Tally(), on_a_floor()
    seeds = range(part * SCENES, (part + 1) * SCENES)
    for seed in with_progress(seeds, SCENES, f"scenes of part {part + 1}"):
        chance = np.random.default_rng([25, seed])
        clearance.surround(boxes(chance))
        poses = free_poses(clearance, chance)
        for _ in range(HANDS):
            episode(clearance, next(poses), chance, tally)
    yield from figures(tally)


def figures(tally: Tally) -> Iterator[Figure]:
    """Yield what is known of some steps."""
    case = f"{tally.steps} steps of hands among 12 boxes"
    yield Figure(case, OURS, "contacts", tally.contacts, n=tally.steps, most=0.0)
    yield Figure(case, OURS, "steps nearer than 2 mm", tally.close, n=tally.steps, most=0.0)
    yield Figure(case, OURS, "nearest", 1e3 * tally.nearest, "mm", tally.steps, least=1.999)
    yield share(case, OURS, "steps held", tally.held, tally.steps, most=10.0)
    yield Figure(case, OURS, "time of a step", 1e3 * tally.seconds / tally.steps, "ms", tally.steps)


def episode(
    clearance: Clearance,
    start: FloatArray,
    chance: np.random.Generator,
    tally: Tally,
    steps: int = STEPS,
) -> None:
    """Let one hand move the arm from a pose (5,), and count."""
    control, motion = HandControl(TABLE, clearance, tick=TICK), Motion.at_rest(start)
    tip = Kinematics(TABLE).tip(start)
    for hand in reaches(tip, chance, steps):
        begun = time.process_time()
        step = control.tick(hand, motion)
        tally.seconds += time.process_time() - begun
        before, motion = motion, step.motion
        tally.steps += 1
        tally.held += step.share == 0.0
        way = motion.angles - before.angles
        least = min(clearance.distance(before.angles + part * way, LOOK) for part in BETWEEN)
        tally.nearest = min(tally.nearest, least)
        tally.close += least < 0.002 - 1e-6
        tally.contacts += least <= 0.0


def reaches(tip: FloatArray, chance: np.random.Generator, steps: int = STEPS) -> Iterator[Hand]:
    """Yield samples of a hand that holds the tip from ``arm_base_from_tool0`` (4, 4) on, and reaches from place to place."""
    place, turn = tip[:3, 3].copy(), Pose.from_rotation(tip[:3, 3], tip[:3, :3])
    goal, begin, lasts, since = place, place, 0.0, 0.0
    old = new = turn.euler
    for number in range(steps):
        if since >= lasts:
            begin, old, since = goal, new, 0.0
            goal = chance.uniform(*REACH)
            new = tuple(chance.uniform((-1.5, -0.8, -1.5), (1.5, 1.4, 1.5)))
            moving = float(np.linalg.norm(goal - begin)) / chance.uniform(*SPEEDS)
            lasts = max(moving, float(np.abs(np.subtract(new, old)).max()) / TURNING)
        since += TICK
        done = min(since / lasts, 1.0)
        # A reach of least jerk (Flash and Hogan, 1985).
        part = done**3 * (10.0 - 15.0 * done + 6.0 * done**2)
        place = begin + part * (goal - begin) + chance.normal(scale=NOISE[0], size=3) * (number > 0)
        euler = np.array(old) + part * (np.array(new) - old)
        euler += chance.normal(scale=NOISE[1], size=3) * (number > 0)
        pose = Pose.from_euler(place, roll=euler[0], pitch=euler[1], yaw=euler[2])
        yield Hand(pose, engaged=True, stamp=round((number + 1) * TICK * SECOND))
