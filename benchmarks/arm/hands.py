"""How well the arm follows hands: the step of the joints beside mink's, and the motion after the bounds of jerk."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from benchmarks.arm.mink_follower import INSTALL, WAYS, Mink
from benchmarks.arm.paths import KINEMATICS, TABLE, TICK, angle, reachable, samples, tips
from benchmarks.common.figures import OURS, Figure, say
from localization.geometry import FloatArray
from robot_sim.arm.inverse import branches
from teleop.robot.arm.follow import Follower
from teleop.robot.arm.hand_control import HandControl
from teleop.robot.arm.limits import JerkLimiter, Motion
from teleop.robot.arm.reach import Reach, Target

HANDS, TICKS = 12, 400
SETTLED = 25
"""Ticks at the begin that do not count after the bounds, for the hand begins at full speed and the arm at rest."""
NOISES = (0.0, 0.0005, 0.0015)
"""Standard deviations of what is measured of a hand [m]."""
ROLL = np.radians(40.0)
"""By so much hands roll to and fro."""
STILL = np.zeros(3), np.zeros(3)

Step = Callable[[FloatArray], FloatArray]


def hands() -> Iterator[Figure]:
    """Let arms follow hands, and yield how far off they were."""
    for case, straight in (
        ("hands that the arm reaches", False),
        ("hands that pass through a straight wrist", True),
    ):
        ways = [reachable(seed, TICKS, straight_wrist=straight) for seed in range(HANDS)]
        yield from _steps(case, ways)
        for noise in NOISES:
            yield from _motions(case, ways, noise)


def _steps(case: str, ways: list[FloatArray]) -> Iterator[Figure]:
    followers: dict[str, Callable[[FloatArray], Step]] = {OURS: _ours, "closed form": _closed_form}
    followers.update({way: partial(_mink, way) for way in WAYS})
    for method, begin in followers.items():
        try:
            yield from _step(case, method, begin, ways)
        except ImportError:
            say(f"    {INSTALL}")
            return


def _step(
    case: str, method: str, begin: Callable[[FloatArray], Step], ways: list[FloatArray]
) -> Iterator[Figure]:
    """Yield how far one follower's steps are off."""
    off, askew, spent = [], [], []
    for way in ways:
        step = begin(way[0])
        for wanted in tips(way, ROLL)[1:]:
            begun = time.thread_time()
            angles = step(wanted)
            spent.append(time.thread_time() - begun)
            tip = KINEMATICS.tip(angles)
            off.append(1e3 * float(np.linalg.norm(tip[:3, 3] - wanted[:3, 3])))
            askew.append(angle(tip[:3, 0], wanted[:3, 0]))
    bounded = method == OURS and "straight" not in case
    for what, values, percent, unit, most in (
        ("tip, p50", off, 50, "mm", 0.1),
        ("tip, p95", off, 95, "mm", 0.5),
        ("tip, largest", off, 100, "mm", None),
        ("pointing, p95", askew, 95, "deg", 0.3),
    ):
        value, goal = float(np.percentile(values, percent)), most if bounded else None
        yield Figure(case, method, f"step: {what}", value, unit, len(values), most=goal)
    yield Figure(case, method, "step: CPU, p50", 1e6 * float(np.median(spent)), "us", len(spent))


def _ours(start: FloatArray) -> Step:
    follower, reach = Follower(KINEMATICS, JerkLimiter(TABLE, TICK)), Reach(KINEMATICS)
    angles = start

    def step(wanted: FloatArray) -> FloatArray:
        nonlocal angles
        target, _ = reach.clamped(Target.of(wanted), Target.of(KINEMATICS.tip(angles)))
        angles = follower.towards(angles, target, STILL).angles
        return angles

    return step


def _closed_form(start: FloatArray) -> Step:
    """The nearest branch, cut at the limits."""
    angles = start

    def step(wanted: FloatArray) -> FloatArray:
        nonlocal angles
        found = branches(KINEMATICS, wanted[:3, 3], wanted[:3, 0])
        cut = np.clip(found, TABLE.lower, TABLE.upper)
        if len(cut):
            angles = cut[int(np.abs(cut - angles).max(axis=1).argmin())]
        return angles

    return step


def _mink(way: str, start: FloatArray) -> Step:
    return Mink(start, way).step


def _motions(case: str, ways: list[FloatArray], noise: float) -> Iterator[Figure]:
    """Yield how far the motion is from where the hand truly is, and whether it keeps its bounds."""
    off, lags, worst = [], [], np.zeros(3)
    for seed, way in enumerate(ways):
        wanted = tips(way, ROLL)
        control, motion, places = HandControl(TABLE), Motion.at_rest(way[0]), []
        for hand in samples(wanted, noise, seed):
            later = control.tick(hand, motion).motion
            jerk = (later.accelerations - motion.accelerations) / TICK
            used = [np.abs(x).max() for x in (later.rates, later.accelerations, jerk)]
            worst, motion = np.maximum(worst, used), later
            places.append(KINEMATICS.tip(motion.angles)[:3, 3])
        moved, hand_places = np.array(places), wanted[:, :3, 3]
        off.append(1e3 * np.linalg.norm(moved - hand_places, axis=1)[SETTLED:])
        lags.append(_lag(moved[SETTLED:], hand_places[SETTLED:]))
    case = f"{case}, noise {1e3 * noise:g} mm" if noise else case
    goals = noise == 0.0 and "straight" not in case
    count = sum(map(len, off))
    for percent, most in ((50, 3.0), (95, 15.0)):
        value = float(np.percentile(np.concatenate(off), percent))
        yield Figure(
            case, OURS, f"motion: tip, p{percent}", value, "mm", count, most=most if goals else None
        )
    yield Figure(
        case,
        OURS,
        "motion: behind",
        float(np.mean(lags)),
        "ms",
        len(lags),
        most=20.0 if goals else None,
    )
    bounds = TABLE.motion.speed, TABLE.motion.acceleration, TABLE.motion.jerk
    share = 100.0 * float((worst / bounds).max())
    yield Figure(case, OURS, "motion: most of its bounds", share, "%", count, most=100.0 + 1e-6)


def _lag(moved: FloatArray, wanted: FloatArray) -> float:
    """Return the delay with which one way is most like the other [ms], to a hundredth of a tick."""
    shifts = np.arange(-2.0, 6.0, 0.01)
    ticks = np.arange(2.0, len(wanted) - 6.0)
    at = np.arange(len(wanted), dtype=float)
    errors = []
    for shift in shifts:
        later = np.column_stack([np.interp(ticks + shift, at, axis) for axis in moved.T])
        errors.append(float(np.mean((later - wanted[2:-6]) ** 2)))
    return 1e3 * TICK * float(shifts[int(np.argmin(errors))])
