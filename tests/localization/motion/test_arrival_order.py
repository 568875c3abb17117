"""Readings of one source keep the order in which they came, unless a pose shows that it only came late."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.motion.arrival_order import ArrivalOrder
from localization.types import SECOND, Inertial, Odometry, Pose, Reading, Scan

MS = SECOND // 1000
ERROR = 250 * MS
BEGIN = 10 * SECOND
ONE = np.ones(1)
SCAN = Scan(BEGIN, "laser", ONE, ONE, ONE, np.zeros(1, dtype=np.int64), 0.1, 9.0)


def odometry(stamp: int, way: float) -> Odometry:
    return Odometry(stamp, Pose.planar(1.0 + way, 2.0, 0.0))


def scan(stamp: int, scanner: str = "laser") -> Scan:
    return replace(SCAN, stamp=stamp, scanner=scanner)


def distrusting(end: int = BEGIN - SECOND) -> ArrivalOrder:
    """An order that has seen, until a time [ns], that stamps are wrong."""
    order = ArrivalOrder(ERROR)
    for i in range(14):
        order.arranged(odometry(end - (14 - i) * 200 * MS + (i % 2 - 1) * 250 * MS, -5.0 + 0.1 * i))
    assert order.distrusted
    return order


def arranged(order: ArrivalOrder, readings: list[Reading]) -> list[Reading]:
    return [due for reading in readings for due in order.arranged(reading)]


def stamps(order: ArrivalOrder, readings: list[Reading]) -> list[int]:
    return [due.stamp for due in arranged(order, readings)]


@given(
    steps=st.lists(st.integers(1000, 200 * MS), min_size=2, max_size=40),
    shakes=st.lists(st.integers(-50 * MS, 50 * MS), min_size=41, max_size=41, unique=True),
    way=st.floats(0.02, 0.1),
)
def test_poses_of_a_drive_with_stamps_shaken_by_50_ms_stay_in_order_and_near_their_stamps(
    steps: list[int], shakes: list[int], way: float
) -> None:
    own = [BEGIN + sum(steps[:i]) + shakes[i] for i in range(len(steps) + 1)]
    readings: list[Reading] = [odometry(stamp, i * way) for i, stamp in enumerate(own)]
    order = distrusting()
    order.arranged(odometry(BEGIN - SECOND, -way))
    placed = stamps(order, readings)
    assert all(after > before for before, after in pairwise(placed))
    late = [given_ - stamp for given_, stamp in zip(placed, own, strict=True)]
    assert min(late) >= 0
    assert max(late) <= 100 * MS + len(own)


def test_pose_of_a_stamp_that_has_come_already_is_a_repetition_unless_stamps_are_wrong_and_it_moved() -> (
    None
):
    own = [odometry(BEGIN, 0.0), odometry(BEGIN, 0.0), odometry(BEGIN, 0.06)]
    assert stamps(distrusting(), [*own]) == [BEGIN, BEGIN, BEGIN + 1]
    assert stamps(ArrivalOrder(ERROR), [*own]) == [BEGIN, BEGIN, BEGIN]


def test_a_pose_that_came_late_is_placed_by_its_stamp() -> None:
    order = distrusting()
    own = [odometry(BEGIN + at * MS, 0.5e-3 * at) for at in (0, 100, 200, 120, 300, 220)]
    assert stamps(order, [*own]) == [reading.stamp for reading in own]


def test_a_few_wrong_stamps_in_a_long_drive_prove_nothing() -> None:
    order = ArrivalOrder(ERROR)
    ways = np.arange(0.0, 30.0, 0.1)
    own: list[Reading] = []
    for i, way in enumerate(ways):
        wrong = 60 * MS if i % 60 == 5 else 0
        own.append(odometry(BEGIN + i * 50 * MS - wrong, way))
    assert stamps(order, own) == [reading.stamp for reading in own]
    assert not order.distrusted


def test_stamps_that_prove_wrong_are_not_trusted_while_the_robot_stands_and_are_when_it_has_driven_on() -> (
    None
):
    order = distrusting(BEGIN)
    for i in range(1, 400):
        order.arranged(odometry(BEGIN + i * 50 * MS, 0.0))
    assert order.distrusted
    for i in range(400, 600):
        order.arranged(odometry(BEGIN + i * 50 * MS, 0.1 * i))
    assert not order.distrusted


def test_a_turn_counts_as_a_way() -> None:
    order = distrusting()
    turns = [Odometry(BEGIN + at * MS, Pose.planar(0.0, 0.0, yaw)) for at, yaw in SPIN]
    assert stamps(order, [*turns])[-1] == BEGIN + 200 * MS + 1


SPIN = ((0, 0.0), (100, 0.1), (200, 0.2), (120, 0.3))


def test_a_scan_stamped_before_its_predecessor_is_placed_after_it() -> None:
    own: list[Reading] = [scan(BEGIN), scan(BEGIN - 30 * MS), scan(BEGIN + MS)]
    assert stamps(distrusting(), own) == [BEGIN, BEGIN + 1, BEGIN + MS]


KEPT: dict[str, list[Reading]] = {
    "in order": [odometry(BEGIN + i * MS, 0.1 * i) for i in range(9)],
    "scan so early that it is late": [scan(BEGIN), scan(BEGIN - ERROR - 1), scan(BEGIN + MS)],
    "each scanner has its order": [
        odometry(BEGIN, 0.0),
        scan(BEGIN - 30 * MS),
        scan(BEGIN - 40 * MS, "other"),
    ],
    "inertial readings are sorted": [
        Inertial(stamp, np.zeros(3), np.zeros(3)) for stamp in (BEGIN, BEGIN - 5 * MS)
    ],
}


@pytest.mark.parametrize("own", KEPT.values(), ids=KEPT)
def test_stamps_stay_as_they_are_where_nothing_shows_that_they_are_wrong(
    own: list[Reading],
) -> None:
    assert arranged(ArrivalOrder(ERROR), own) == own
    assert arranged(distrusting(), own) == own


def test_an_instant_that_is_written_twice_stays_one_instant() -> None:
    ways = (0.0, 0.1, 0.2, 0.2, 0.3)
    own = [BEGIN, BEGIN + 60 * MS, BEGIN + 40 * MS, BEGIN + 40 * MS, BEGIN + 50 * MS]
    readings: list[Reading] = [odometry(t, way) for t, way in zip(own, ways, strict=True)]
    placed = stamps(distrusting(), readings)
    assert placed == [own[0], own[1], own[1] + 1, own[1] + 1, own[1] + 2]


def test_after_a_bad_stamp_an_hour_ahead_the_order_is_kept_again() -> None:
    order = distrusting()
    order.arranged(odometry(BEGIN, 0.0))
    order.arranged(odometry(BEGIN + 3600 * SECOND, 0.1))
    own: list[Reading] = [
        odometry(BEGIN + t * MS, w) for t, w in ((90, 0.2), (190, 0.3), (120, 0.4))
    ]
    assert stamps(order, own) == [BEGIN + 90 * MS, BEGIN + 190 * MS, BEGIN + 190 * MS + 1]


def line(at: int) -> list[Reading]:
    """A scan and the odometry of its instant."""
    return [scan(BEGIN + at * MS), odometry(BEGIN + at * MS, 1e-3 * at)]


def test_a_scan_goes_with_the_odometry_of_its_line_once_three_lines_were_like_that() -> None:
    order = distrusting()
    arranged(order, line(0) + line(100) + line(200))
    arranged(order, [odometry(BEGIN + 300 * MS, 0.3)])
    wrong = BEGIN + 240 * MS
    placed = arranged(order, [scan(wrong), odometry(wrong, 0.35)])
    assert [type(reading) for reading in placed] == [Scan, Odometry]
    assert {reading.stamp for reading in placed} == {BEGIN + 300 * MS + 1}
    late = arranged(order, [scan(BEGIN + 220 * MS), odometry(BEGIN + 220 * MS, 0.22)])
    assert [reading.stamp for reading in late] == [BEGIN + 220 * MS] * 2


def test_a_scan_that_comes_after_the_odometry_of_its_line_goes_with_it() -> None:
    order = distrusting()
    arranged(order, [odometry(BEGIN, 0.0), odometry(BEGIN + 100 * MS, 0.1)])
    wrong = BEGIN + 60 * MS
    placed = arranged(order, [odometry(wrong, 0.2), scan(wrong)])
    assert {reading.stamp for reading in placed} == {BEGIN + 100 * MS + 1}


def test_a_scan_whose_odometry_does_not_come_is_taken_with_the_next_reading() -> None:
    order = distrusting()
    arranged(order, line(0) + line(100) + line(200) + [odometry(BEGIN + 300 * MS, 0.3)])
    alone = scan(BEGIN + 250 * MS)
    assert order.arranged(alone) == ()
    after = odometry(BEGIN + 400 * MS, 0.4)
    assert order.arranged(after) == (alone, after)


def test_a_scan_that_has_a_stamp_with_odometry_only_now_and_then_keeps_its_own() -> None:
    order = distrusting()
    for k in range(20):
        at = BEGIN + k * 100 * MS
        own: list[Reading] = [odometry(at, k), odometry(at + 10 * MS, k + 0.1), scan(at)]
        own += [odometry(at + 50 * MS, k + 0.5), scan(at + 50 * MS)]
        assert stamps(order, own) == [reading.stamp for reading in own]


@pytest.mark.parametrize("way", [0.0, 0.3])
def test_without_a_stamp_error_the_stamps_decide(way: float) -> None:
    own: list[Reading] = [odometry(BEGIN + t, i * way) for i, t in enumerate((0, -1, 5, 4))]
    own += [scan(BEGIN), scan(BEGIN - 1)]
    assert arranged(ArrivalOrder(0), own) == own
