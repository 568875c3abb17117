from __future__ import annotations

import numpy as np
import pytest

from localization.monitoring.jump_detection import JumpDetector
from localization.types import SECOND, Pose, Sweep
from tests.support_rooms import HALL

HERE = Pose.planar(2.6, 1.6, 0.2)
PERIOD = SECOND // 10


def seen(pose: Pose, stamp: int) -> Sweep:
    return HALL.sweep(pose, noise=0.012, seed=stamp % 97, stamp=stamp)


def test_robot_that_drives_and_turns_sees_what_it_saw() -> None:
    detector, pose, odom = JumpDetector(), HERE, Pose.identity()
    for i in range(30):
        detector, change = detector.compared(seen(pose, i * PERIOD), odom)
        assert change is None if i == 0 else change is not None
        if change is not None:
            assert change.unexpected < 0.1
            assert change.seconds == pytest.approx(PERIOD / SECOND)
        step = Pose.planar(0.05, 0.0, 0.09)
        pose, odom = pose @ step, odom @ step


def test_robot_that_is_carried_off_sees_something_else() -> None:
    detector, _ = JumpDetector().compared(seen(HERE, 0), Pose.identity())
    elsewhere = Pose.planar(5.4, 3.6, -2.0)
    detector, change = detector.compared(seen(elsewhere, PERIOD), Pose.identity())
    assert change is not None
    assert change.unexpected > 0.4
    _, change = detector.compared(seen(elsewhere, 2 * PERIOD), Pose.identity())
    assert change is not None
    assert change.unexpected < 0.05


def test_sweep_with_hardly_any_points_says_nothing() -> None:
    detector, _ = JumpDetector().compared(seen(HERE, 0), Pose.identity())
    full = seen(Pose.planar(5.4, 3.6, -2.0), PERIOD)
    few = Sweep(PERIOD, full.points[:50], full.origins[:50], full.horizontal[:50])
    after, change = detector.compared(few, Pose.identity())
    assert change is None
    assert after is detector


def test_part_that_is_new_is_unexpected_unless_the_map_has_it() -> None:
    before = seen(HERE, 0)
    points = before.points.copy()
    some = slice(0, len(points) // 5)
    points[some] += (before.origins - before.points)[some] * 0.4
    after = Sweep(PERIOD, points, before.origins, before.horizontal)
    moved = np.zeros(len(points), dtype=bool)
    moved[some] = True
    detector, _ = JumpDetector().compared(before, Pose.identity())
    # That part is two fifths of what the level scanner sees.
    for mapped, share in ((None, 0.4), (~moved, 0.4), (np.ones(len(points), dtype=bool), 0.0)):
        _, change = detector.compared(after, Pose.identity(), mapped)
        assert change is not None
        assert change.unexpected == pytest.approx(share, abs=0.06)
