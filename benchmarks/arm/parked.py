"""Hands that are parked out of the arm's reach: how calm it is, and whether it comes back as it was."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.arm.mink_follower import INSTALL, WAYS, Mink
from benchmarks.arm.paths import KINEMATICS, TABLE, TICK, TICK_NS, minimum_jerk
from benchmarks.common.figures import OURS, Figure, say, share
from benchmarks.common.progress import with_progress
from localization.geometry import FloatArray
from localization.types import Pose
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.hand_control import HandControl
from teleop.robot.arm.limits import Motion

READY = np.array(TABLE.poses["ready"])
AWAY = 0.6
"""Way of the hand [m]."""
GOING, PARKED, BACK = 60, 100, 150
"""Ticks of going and of coming back, of standing there, and of waiting at the end."""
CALM = 50
"""Ticks after which it counts how calm a parked arm is."""
POSTURES = 24
DIRECTIONS = [
    np.array(d) / np.linalg.norm(d) for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)
]


@dataclass(frozen=True, slots=True)
class Stay:
    """What an arm did while its hand was away."""

    rate: float
    """Of its joints while the hand was parked, as a root of mean squares [rad/s]."""
    turned: float
    """Largest difference of a joint from where it was before [deg]."""
    moved: float
    """The same of the tip [mm]."""
    offered: bool
    """Whether it offers to turn over at the end."""


def parked() -> Iterator[Figure]:
    """Yield how calm arms are whose hands are out of reach."""
    ahead = [np.array(d) for d in ((1.0, 0, 0), (0, 0, 1.0), (0, 1.0, 0), (0, -1.0, 0))]
    case = "from the ready pose 0.6 m ahead, up, left and right"
    stays = [_stay(READY, direction) for direction in ahead]
    yield Figure(case, OURS, "rate while parked", max(s.rate for s in stays), "rad/s", 4, most=0.01)
    yield Figure(case, OURS, "posture after it", max(s.turned for s in stays), "deg", 4, most=0.5)
    yield Figure(case, OURS, "tip after it", max(s.moved for s in stays), "mm", 4, most=0.5)
    try:
        for way in WAYS:
            rates = [_mink(way, READY, direction) for direction in ahead]
            yield Figure(case, way, "rate while parked", max(rates), "rad/s", 4)
    except ImportError:
        say(f"    {INSTALL}")
    case = f"from {POSTURES} postures 0.6 m in {len(DIRECTIONS)} directions"
    pairs = list(itertools.product(range(POSTURES), DIRECTIONS))
    stays = [
        _stay(posture(seed), direction)
        for seed, direction in with_progress(pairs, len(pairs), "hands out of reach")
    ]
    rates = [stay.rate for stay in stays]
    count = len(stays)
    yield Figure(
        case,
        OURS,
        "rate while parked, p95",
        float(np.percentile(rates, 95)),
        "rad/s",
        count,
        most=0.01,
    )
    yield share(case, OURS, "parked above 0.01 rad/s", sum(r > 0.01 for r in rates), count)
    elsewhere = [s for s in stays if s.turned > 0.5 or s.moved > 0.5]
    yield share(case, OURS, "come back in another posture", len(elsewhere), count)
    offered = sum(stay.offered for stay in elsewhere)
    yield share(case, OURS, "of those, offered to turn over", offered, len(elsewhere), least=100.0)


def posture(seed: int) -> FloatArray:
    """Return angles (5,) of an arm with room to move; the first are those of the ready pose [rad]."""
    if seed == 0:
        return READY
    chance = np.random.default_rng(seed)
    lowest, highest = (-60.0, 0.0, -110.0, -40.0, 15.0), (60.0, 90.0, -30.0, 40.0, 60.0)
    angles = np.radians(chance.uniform(lowest, highest))
    angles[4] *= chance.choice((-1.0, 1.0))
    return angles


def _way() -> Iterator[float]:
    """Yield which share of its way a hand is away in each tick."""
    yield from (minimum_jerk(tick / GOING) for tick in range(GOING))
    yield from itertools.repeat(1.0, PARKED)
    yield from (minimum_jerk(1.0 - tick / GOING) for tick in range(GOING))
    yield from itertools.repeat(0.0, BACK)


def _stay(angles: FloatArray, direction: FloatArray) -> Stay:
    control, motion, rates = HandControl(TABLE), Motion.at_rest(angles), []
    offered = False
    for tick, far in enumerate(_way()):
        hand = Hand(
            Pose.from_rotation(AWAY * far * direction, np.eye(3)), True, stamp=(tick + 1) * TICK_NS
        )
        step = control.tick(hand, motion)
        motion, offered = step.motion, step.finding.way_out == "turn_over"
        if GOING + CALM <= tick < GOING + PARKED:
            rates.append(motion.rates)
    moved = KINEMATICS.tip(motion.angles)[:3, 3] - KINEMATICS.tip(angles)[:3, 3]
    return Stay(
        rate=float(np.sqrt(np.mean(np.square(rates)))),
        turned=float(np.degrees(np.abs(motion.angles - angles).max())),
        moved=1e3 * float(np.linalg.norm(moved)),
        offered=offered,
    )


def _mink(way: str, angles: FloatArray, direction: FloatArray) -> float:
    """Return the rate of mink's joints while the hand is parked, as a root of mean squares [rad/s]."""
    follower, tip, rates = Mink(angles, way), KINEMATICS.tip(angles), []
    before = angles
    for tick, far in enumerate(_way()):
        wanted = tip.copy()
        wanted[:3, 3] += AWAY * far * direction
        now = follower.step(wanted)
        if GOING + CALM <= tick < GOING + PARKED:
            rates.append((now - before) / TICK)
        before = now
    return float(np.sqrt(np.mean(np.square(rates))))
