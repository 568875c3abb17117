"""Turns between poses of an odometry, from rates at other times."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.motion.gyro_turn import GyroStep, GyroTurn
from localization.types import SECOND, Inertial, Pose
from tests.support import floats

MS = SECOND // 1000
LEVEL = np.array([0.0, 0.0, 9.81])


def rate(stamp: int, turn: float, **more: object) -> Inertial:
    return Inertial(stamp, np.array([0.0, 0.0, turn]), LEVEL, **more)  # type: ignore[arg-type]


def steps(turn: GyroTurn, rates: list[Inertial], poses: list[int]) -> list[GyroStep | None]:
    """The steps of poses at some stamps, among rates, each in its order."""
    out, due = [], list(rates)
    for stamp in poses:
        while due and due[0].stamp <= stamp:
            turn = turn.received(due.pop(0))
        turn, step = turn.at(stamp, Pose.identity())
        out.append(step)
    return out


@given(
    st.lists(st.integers(11 * MS, 140 * MS), min_size=3, max_size=30),
    st.integers(5 * MS, 50 * MS),
    floats(-1.5, 1.5),
)
def test_turns_add_up_to_that_of_the_drive_whatever_the_stamps(
    pauses: list[int], period: int, turn: float
) -> None:
    """At a rate that grows, so that what is carried ahead is wrong, and made good."""
    end = SECOND + sum(pauses)
    rates = [rate(t, turn * (t / SECOND)) for t in range(period, end + period, period)]
    poses = np.cumsum([SECOND, *pauses]).tolist()
    taken = steps(GyroTurn(), rates, poses)
    assert taken[0] is None
    found = [float(step.turn[2]) for step in taken[1:] if step is not None]
    assert len(found) == len(pauses)
    # Of a mean rate over each period the integral is exact but for the part after the last reading.
    carried = abs(turn) * (2 * period / SECOND) * (end / SECOND)
    whole = sum(r.angular_velocity[2] * period / SECOND for r in rates if poses[0] < r.stamp <= end)
    assert sum(found) == pytest.approx(whole, abs=2.0 * carried + 1e-9)


def test_wheels_turn_the_robot_while_the_unit_is_silent_and_the_gyro_again_after_it() -> None:
    rates = [rate(t * MS, 0.4) for t in range(0, 8000, 20) if not 3000 < t < 6000]
    poses = list(range(1000 * MS, 8000 * MS, 100 * MS))
    taken = dict(zip(poses, steps(GyroTurn(), rates, poses), strict=True))
    for stamp, step in taken.items():
        silent = stamp == poses[0] or 3200 * MS < stamp < 6000 * MS
        assert (step is None) == silent, stamp / MS
        if step is not None:
            assert step.turn[2] == pytest.approx(0.04)
            assert step.seconds == pytest.approx(0.1)


def test_turn_over_a_pause_of_the_whole_log_is_not_known_to_the_gyro() -> None:
    rates = [rate(t * MS, 0.4) for t in [*range(0, 2000, 20), *range(5000, 6000, 20)]]
    taken = steps(GyroTurn(), rates, [1900 * MS, 1980 * MS, 5000 * MS, 5100 * MS])
    assert [step is None for step in taken] == [True, False, True, False]


def test_readings_again_or_out_of_order_add_nothing() -> None:
    turn = GyroTurn().received(rate(SECOND, 0.4)).received(rate(SECOND + 20 * MS, 0.4))
    assert turn.received(rate(SECOND, 9.0)) is turn
    assert turn.received(rate(SECOND + 20 * MS, 9.0)) is turn


def test_orientations_are_compared_with_the_gyro_over_a_second() -> None:
    def reported(t: int) -> Inertial:
        pose = Pose.planar(0.0, 0.0, 0.4 * t / 1000)
        return rate(t * MS, 0.42, orientation=pose.quaternion_wxyz)

    poses = list(range(500 * MS, 3000 * MS, 100 * MS))
    taken = steps(GyroTurn(), [reported(t) for t in range(0, 3000, 20)], poses)
    shown = [step.bias for step in taken if step is not None and step.bias is not None]
    assert len(shown) == 2
    assert shown[0] == pytest.approx([0.0, 0.0, 0.02])
    last = taken[-1]
    assert last is not None
    assert last.tilt is not None
    assert last.tilt[:2] == pytest.approx((0.0, 0.0))
