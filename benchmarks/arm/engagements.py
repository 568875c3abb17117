"""What a hand moves that should move nothing: as it takes the arm, takes it again, is lost, or jumps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.arm.boxes import on_a_floor
from benchmarks.arm.paths import KINEMATICS, LOWER, TABLE, TICK_NS, UPPER, minimum_jerk
from benchmarks.common.figures import OURS, Figure
from localization.geometry import FloatArray, so3_exp
from localization.types import Pose
from teleop.robot.arm.arm_commands import Hand
from teleop.robot.arm.hand_control import HandControl
from teleop.robot.arm.limits import Motion

ENGAGEMENTS = 10_000
BEYOND = np.radians(5.0)
"""Joints of every second arm may be beyond their limits by this."""
MOVED = np.radians(0.1)
"""Motion of a joint that counts."""
WATCHED = 10
"""Ticks for which a hand that has taken the arm is still."""
ARMS, CLOSINGS = 20, 100
LOSSES = 50
JUMP = 0.73
"""Way that the pose of a lost headset was seen to jump [m] (NVIDIA/IsaacTeleop#731)."""
READY = np.array(TABLE.poses["ready"])


def engagements() -> Iterator[Figure]:
    """Yield how far arms moved."""
    yield from _taken()
    yield _taken_again()
    yield from _lost()


def _taken() -> Iterator[Figure]:
    """Let hands take arms that stand anywhere, also at and in the vehicle."""
    chance, control = np.random.default_rng(0), HandControl(TABLE, on_a_floor())
    turned = []
    for number in range(ENGAGEMENTS):
        angles = chance.uniform(LOWER, UPPER)
        if number % 2:
            over = chance.uniform(0.0, BEYOND, 5)
            outside = np.where(chance.random(5) < 0.5, UPPER + over, LOWER - over)
            angles = np.where(chance.random(5) < 0.4, outside, angles)
        control.reset()
        motion = Motion.at_rest(angles)
        hand = Hand(_anywhere(chance), True)
        for tick in range(WATCHED):
            motion = control.tick(replace(hand, stamp=(tick + 1) * TICK_NS), motion).motion
        turned.append(np.abs(motion.angles - angles).max())
    case = "a hand takes an arm that stands anywhere, joints up to 5 deg beyond their limits"
    moved = sum(turn > MOVED for turn in turned)
    yield Figure(case, OURS, "joints moving over 0.1 deg", moved, "", ENGAGEMENTS, most=0.0)
    yield Figure(
        case, OURS, "largest motion of a joint", np.degrees(max(turned)), "deg", ENGAGEMENTS
    )


def _taken_again() -> Figure:
    chance, worst = np.random.default_rng(1), 0.0
    for _ in range(ARMS):
        angles = chance.uniform(LOWER, UPPER)
        control, motion, hand = (
            HandControl(TABLE),
            Motion.at_rest(angles),
            Hand(_anywhere(chance), True),
        )
        for tick in range(4 * CLOSINGS):
            if tick % 4 == 3:
                control.let_go()
                motion = control.hold(motion).motion
            else:
                motion = control.tick(replace(hand, stamp=(tick + 1) * TICK_NS), motion).motion
        drift = KINEMATICS.tip(motion.angles)[:3, 3] - KINEMATICS.tip(angles)[:3, 3]
        worst = max(worst, float(np.linalg.norm(drift)))
    case = f"{CLOSINGS} times taken and let go by a still hand"
    return Figure(case, OURS, "drift of the tip", 1e3 * worst, "mm", ARMS, most=0.1)


def _lost() -> Iterator[Figure]:
    for flagged in (True, False):
        way = "and says so" if flagged else "without saying so"
        for speed in (0.0, 0.3):
            case = f"tracking is lost {way}, and the hand jumps by 73 cm, from {speed:g} m/s"
            moved, more = [], []
            for seed in range(LOSSES):
                lost, let_go = (_after_loss(seed, speed, flagged=f) for f in (flagged, None))
                moved.append(1e3 * float(np.linalg.norm(lost[1] - lost[0])))
                more.append(1e3 * float(np.linalg.norm(lost[1] - let_go[1])))
            goal = 2.0 if speed == 0.0 else None
            yield Figure(case, OURS, "tip moves, at most", max(moved), "mm", LOSSES, most=goal)
            what = "from where it stops if its hand lets go"
            yield Figure(case, OURS, what, max(more), "mm", LOSSES, most=2.0)


def _after_loss(seed: int, speed: float, *, flagged: bool | None) -> tuple[FloatArray, FloatArray]:
    """Return the tip's place (3,) at the loss and a second later.

    Args:
        seed: Source of the direction and of the noise.
        speed: Of the hand at the loss [m/s].
        flagged: Whether the hand says that it is lost; None for a hand that lets go instead.
    """
    chance = np.random.default_rng(seed)
    control, motion = HandControl(TABLE), Motion.at_rest(READY)
    sideways, jump = _direction(chance), JUMP * _direction(chance)
    place = np.zeros(3)
    at_loss = KINEMATICS.tip(READY)[:3, 3]
    for tick in range(75):
        if tick < 25:
            place = place + 0.02 * speed * minimum_jerk(tick / 25) * sideways
        elif tick == 25:
            at_loss = KINEMATICS.tip(motion.angles)[:3, 3]
        # Lost for 0.2 s, and then found elsewhere.
        seen = place + (jump if tick >= 25 else 0.0)
        tracked = not (flagged and 25 <= tick < 35)
        if tick >= 25 and flagged is None:
            control.let_go()
            motion = control.hold(motion).motion
            continue
        pose = Pose.from_rotation(seen, np.eye(3))
        hand = Hand(pose, True, tracked=tracked, stamp=(tick + 1) * TICK_NS)
        motion = control.tick(hand, motion).motion
    return at_loss, KINEMATICS.tip(motion.angles)[:3, 3]


def _anywhere(chance: np.random.Generator) -> Pose:
    return Pose.from_rotation(chance.uniform(-2.0, 2.0, 3), so3_exp(chance.uniform(-3.0, 3.0, 3)))


def _direction(chance: np.random.Generator) -> FloatArray:
    drawn = chance.normal(size=3)
    direction: FloatArray = drawn / np.linalg.norm(drawn)
    return direction
