"""Words before a servo burns."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.load import Load, LoadWatch

TABLE = load_arm()
TICK = 0.02
STALL = [joint.servo.torque(TABLE.supply) for joint in TABLE.joints]
SHOULDER = 1


def torques(share: float, joint: int = SHOULDER) -> list[float]:
    return [share * stall if n == joint else 0.0 for n, stall in enumerate(STALL)]


def time_until(state: str, share: float, rate: float = 0.0, at_most: float = 60.0) -> float:
    watch, ticks = LoadWatch(TABLE), 0
    while ticks * TICK < at_most:
        ticks += 1
        if watch.take(TICK, torques(share), [rate] * 5).state == state:
            return ticks * TICK
    return float("inf")


def hold(watch: LoadWatch, share: float, time: float, rate: float = 0.0) -> Load:
    for _ in range(round(time / TICK)):
        load = watch.take(TICK, torques(share), [rate] * 5)
    return load


def test_half_of_the_stall_torque_is_held_for_an_hour_without_a_word() -> None:
    watch = LoadWatch(TABLE)
    load = watch.take(3600.0, torques(0.5), [0.0] * 5)
    assert (load.state, load.words) == ("fine", "")
    assert load.shares == pytest.approx([0.0, 0.5, 0.0, 0.0, 0.0])


def test_eighty_percent_are_held_for_a_second_and_then_given_up() -> None:
    assert time_until("overloaded", 0.8) == pytest.approx(TABLE.holding.short_time)


def test_less_beyond_the_long_share_lasts_longer_by_the_square_of_the_torque() -> None:
    # (0.8^2 - 0.5^2) / (0.6^2 - 0.5^2) s
    assert time_until("overloaded", 0.6) == pytest.approx(3.545, abs=TICK)


def test_a_servo_that_pushes_in_vain_is_stalled_within_half_a_second() -> None:
    assert time_until("stalled", 1.0) <= 0.5
    assert time_until("stalled", 0.92) <= 0.5


def test_a_servo_that_turns_under_full_torque_is_not_stalled_but_overloaded_soon() -> None:
    assert time_until("stalled", 1.0, rate=1.0) == float("inf")
    assert 0.5 < time_until("overloaded", 1.0, rate=1.0) < 0.6


def test_words_count_down_before_anything_gives_way() -> None:
    load = hold(LoadWatch(TABLE), 0.8, 0.4)
    assert load.state == "warm"
    assert not any(load.giving_way)
    assert load.words == (
        "shoulder (arm_joint_2) bears 80% of its servo's stall torque:"
        " it stands 50% for long, this for 0.6 s"
    )


def test_only_the_joint_that_bears_too_much_gives_way_until_it_bears_little() -> None:
    watch = LoadWatch(TABLE)
    load = hold(watch, 1.0, 0.5)
    assert load.giving_way == (False, True, False, False, False)
    assert "shoulder (arm_joint_2)" in load.words
    assert "backs off to where it touched" in load.words
    assert hold(watch, 0.6, 0.1, rate=0.5).giving_way[SHOULDER]
    assert not hold(watch, 0.3, TICK).giving_way[SHOULDER]


def test_a_servo_recovers_by_the_rule_by_which_it_warms() -> None:
    watch = LoadWatch(TABLE)
    hold(watch, 0.8, 0.9)
    spent = hold(watch, 0.0, 0.5).spent[SHOULDER]
    assert spent == pytest.approx(0.9 - 0.5 * 0.25 / 0.39, abs=1e-6)


def test_the_worst_joint_is_named() -> None:
    watch = LoadWatch(TABLE)
    for _ in range(10):
        load = watch.take(TICK, [0.6 * STALL[0], 0.0, 0.0, 0.0, -0.75 * STALL[4]], [0.0] * 5)
    assert "wrist pitch (arm_joint_5) bears 75%" in load.words


@given(st.lists(st.floats(0.0, 1.2), min_size=1, max_size=120))
def test_nothing_bears_more_than_its_budget_without_giving_way(shares: list[float]) -> None:
    watch, heat = LoadWatch(TABLE), 0.0
    for share in shares:
        load = watch.take(TICK, torques(share), [1.0] * 5)
        heat = max(heat + (share**2 - 0.25) * TICK / 0.39, 0.0)
        if heat > 1.0 + 1e-6 and share > 0.5:
            assert load.giving_way[SHOULDER]
        heat = min(heat, 1.0)
