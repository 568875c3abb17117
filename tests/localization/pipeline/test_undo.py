from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.filter.pose_error import difference
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import register
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.undo import Step
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Inertial,
    Match,
    Pose,
    Reading,
    Sweep,
    Verdict,
)
from tests.localization.filter.driven_filter import DrivenFilter
from tests.support_rooms import HALL, MOUNTS, SQUARE, Drive, apart

START = Pose.planar(-1.2, -0.7, 0.3)
QUARTER = Pose.planar(0.0, 0.0, np.pi / 2)
"""Turns the square room into itself."""


class Moody:
    """Registers sweeps, but for a while finds nothing that explains them."""

    def __init__(self, world: PreparedMap, begin: int, end: int) -> None:
        self._world, self._begin, self._end = world, begin, end

    def __call__(self, sweep: Sweep, prior: Pose, covariance: FloatArray) -> Match:
        match = register(sweep, self._world, prior, covariance)
        moody = self._begin <= sweep.stamp < self._end
        far = np.full_like(match.distances, np.nan)
        return replace(match, inlier_ratio=0.1, distances=far) if moody else match


def drive(seconds: float) -> Drive:
    return Drive(SQUARE, START, (1.0, 0.0, 0.0), (seconds - 1.0, 0.35, 0.35), seed=2)


def hinted(readings: Iterable[Reading], *hints: tuple[int, Pose]) -> list[Reading]:
    estimate: list[Reading] = []
    waiting = list(hints)
    for reading in readings:
        estimate.append(reading)
        if waiting and isinstance(reading, Inertial) and reading.stamp >= waiting[0][0]:
            estimate.append(Hint(reading.stamp, waiting.pop(0)[1], np.zeros((6, 6))))
    return estimate


def feed(localizer: Localizer, readings: Sequence[Reading]) -> tuple[Estimate, list[Verdict]]:
    verdicts = []
    for reading in readings:
        estimate = localizer.add(reading)
        verdicts += [estimate.verdict.verdict] if estimate.verdict else []
    return estimate, verdicts


