from __future__ import annotations

from dataclasses import replace

from localization.monitoring.jump_detection import Change, JumpDetectionConfig, JumpDetector
from localization.types import SECOND, Pose, Sweep
from tests.support_rooms import HALL

HERE = Pose.planar(2.6, 1.6, 0.2)
PERIOD = SECOND // 10


def seen(pose: Pose, stamp: int) -> Sweep:
    return HALL.sweep(pose, noise=0.012, seed=stamp % 97, stamp=stamp)


def test_robot_that_drives_and_turns_sees_what_it_saw() -> None:
    detector, pose, odom = JumpDetector(), HERE, Pose.identity()
    for i in range(30):
        detector, jumped = detector.compared(seen(pose, i * PERIOD), odom)
        assert not jumped
        step = Pose.planar(0.05, 0.0, 0.09)
        pose, odom = pose @ step, odom @ step


def test_robot_that_is_carried_off_sees_something_else() -> None:
    detector = JumpDetector()
    detector, jumped = detector.compared(seen(HERE, 0), Pose.identity())
    assert not jumped
    elsewhere = Pose.planar(5.4, 3.6, -2.0)
    detector, jumped = detector.compared(seen(elsewhere, PERIOD), Pose.identity())
    assert jumped
    detector, jumped = detector.compared(seen(elsewhere, 2 * PERIOD), Pose.identity())
    assert not jumped


def test_motion_without_sweeps_is_a_jump_but_a_pause_at_rest_is_not() -> None:
    detector = JumpDetector()
    detector, _ = detector.compared(seen(HERE, 0), Pose.identity())
    detector, jumped = detector.compared(seen(HERE, 3 * SECOND), Pose.identity())
    assert not jumped
    rolled = Pose.planar(0.5, 0.0, 0.0)
    detector, change = detector.compared(seen(HERE @ rolled, 6 * SECOND), rolled)
    assert change is Change.UNKNOWN


def test_sweep_with_hardly_any_points_says_nothing() -> None:
    detector = JumpDetector()
    detector, _ = detector.compared(seen(HERE, 0), Pose.identity())
    full = seen(Pose.planar(5.4, 3.6, -2.0), PERIOD)
    few = Sweep(PERIOD, full.points[:50], full.origins[:50], full.horizontal[:50])
    detector, jumped = detector.compared(few, Pose.identity())
    assert not jumped


def half_new(config: JumpDetectionConfig, turn: float = 0.0) -> Change:
    """What is said of a sweep of which a fifth ends a metre nearer than in the last one."""
    before = seen(HERE, 0)
    detector, _ = JumpDetector(config).compared(before, Pose.identity())
    points = before.points.copy()
    some = slice(0, len(points) // 5)
    points[some] += (before.origins - before.points)[some] * 0.4
    after = Sweep(PERIOD, points, before.origins, before.horizontal)
    return detector.compared(after, Pose.planar(0.0, 0.0, turn))[1]


def test_sweep_of_which_a_part_is_new_is_said_to_have_changed_in_part() -> None:
    config = JumpDetectionConfig()
    assert half_new(config) is Change.PART
    assert half_new(config, turn=0.2) is not Change.PART
    assert half_new(replace(config, part_overlap=0.0)) is Change.NONE
