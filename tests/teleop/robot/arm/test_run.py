"""Runs: within the bounds and on their course, whatever pauses them, and stopped before what comes into the way."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.types import Pose
from robot_sim.arm.obstacles import Box
from robot_sim.array_types import BoolArray
from teleop.robot.arm.courses import Course, planned, timed
from teleop.robot.arm.run import Run, RunStep
from tests.teleop.robot.arm.support import TABLE, among

TICK = 0.02
WAY = np.array(
    [[0.0] * 5, [1.0, 0.5, 0.0, 0.0, 0.0], [1.0, 1.0, -1.0, 0.0, 0.5], [-1.0, 0.0, 0.0, 0.2, 0.0]]
)


def swinging() -> Course:
    times = np.arange(1, 30) * 0.1
    phases = np.outer(times, [2.0, 1.0, 0.0, 3.0, 5.0])
    points = np.sin(phases) * [0.8, -0.3, 0.0, 0.3, 0.2]
    return timed(list(times), points, np.zeros(5), TABLE)


COURSES: dict[str, Callable[[], Course]] = {"way": lambda: planned(WAY, TABLE), "swing": swinging}


def run_through(run: Run, pauses: BoolArray | None = None) -> list[RunStep]:
    steps = [run.step(going=pauses is None or not pauses[0])]
    while not steps[-1].done:
        assert len(steps) < 2000
        steps.append(run.step(going=pauses is None or not pauses[len(steps) % len(pauses)]))
    return steps


def angles_of(course: Course, steps: list[RunStep]) -> FloatArray:
    return np.array([course.begin, course.begin, course.begin, *(s.motion.angles for s in steps)])


@pytest.mark.parametrize("name", COURSES)
def test_a_run_ends_at_its_end_in_its_time(name: str) -> None:
    course = COURSES[name]()
    run = Run(course)
    steps = run_through(run)
    np.testing.assert_array_equal(steps[-1].motion.angles, course.end)
    assert steps[-1].motion.resting
    assert steps[-1].share == 1.0
    shares = [step.share for step in steps]
    assert all(a <= b for a, b in pairwise(shares))
    # Each corner may cost the rest of a tick.
    late = len(steps) * TICK - run.schedule[-1]
    assert -1e-9 <= late <= TICK * len(course.pieces) + 1e-9


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("name", COURSES)
def test_no_pause_takes_a_run_beyond_its_bounds_or_off_its_course(name: str, seed: int) -> None:
    chance = np.random.default_rng(seed)
    pauses = np.repeat(chance.random(200) < 0.5, chance.integers(1, 12, 200)) if seed else None
    course = COURSES[name]()
    steps = run_through(Run(course), pauses)
    angles = angles_of(course, steps)
    rates, accelerations, jerks = (np.diff(angles, n, axis=0) / TICK**n for n in (1, 2, 3))
    bounds = TABLE.motion
    assert np.abs(rates).max() <= bounds.speed * (1 + 1e-6)
    assert np.abs(accelerations).max() <= bounds.acceleration * (1 + 1e-6)
    assert np.abs(jerks).max() <= bounds.jerk * (1 + 1e-6)
    assert max(np.abs(s.motion.rates).max() for s in steps) <= bounds.speed * (1 + 1e-9)
    assert max(np.abs(s.motion.accelerations).max() for s in steps) <= bounds.acceleration * (
        1 + 1e-9
    )
    places = np.linspace(0.0, 1.0, 4000)
    along = np.vstack([piece.at(places * piece.length)[0] for piece in course.pieces])
    for pose in angles:
        assert np.abs(along - pose).max(axis=1).min() < 2e-3


def test_a_pause_stands_still_and_is_resumed_where_it_was() -> None:
    run = Run(planned(WAY, TABLE))
    for _ in range(12):
        run.step()
    paused = [run.step(going=False) for _ in range(15)]
    assert paused[-1].motion.resting
    assert not paused[-1].done
    # Shortest: the speed over the acceleration, and that over the jerk.
    assert paused[6].motion.resting
    after = run.step()
    assert 0.0 < np.abs(after.motion.angles - paused[-1].motion.angles).max() < 0.01
    assert run_through(run)[-1].done


def test_an_empty_course_is_done_at_once() -> None:
    step = Run(Course((), np.ones(5), np.ones(5))).step()
    assert step.done
    assert step.share == 1.0
    np.testing.assert_array_equal(step.motion.angles, np.ones(5))


ACROSS = planned(np.array([[0.9, 0.0, -0.3, 0.0, 0.0], [-0.9, 0.0, -0.3, 0.0, 0.0]]), TABLE)
POST = Box("post", Pose.from_euler((0.29 + 0.35, -0.1, 0.25)), (0.02, 0.02, 0.25))


def test_what_comes_into_the_way_stops_the_arm_before_it_touches_and_lets_it_go_on_after() -> None:
    clearance = among()
    run = Run(ACROSS, clearance)
    for _ in range(5):
        assert not run.step().blocked
    clearance.surround((POST,))
    steps = [run.step() for _ in range(40)]
    assert steps[-1].motion.resting
    assert not steps[-1].done
    assert steps[-1].blocked.endswith("would touch post")
    nearest = min(clearance.distance(step.motion.angles) for step in steps)
    assert nearest >= 0.002
    assert clearance.nearest(steps[-1].motion.angles, 0.1) is not None
    clearance.surround(())
    assert not run.step().blocked
    assert run_through(run)[-1].done


@pytest.mark.parametrize("ticks", range(0, 40, 3))
def test_the_arm_never_touches_what_it_could_stop_for(ticks: int) -> None:
    clearance = among()
    run = Run(ACROSS, clearance)
    step = run.step()
    for _ in range(ticks):
        step = run.step()
    clearance.surround((POST,))
    near = clearance.distance(step.motion.angles)
    steps = [run.step() for _ in range(40)]
    closest = min(clearance.distance(step.motion.angles) for step in steps)
    # At full speed the tip needs 7.7 cm.
    if near > 0.08:
        assert closest >= 0.002
    assert steps[-1].motion.resting


def test_an_arm_that_stands_too_near_may_leave_and_not_come_nearer() -> None:
    clearance = among(Box("table", Pose.from_euler((0.65, 0.0, 0.23)), (0.1, 0.1, 0.05)))
    low = np.zeros(5)
    assert clearance.touching(low)
    up, down = np.array([0.0, 0.3, 0.0, 0.0, 0.0]), np.array([0.0, -0.1, 0.0, 0.0, 0.0])
    assert run_through(Run(planned(np.array([low, up]), TABLE), clearance))[-1].done
    step = Run(planned(np.array([low, down]), TABLE), clearance).step()
    assert step.blocked.endswith("would touch table")
    np.testing.assert_array_equal(step.motion.angles, low)


def test_a_thin_rod_between_two_ticks_is_seen() -> None:
    rod = Box("rod", Pose.from_euler((0.29 + 0.35, 0.0, 0.25)), (0.0005, 0.0005, 0.25))
    clearance = among(rod)
    run = Run(ACROSS, clearance)
    steps = [run.step() for _ in range(60)]
    assert steps[-1].blocked.endswith("would touch rod")
    assert min(clearance.distance(step.motion.angles) for step in steps) >= 0.001
