"""Faults in streams of readings change what they name, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from localization.evaluation.fault_injection import (
    INERTIAL,
    WHEELS,
    Clutter,
    Span,
    end_of,
    kidnapped,
    late,
    occluded,
    silent,
    slipping,
    source_of,
)
from localization.types import (
    SECOND,
    Hint,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)
from tests.support import a_drive, a_scan, bits


def drive() -> list[Reading]:
    return [reading for _, reading in a_drive()]


def all_bits(readings: list[Reading]) -> list[object]:
    return [bits(reading) for reading in readings]


def test_wheels_slip_within_the_span_only() -> None:
    before = drive()
    span = Span(SECOND // 2, SECOND)
    after = list(slipping(before, [span], 3.0))
    assert len(after) == len(before)
    changed = 0
    for a, b in zip(before, after, strict=True):
        if isinstance(a, WheelSpeeds) and span.holds(a.stamp):
            assert isinstance(b, WheelSpeeds)
            assert b.left == pytest.approx(3.0 * a.left, rel=1e-6)
            assert b.right == pytest.approx(3.0 * a.right, rel=1e-6)
            changed += 1
        else:
            assert bits(a) == bits(b)
    assert changed == 25


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_clutter_hides_its_share_of_the_beams_of_each_scanner(share: float) -> None:
    clutter = Clutter(share, near=0.4, far=0.9)
    for before, after in zip(drive(), occluded(drive(), clutter, seed=4), strict=True):
        if isinstance(before, Scan):
            assert isinstance(after, Scan)
            nearer = after.ranges < before.ranges
            assert nearer.sum() == round(share * len(nearer))
            assert ((after.ranges[nearer] >= 0.4) & (after.ranges[nearer] <= 0.9)).all()
            assert np.array_equal(after.ranges[~nearer], before.ranges[~nearer])
        else:
            assert bits(before) == bits(after)


def test_clutter_is_never_behind_a_wall_and_blocks_beams_without_return() -> None:
    scan = a_scan(ranges=[0.2] * 40 + [np.inf] * 40 + [np.nan] * 40)
    (hidden,) = occluded([scan], Clutter(1.0))
    assert isinstance(hidden, Scan)
    assert (hidden.ranges[:40] == scan.ranges[:40]).all()
    assert np.isfinite(hidden.ranges[40:]).all()


def test_clutter_stands_still_for_a_while_and_the_same_seed_places_it_alike() -> None:
    clutter = Clutter(0.3, stay=SECOND)
    scans = [a_scan(int(t * SECOND), ranges=np.full(541, 5.0)) for t in (0.1, 0.6, 1.2)]
    first, second, third = (s for s in occluded(scans, clutter, seed=1) if isinstance(s, Scan))
    again = list(occluded(scans, clutter, seed=1))
    other = next(occluded(scans, clutter, seed=2))
    assert isinstance(other, Scan)
    assert np.array_equal(first.ranges, second.ranges)
    assert not np.array_equal(second.ranges, third.ranges)
    assert not np.array_equal(first.ranges, other.ranges)
    assert all_bits([first, second, third]) == all_bits(again)


def test_silent_source_has_no_readings_in_the_span_and_others_continue() -> None:
    before, span = drive(), Span(SECOND // 2, SECOND)
    after = list(silent(before, "laser_vertical", span))
    gone = [r for r in before if source_of(r) == "laser_vertical" and span.holds(end_of(r))]
    assert gone
    assert len(after) == len(before) - len(gone)
    assert not [r for r in after if source_of(r) == "laser_vertical" and span.holds(end_of(r))]


def test_late_readings_arrive_unchanged_and_everything_else_keeps_its_order() -> None:
    before, delay = drive(), 200_000_000
    after = list(late(before, "laser_horizontal", delay))
    others = [r for r in after if source_of(r) != "laser_horizontal"]
    assert all_bits(others) == all_bits([r for r in before if source_of(r) != "laser_horizontal"])
    assert sorted(map(str, all_bits(after))) == sorted(map(str, all_bits(before)))
    now = 0
    for reading in after[:-3]:
        if isinstance(reading, Inertial):
            now = reading.stamp
        elif source_of(reading) == "laser_horizontal" and now < before[-1].stamp:
            assert now >= end_of(reading) + delay - 40_000_000


def test_no_delay_is_no_fault() -> None:
    assert sorted(map(str, all_bits(list(late(drive(), WHEELS, 0))))) == sorted(
        map(str, all_bits(drive()))
    )
    with pytest.raises(ValueError, match="delay must be >= 0"):
        list(late(drive(), WHEELS, -1))
    with pytest.raises(ValueError, match="jitter of -1"):
        list(late(drive(), WHEELS, 0, jitter=-1))


def test_late_readings_overtake_each_other_when_each_has_a_delay_of_its_own() -> None:
    def arrive(seed: int) -> list[Reading]:
        return list(late(drive(), WHEELS, 100_000_000, jitter=300_000_000, seed=seed))

    after = arrive(1)
    stamps = [r.stamp for r in after if isinstance(r, WheelSpeeds)]
    assert stamps != sorted(stamps)
    assert sorted(map(str, all_bits(after))) == sorted(map(str, all_bits(drive())))
    assert all_bits(after) == all_bits(arrive(1))
    assert all_bits(after) != all_bits(arrive(2))


def test_kidnapped_robots_stamps_continue_with_readings_from_elsewhere() -> None:
    first, second = drive(), drive()
    spliced = list(kidnapped(first, second))
    assert len(spliced) == 2 * len(first)
    assert all_bits(spliced[: len(first)]) == all_bits(first)
    stamps = [r.stamp for r in spliced if source_of(r) == INERTIAL]
    assert set(np.diff(stamps).tolist()) == {20_000_000}
    there = spliced[len(first)]
    assert isinstance(there, WheelSpeeds)
    assert isinstance(second[0], WheelSpeeds)
    assert there.left == second[0].left


def test_kidnapped_robots_odometry_stands_still_and_hints_are_removed() -> None:
    def poses(x: float) -> list[Reading]:
        return [Odometry(i * SECOND, Pose.planar(x + i, 0.0, 0.0)) for i in range(1, 4)]

    hint = Hint(0, Pose.identity(), np.zeros((6, 6)))
    spliced = list(kidnapped(poses(0.0), [hint, *poses(50.0)], gap=SECOND))
    at = [r.odom_from_base.position[0] for r in spliced if isinstance(r, Odometry)]
    assert at == pytest.approx([1.0, 2.0, 3.0, 3.0, 4.0, 5.0])
    assert [r.stamp for r in spliced] == [i * SECOND for i in range(1, 7)]


def test_a_scan_of_points_has_its_frame_as_source_and_ends_with_its_last_point() -> None:
    scan = PointScan(5, "top", np.zeros((2, 3)), np.array([0, 7]))
    assert source_of(scan) == "top"
    assert end_of(scan) == 12


def test_invalid_faults_are_rejected_by_name() -> None:
    with pytest.raises(ValueError, match="must end after its begin"):
        Span(2, 1)
    with pytest.raises(ValueError, match="share must be in"):
        Clutter(1.5)
