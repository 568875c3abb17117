"""Plans of an arm among boxes: ours, and OMPL's RRTConnect with the same check of poses.

OMPL checks ways at steps of a hundredth of the space's extent, which is its default and moves the tip by up to 29 mm
between two checks. Ours is certain of the whole way.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou

from benchmarks.arm.boxes import LIMITS, TABLE, boxes, free_poses, on_a_floor
from benchmarks.common.figures import OURS, Figure
from benchmarks.common.progress import with_progress
from localization.geometry import FloatArray
from robot_sim.arm.arm_table import JOINTS
from robot_sim.arm.clearance import Clearance
from teleop.robot.arm.courses import planned
from teleop.robot.arm.planner import Plan, Planning
from teleop.robot.arm.run import Run

SCENES, QUERIES = 40, 10
PATIENCE = 5.0
"""Time that OMPL may take [s]."""
PEER = "OMPL RRTConnect"
FINE = 0.002
"""Step of the check of what OMPL has found [m]."""


@dataclass(frozen=True)
class Found:
    """What a planner found."""

    milliseconds: float
    length: float
    """Of the way [rad]; NaN without one."""
    checks: int
    touches: bool
    """Whether the arm comes nearer than 2 mm to something on the way, checked at steps of 2 mm."""


def plans() -> Iterator[Figure]:
    """Ask both for ways between random poses, and yield how long it took and how long the ways are."""
    clearance = on_a_floor()
    ou.setLogLevel(ou.LogLevel.LOG_ERROR)
    ou.RNG.setSeed(1)
    found: list[tuple[float, Found, Found]] = []
    ways: list[tuple[int, FloatArray]] = []
    for seed in with_progress(range(SCENES), SCENES, "scenes"):
        chance = np.random.default_rng(seed)
        clearance.surround(boxes(chance))
        poses = free_poses(clearance, chance)
        for _ in range(QUERIES):
            start, goal = next(poses), next(poses)
            ours, way = _ours(clearance, start, goal, seed)
            apart = float(np.linalg.norm(goal - start))
            if abs(ours.length - apart) < 1e-9:
                continue
            if way is not None:
                ways.append((seed, way))
            found.append((apart, ours, _theirs(clearance, start, goal)))
    case = "ways that are not straight"
    yield Figure(case, "queries", "of all", len(found), n=SCENES * QUERIES)
    for who, results in ((OURS, [f[1] for f in found]), (PEER, [f[2] for f in found])):
        goals = (10.0, 50.0) if who == OURS else (None, None)
        yield from _figures(case, who, results, goals)
    ratios = [o.length / t.length for _, o, t in found if np.isfinite(o.length / t.length)]
    yield from _runs(clearance, ways)
    case = "both found one"
    yield Figure(
        case, OURS, "length over OMPL's, p50", float(np.median(ratios)), n=len(ratios), most=1.3
    )
    yield Figure(
        case, OURS, "length over OMPL's, p95", float(np.quantile(ratios, 0.95)), n=len(ratios)
    )
    for who, at in ((OURS, 1), (PEER, 2)):
        over = [f[at].length / f[0] for f in found if np.isfinite(f[at].length)]  # type: ignore[union-attr]
        yield Figure(
            case, who, "length over the straight line, p50", float(np.median(over)), n=len(over)
        )


def _figures(
    case: str, who: str, results: list[Found], goals: tuple[float | None, float | None]
) -> Iterator[Figure]:
    n, times = len(results), [r.milliseconds for r in results]
    none = sum(not np.isfinite(r.length) for r in results)
    for quantile, goal in zip((0.5, 0.95), goals, strict=True):
        value = float(np.quantile(times, quantile))
        yield Figure(case, who, f"time, p{100 * quantile:.0f}", value, "ms", n, most=goal)
    yield Figure(case, who, "time, longest", max(times), "ms", n)
    yield Figure(case, who, "checks, p50", float(np.median([r.checks for r in results])), n=n)
    yield Figure(case, who, "no way found", none, n=n)
    yield Figure(
        case, who, "ways nearer than 2 mm to something", sum(r.touches for r in results), n=n
    )


def _runs(clearance: Clearance, ways: list[tuple[int, FloatArray]]) -> Iterator[Figure]:
    """Run along ways, watching what is ahead; yield what a tick and the stops at corners cost."""
    ticks, stops, nearest = list[float](), list[float](), np.inf
    for seed, way in ways:
        clearance.surround(boxes(np.random.default_rng(seed)))
        run = Run(planned(way, TABLE), clearance)
        done = False
        while not done:
            begun = time.process_time()
            step = run.step()
            ticks.append(1e3 * (time.process_time() - begun))
            done = step.done
            nearest = min(nearest, clearance.distance(step.motion.angles, 0.01))
        motion = TABLE.motion
        whole = float(np.abs(np.diff(way, axis=0)).max(axis=1).sum())
        ramp = motion.speed / motion.acceleration + motion.acceleration / motion.jerk
        stops.append(100.0 * (run.schedule[-1] / (whole / motion.speed + ramp) - 1.0))
    case, n = "runs along these ways", len(ways)
    for quantile in (0.5, 0.99):
        value = float(np.quantile(ticks, quantile))
        yield Figure(case, OURS, f"time of a tick, p{100 * quantile:.0f}", value, "ms", len(ticks))
    yield Figure(case, OURS, "longer by stops at corners, p50", float(np.median(stops)), "%", n)
    yield Figure(case, OURS, "nearest", 1e3 * nearest, "mm", len(ticks), least=2.0)


def _ours(
    clearance: Clearance, start: FloatArray, goal: FloatArray, seed: int
) -> tuple[Found, FloatArray | None]:
    begun, before = time.process_time(), clearance.checks
    planning = Planning(clearance, start, goal[None], seed=seed)
    while (outcome := planning.advance()) is None:
        pass
    taken, checks = time.process_time() - begun, clearance.checks - before
    way = outcome.way if isinstance(outcome, Plan) else None
    return _found(clearance, way, taken, checks), way


def _theirs(clearance: Clearance, start: FloatArray, goal: FloatArray) -> Found:
    space = ob.RealVectorStateSpace(JOINTS)
    bounds = ob.RealVectorBounds(JOINTS)
    for joint, (low, high) in enumerate(zip(*LIMITS, strict=True)):
        bounds.setLow(joint, float(low))
        bounds.setHigh(joint, float(high))
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    angles, before = np.empty(JOINTS), clearance.checks

    def valid(state: ob.State) -> bool:
        for joint in range(JOINTS):
            angles[joint] = state[joint]
        return clearance.free(angles)

    setup.setStateValidityChecker(valid)
    ends = space.allocState(), space.allocState()
    for state, pose in zip(ends, (start, goal), strict=True):
        for joint in range(JOINTS):
            state[joint] = float(pose[joint])
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(og.RRTConnect(setup.getSpaceInformation()))
    begun = time.process_time()
    setup.solve(PATIENCE)
    way = None
    if setup.haveExactSolutionPath():
        setup.simplifySolution()
        states = setup.getSolutionPath().getStates()
        way = np.array([[state[joint] for joint in range(JOINTS)] for state in states])
    return _found(clearance, way, time.process_time() - begun, clearance.checks - before)


def _found(clearance: Clearance, way: FloatArray | None, seconds: float, checks: int) -> Found:
    if way is None:
        return Found(1e3 * seconds, np.nan, checks, touches=False)
    touches = False
    for begin, end in pairwise(way):
        pieces = int(clearance.levers @ np.abs(end - begin) / FINE) + 2
        touches |= not all(clearance.free(q) for q in np.linspace(begin, end, pieces))
    length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    return Found(1e3 * seconds, length, checks, touches)
