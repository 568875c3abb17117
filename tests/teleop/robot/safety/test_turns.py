"""Taking turns: who asks, who gives, and when a request ends, on a clock that is just a number."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from localization.types import SECOND
from teleop.robot.inbox import Ask, Disconnected, DriveCommand, EStop, Give, Refuse, TakeOver
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.turns import PATIENCE, Turn
from tests.teleop.robot.safety.test_safety import FORWARD, NEUTRAL, armed, ask


def asked(now: int = 0) -> Safety:
    """Return the safety of a robot that a drives, and b asks for."""
    safety = armed("a")
    assert safety.ask(Ask("b", 2), now) is None
    return safety


def asking(safety: Safety, now: int) -> str:
    state = safety.state(now)
    return state.asking.client if state.asking else ""


def test_request_ends_by_itself_after_half_a_minute() -> None:
    safety = asked()
    for second in range(30):
        ask(safety, "a", NEUTRAL, second * SECOND)
        assert asking(safety, second * SECOND) == "b"
    ask(safety, "a", NEUTRAL, PATIENCE)
    assert asking(safety, PATIENCE) == ""
    assert safety.give(Give("a"), PATIENCE) == "nobody asks for the robot"
    assert safety.state(PATIENCE).controller == "a"


def test_asking_again_does_not_begin_a_request_anew() -> None:
    safety = asked()
    assert safety.ask(Ask("b", 2), SECOND) is None
    assert safety.state(SECOND).asking_age == SECOND


@pytest.mark.parametrize(
    "end", [lambda s: s.disconnected("b"), lambda s: s.take_over("b", 1), lambda s: s.server_lost("")]
)  # fmt: skip
def test_request_ends_when_its_client_leaves_or_drives(end: object) -> None:
    safety = asked()
    assert callable(end)
    end(safety)
    assert asking(safety, 1) == ""


def test_request_ends_when_its_client_takes_the_lease_that_became_free() -> None:
    safety = asked()
    safety.disconnected("a")
    assert asking(safety, 1) == "b"
    ask(safety, "b", NEUTRAL, 2)
    assert asking(safety, 2) == ""


CLIENTS = st.sampled_from(("a", "b", "c"))
MESSAGES = st.one_of(
    st.builds(Ask, CLIENTS, st.just(7)),
    *(st.builds(kind, CLIENTS) for kind in (Give, Refuse, TakeOver, Disconnected, EStop)),
)


@given(messages=st.lists(MESSAGES, max_size=30))
def test_pending_messages_foretell_what_becomes_of_lease_and_request(
    messages: list[Ask | Give | Refuse | TakeOver | Disconnected | EStop],
) -> None:
    safety = armed("a")
    turn = Turn("a").after(messages)
    for message in messages:
        match message:
            case Ask():
                safety.ask(message, 0)
            case Give():
                safety.give(message, 0)
            case Refuse():
                safety.refuse(message, 0)
            case TakeOver():
                safety.take_over(message.client, 0)
            case Disconnected():
                safety.disconnected(message.client)
            case EStop():
                safety.stop(message)
    assert safety.state(0).turn == turn
    assert turn.asking is None or turn.asking.client != turn.controller


@given(messages=st.lists(MESSAGES, max_size=30))
def test_never_do_two_drive_and_never_does_a_driver_ask(
    messages: list[Ask | Give | Refuse | TakeOver | Disconnected | EStop],
) -> None:
    safety = armed("a")
    turn = Turn("a")
    for message in messages:
        before, turn = turn, turn.after([message])
        if turn.controller not in (before.controller, ""):
            assert isinstance(message, TakeOver | Give)
        if isinstance(message, Give) and turn != before:
            assert message.client == before.controller
    assert safety.request(DriveCommand("z", FORWARD, arrival=0), 0) is not None
