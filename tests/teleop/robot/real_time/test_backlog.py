"""A localiser that is slower than its robot: it keeps up by leaving out scans, and nothing but scans."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Hint, Inertial, Pose, Reading, Scan
from teleop.robot.estimation import Estimation
from teleop.robot.inbox import PoseHint
from teleop.robot.real_time.backlog import OLDEST_SCAN, Backlog
from teleop.robot.tick_record import DriveRecord
from tests.support_rooms import HALL, MOUNTS, TICK, Drive, apart
from tests.teleop.scenario.referee.ticks import Ticks

COST_OF_SWEEP = 3 * SECOND // 10
"""Three times as long as from one sweep to the next [ns]."""
COST_OF_TICK = SECOND // 1000
START = Pose.planar(3.0, 2.0, 0.3)
DRIVE = Drive(HALL, START, (1.0, 0.0, 0.0), (9.0, 0.4, 0.5), seed=1)


def records() -> Iterator[DriveRecord]:
    """One record for each tick of a drive, the first with the start pose."""
    ticks, sensed = Ticks(), list[Reading]()
    for reading in DRIVE.readings():
        sensed.append(reading)
        if isinstance(reading, Inertial):
            hint = PoseHint("", Hint(reading.stamp, START, np.zeros((6, 6))))
            first = ticks.number == 0
            drive = ticks.tick(0.0, 0.0, 0.0, inbox=(hint,) if first else ()).drive
            yield replace(drive, stamp=reading.stamp, sensed=tuple(sensed))
            sensed = []


@pytest.mark.slow
def test_overloaded_localiser_leaves_out_scans_and_stays_near_in_time_and_place() -> None:
    coming, backlog = list(records()), Backlog()
    estimation, clock, used = Estimation(Localizer(HALL.prepared(), MOUNTS)), 0, 0
    lags, off, states = [], [], set()
    while coming:
        clock = max(clock, coming[0].stamp) if not backlog else clock
        arrived = [r for r in coming if r.stamp <= clock]
        coming = coming[len(arrived) :]
        backlog.add(arrived)
        whole, needed, _ = backlog.take()
        assert [r for r in whole.sensed if not isinstance(r, Scan)] == [
            r for r in needed.sensed if not isinstance(r, Scan)
        ]
        seen = any(isinstance(r, Scan) for r in needed.sensed)
        used, clock = used + seen, clock + COST_OF_TICK + seen * COST_OF_SWEEP
        lags.append(clock - whole.stamp)
        estimate = estimation.take(needed).estimate
        if estimate.map_from_base is not None and whole.stamp > 2 * SECOND:
            off.append(apart(estimate.map_from_base, DRIVE.pose(estimate.stamp))[0])
            states.add(estimate.health)
    assert max(lags) <= OLDEST_SCAN + 2 * COST_OF_SWEEP
    assert 0.2 * DRIVE.end < used * COST_OF_SWEEP < DRIVE.end, used
    assert len(off) > 0.7 * DRIVE.end / TICK
    assert max(off) < 0.05
    assert not states & {Health.SUSPECT, Health.LOST, Health.RELOCALISING}, states


def test_of_the_hints_of_a_client_that_wait_the_newest_counts_and_nothing_else_is_lost() -> None:
    first, second = list(records())[:2]
    hint = first.inbox[0]
    assert isinstance(hint, PoseHint)
    newer, other = (
        replace(hint, hint=replace(hint.hint, stamp=second.stamp)),
        replace(hint, client="other"),
    )
    backlog = Backlog()
    backlog.add([first, replace(second, inbox=(newer, other))])
    taken = [backlog.take() for _ in range(2)]
    assert [whole.inbox for whole, _, _ in taken] == [(hint,), (newer, other)]
    assert [needed.inbox for _, needed, _ in taken] == [(), (newer, other)]
    assert [needed.sensed for _, needed, _ in taken] == [first.sensed, second.sensed]


@pytest.mark.slow
def test_localiser_that_gets_no_scans_for_too_long_says_that_it_cannot_keep_up() -> None:
    estimation, backlog, said = Estimation(Localizer(HALL.prepared(), MOUNTS)), Backlog(), []
    coming = list(records())
    for record in coming[: 3 * SECOND // TICK]:
        backlog.add([record])
        estimation.take(backlog.take()[1])
    backlog.add(coming[3 * SECOND // TICK : 5 * SECOND // TICK])
    while backlog:
        _, needed, left_out = backlog.take()
        for scan in left_out:
            estimation.localizer.leave_out(scan)
        estimate = estimation.take(needed).estimate
        said.append((estimate.health, estimate.reasons[:1], len(estimate.reasons)))
    assert (
        Health.SUSPECT,
        ("cannot keep up: 24 scans left out: only the robot's own motion is known",),
        1,
    ) in said
    assert not any("silent" in reason for _, reasons, _ in said for reason in reasons)
    for record in coming[5 * SECOND // TICK : 6 * SECOND // TICK]:
        estimate = estimation.take(record).estimate
    assert estimate.health is Health.TRACKING
