from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from localization.types import SECOND, Twist
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import Disconnected, DriveCommand, EStop, InboxMessage, TakeOver
from teleop.scenario.files.faults import Kidnap, Link, OperatorKilled
from teleop.scenario.whatif.open_loop import delivered

TICK = SECOND // 50


def command(number: int, client: str = "pilot") -> DriveCommand:
    request = VelocityRequest(Twist.planar(0.1 + number, 0.0), True)
    return DriveCommand(client, request, arrival=number * TICK, age=TICK)


def stream(ticks: int) -> dict[int, list[InboxMessage]]:
    """Return a command in each tick; it says by its speed in which it was recorded."""
    return {number: [command(number)] for number in range(ticks)}


def recorded_in(message: InboxMessage) -> int:
    assert isinstance(message, DriveCommand)
    return round(float(message.request.twist.linear[0]) - 0.1)


def test_commands_before_the_fork_stay_and_later_ones_come_later_and_older() -> None:
    recorded = stream(20)
    after = delivered(recorded, [Link("link", 0.2, delay=0.1)], 10, seed=0)
    assert all(after[number] == recorded[number] for number in range(10))
    assert set(range(10, 15)).isdisjoint(after)
    for number in range(10, 20):
        (message,) = after[number + 5]
        assert isinstance(message, DriveCommand)
        assert recorded_in(message) == number
        assert message.arrival == (number + 5) * TICK
        assert message.age == TICK + SECOND // 10


def test_a_blackout_holds_back_what_comes_and_lets_all_of_it_through_after_it() -> None:
    link = Link("link", 0.2, lasting=0.1, blackout=True)
    after = delivered(stream(20), [link], 10, seed=0)
    assert sorted(after) == [*range(10), *range(15, 20)]
    assert [recorded_in(message) for message in after[15]] == [10, 11, 12, 13, 14, 15]


def test_a_blackout_without_end_lets_nothing_through() -> None:
    after = delivered(stream(20), [Link("link", 0.2, blackout=True)], 10, seed=0)
    assert sorted(after) == list(range(10))


@pytest.mark.slow
@given(
    delay=st.floats(0.0, 0.5),
    jitter=st.floats(0.0, 0.5),
    lasting=st.floats(0.0, 1.0),
    seed=st.integers(0, 99),
)
def test_nothing_is_lost_or_overtaken_on_a_slow_link(
    delay: float, jitter: float, lasting: float, seed: int
) -> None:
    link = Link("link", 0.2, lasting=lasting, delay=delay, jitter=jitter)
    after = delivered(stream(60), [link], 10, seed=seed)
    order = [recorded_in(m) for number in sorted(after) for m in after[number]]
    assert order == list(range(60))
    assert all(number >= recorded_in(m) for number in after for m in after[number])
    again = delivered(stream(60), [link], 10, seed=seed)
    assert [(n, len(after[n])) for n in after] == [(n, len(again[n])) for n in again]


def test_a_killed_client_sends_nothing_more_and_is_gone() -> None:
    recorded = stream(20)
    recorded[3].append(TakeOver("guest"))
    recorded[4].append(Disconnected("guest"))
    after = delivered(recorded, [OperatorKilled("operator_killed", 0.2)], 10, seed=0)
    assert sorted(after) == list(range(11))
    assert after[10] == [Disconnected("pilot")]
    hung = delivered(recorded, [OperatorKilled("operator_killed", 0.2, silent=True)], 10, seed=0)
    assert sorted(hung) == list(range(10))


def test_what_the_scenario_itself_sends_is_not_on_the_link() -> None:
    recorded: dict[int, list[InboxMessage]] = {12: [EStop("a second operator"), command(12)]}
    after = delivered(recorded, [Link("link", 0.2, delay=0.1)], 10, seed=0)
    assert after[12] == [EStop("a second operator")]
    assert [recorded_in(message) for message in after[17]] == [12]


@pytest.mark.parametrize(
    "fault", [Kidnap("kidnap", 0.2), Link("link", 0.2, direction="down", delay=1.0)]
)
def test_faults_that_are_not_on_the_way_up_change_no_message(fault: Kidnap | Link) -> None:
    recorded = stream(20)
    assert delivered(recorded, [fault], 10, seed=0) == recorded