def misled(square: PreparedMap, seconds: float) -> tuple[Localizer, Drive]:
    """A localiser that took a hint to a wrong place of the same looks while it was in doubt."""
    way = drive(seconds)
    matcher = Moody(square, 2 * SECOND, 3 * SECOND)
    localizer = Localizer(square, MOUNTS, matcher=matcher)
    at = 2 * SECOND + SECOND // 2
    wrong = QUARTER @ way.pose(at)
    estimate, verdicts = feed(localizer, hinted(way.readings(), (SECOND // 2, START), (at, wrong)))
    assert verdicts == [Verdict.ACCEPTED, Verdict.ACCEPTED]
    assert estimate.map_from_base is not None
    assert apart(estimate.map_from_base, QUARTER @ way.pose(estimate.stamp))[0] < 0.03
    return localizer, way


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [4.0, 22.0])
def test_undo_brings_the_robot_back_to_where_it_would_be_without_the_hint(
    square: PreparedMap, seconds: float
) -> None:
    localizer, way = misled(square, seconds)
    assert localizer.undoable
    estimate = localizer.undo()
    assert estimate.map_from_base is not None
    assert estimate.reasons[0].startswith("undid the placement of ")
    off = difference(estimate.map_from_base, way.pose(estimate.stamp))
    assert np.hypot(off[0], off[1]) < 0.08
    assert off @ np.linalg.solve(estimate.covariance, off) < 22.5, "99.9 % of chi-square, 6 degrees"
    onward = Drive(SQUARE, way.pose(way.end), (1.0, 0.35, 0.35), begin=way.end, seed=3)
    estimate, _ = feed(localizer, onward.readings())
    assert estimate.map_from_base is not None
    assert apart(estimate.map_from_base, onward.pose(estimate.stamp))[0] < 0.02
    assert estimate.health in (Health.TRACKING, Health.DEGRADED)


def test_undo_of_the_first_hint_waits_for_another(square: PreparedMap) -> None:
    way = drive(2.0)
    localizer = Localizer(square, MOUNTS)
    wrong = QUARTER @ START
    feed(localizer, hinted(way.readings(), (SECOND // 2, wrong)))
    estimate = localizer.undo()
    assert (estimate.map_from_base, estimate.health) == (None, Health.WAITING)
    onward = Drive(SQUARE, way.pose(way.end), (1.5, 0.35, 0.0), begin=way.end, seed=3)
    again = hinted(onward.readings(), (way.end + SECOND // 2, onward.pose(way.end + SECOND // 2)))
    estimate, verdicts = feed(localizer, again)
    assert verdicts == [Verdict.ACCEPTED]
    assert estimate.map_from_base is not None
    assert apart(estimate.map_from_base, onward.pose(estimate.stamp))[0] < 0.03


def test_undo_without_a_placement_changes_nothing_and_says_so(square: PreparedMap) -> None:
    localizer = Localizer(square, MOUNTS)
    feed(localizer, hinted(drive(1.5).readings(), (SECOND // 2, START)))
    localizer.undo()
    before = localizer.add(drive(1.5).readings()[0])
    estimate = localizer.undo()
    assert not localizer.undoable
    assert estimate.reasons[0] == "nothing to undo from the last 60 s"
    assert (estimate.stamp, estimate.map_from_base) == (before.stamp, before.map_from_base)


def test_placement_can_be_taken_back_for_as_long_as_is_set(square: PreparedMap) -> None:
    config = replace(LocalizerConfig(), undo_memory=SECOND)
    localizer = Localizer(square, MOUNTS, config)
    readings = hinted(drive(3.0).readings(), (SECOND // 2, START))
    undoable = []
    for reading in readings:
        localizer.add(reading)
        undoable.append(localizer.undoable)
    assert any(undoable)
    assert not undoable[-1]


@pytest.mark.slow
def test_what_was_lost_before_is_not_looked_for_after_an_undo_until_somebody_asks(
    square: PreparedMap,
) -> None:
    way = drive(9.0)
    matcher = Moody(square, 2 * SECOND, 100 * SECOND)
    localizer = Localizer(square, MOUNTS, matcher=matcher)
    readings = hinted(way.readings(), (SECOND // 2, START))
    for reading in readings:
        estimate = localizer.add(reading)
        found = any("placed anew" in why for why in estimate.reasons)
        if found and estimate.stamp > 2 * SECOND:
            break
    assert found
    estimate = localizer.undo()
    assert estimate.health is Health.LOST
    rest = [r for r in way.readings() if r.stamp > estimate.stamp]
    states = [localizer.add(r).health for r in rest]
    assert set(states) == {Health.LOST}
    localizer.relocalize()
    onward = Drive(SQUARE, way.pose(way.end), (0.4, 0.0, 0.0), begin=way.end).readings()
    assert Health.RELOCALISING in [localizer.add(r).health for r in onward]


@pytest.mark.slow
def test_wrong_hints_on_a_good_pose_change_no_estimate(hall: PreparedMap) -> None:
    start = Pose.planar(2.6, 1.6, 0.2)
    way = Drive(HALL, start, (0.6, 0.0, 0.0), (3.0, 0.4, 0.3), (3.0, 0.3, -0.5), seed=6)
    rng = np.random.default_rng(0)
    wrong = [
        (SECOND + i * SECOND // 5, Pose.planar(*rng.uniform([0.5, 0.5, -3.1], [7.5, 5.5, 3.1])))
        for i in range(25)
    ]
    wrong.append((6 * SECOND + SECOND // 4, Pose.planar(90.0, 3.5, -2.0)))
    first = (SECOND // 4, start)
    plain, pestered = (
        hinted(way.readings(), first),
        hinted(way.readings(), first, *wrong),
    )
    calm, _ = feed(Localizer(hall, MOUNTS), plain)
    estimate, verdicts = feed(Localizer(hall, MOUNTS), pestered)
    assert len(verdicts) == 27
    assert set(verdicts[1:]) <= {Verdict.KEPT, Verdict.REJECTED, Verdict.AMBIGUOUS}
    assert calm.map_from_base is not None
    assert estimate.map_from_base is not None
    assert estimate.map_from_base.position.tobytes() == calm.map_from_base.position.tobytes()
    assert estimate.covariance.tobytes() == calm.covariance.tobytes()


# Steps


@given(seed=st.integers(0, 1000))
def test_steps_carry_covariance_as_the_filter_predicts_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ekf = DrivenFilter()
    start = Pose.from_euler(rng.normal(0.0, 3.0, 3), roll=0.1, pitch=-0.05, yaw=rng.uniform(-3, 3))
    ekf.reset_pose(start, np.diag(rng.uniform(1e-6, 1e-3, 6)))
    pose, covariance = ekf.pose, ekf.covariance
    odom = Pose.identity()
    for _ in range(3):
        ekf.mark()
        then, attitude = odom, ekf.pose.rotation
        speed, turn = rng.uniform(-0.5, 0.5, 2)
        for _ in range(5):
            motion = ekf.predict(
                0.02,
                np.array([0.0, 0.0, turn]),
                np.array([0.0, 0.0, 9.81]),
                speed,
                speed,
                slipping=False,
            )
            odom = odom @ motion
        step = Step.of(then, odom, ekf.accrued, attitude)
        pose, covariance = step.carry(pose, covariance)
    assert apart(pose, ekf.pose)[0] < 1e-9
    # The filter knows besides that biases and parameters make errors that last.
    assert np.linalg.eigvalsh(ekf.covariance - covariance).min() > -1e-6
    np.testing.assert_allclose(covariance, ekf.covariance, atol=1e-4)


def test_step_that_was_also_seen_is_known_as_well_as_both_allow() -> None:
    wheels = Step(Pose.planar(0.10, 0.0, 0.02), np.diag([1e-4, 1e-4, 1e-6, 1e-6, 1e-6, 1e-4]))
    corridor = np.diag([100.0, 1e-6, 1e-6])
    step = wheels.corrected(Pose.planar(0.30, 0.01, 0.05), corridor)
    assert step.motion.position[0] == pytest.approx(0.10, abs=1e-4)
    assert step.motion.position[1] == pytest.approx(0.01, abs=2e-4)
    assert step.motion.yaw == pytest.approx(0.05, abs=1e-3)
    assert step.covariance[0, 0] == pytest.approx(1e-4, rel=0.01)
    assert step.covariance[1, 1] < 1.1e-6
