"""The rule of the neutral stick: what a client did long ago may hold still."""

from __future__ import annotations

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.robot.inbox import EStop
from teleop.robot.safety.control_state import ControlMode
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.rules.authority import NeutralFirst
from teleop.scenario.referee.rules.rule import RunFacts
from teleop.scenario.referee.rules.wire_facts import ClientFacts, DriveMessage, WireFacts
from tests.teleop.scenario.referee.ticks import Ticks

KEPT = 64
"""Drive messages that are kept of a client."""


class Stick:
    """A client that sends ten positions of its stick a second, and a robot that obeys or does not."""

    def __init__(self) -> None:
        wire = WireFacts(lambda: 0)
        self.client = wire.clients[1] = ClientFacts("client 1", 1)
        nothing = Cloud(np.zeros((0, 3)), np.zeros((0, 3)), "nothing")
        self.rule = NeutralFirst(RunFacts(Scenario(1, "one"), wire, nothing, 0.7, 2.0, 1.0))
        self.ticks = Ticks()

    def hold(self, forward: float, seconds: float, *, obeyed: bool, sends: bool = True) -> bool:
        """Hold the stick for a while; return whether the rule was broken."""
        broken = False
        for _ in range(round(seconds * SECOND / TICK_NS)):
            now = self.ticks.number * TICK_NS
            if sends and now % (SECOND // 10) == 0:
                self.client.drives.append(DriveMessage(now, now, forward, 0.0, True, True))
                del self.client.drives[:-KEPT]
            broken |= self.tick(forward if obeyed else 0.0)
        return broken

    def tick(self, command: float, *messages: EStop) -> bool:
        mode = ControlMode.ARMED if command else ControlMode.IDLE
        record = self.ticks.tick(command=command, mode=mode, driver="client 1", inbox=messages)
        return self.rule.take(record) is not None


@pytest.fixture
def stick() -> Stick:
    return Stick()


def test_stick_that_was_never_at_rest_must_not_move_the_robot(stick: Stick) -> None:
    assert stick.hold(0.5, 1.0, obeyed=True)


def test_robot_that_hesitates_may_go_on_however_long_ago_the_stick_was_at_rest(
    stick: Stick,
) -> None:
    assert not stick.hold(0.0, 0.5, obeyed=True)
    assert not stick.hold(0.5, 0.1 * KEPT + 2.0, obeyed=True)
    assert not stick.hold(0.5, 0.2, obeyed=False)  # as when the link has become slow for a moment
    assert not stick.hold(0.5, 1.0, obeyed=True)


def test_stick_must_be_at_rest_anew_after_a_gap(stick: Stick) -> None:
    assert not stick.hold(0.0, 0.5, obeyed=True)
    assert not stick.hold(0.5, 1.0, obeyed=True)
    assert not stick.hold(0.5, 0.7, obeyed=False, sends=False)
    assert stick.hold(0.5, 1.0, obeyed=True)


def test_stick_must_be_at_rest_anew_after_an_e_stop(stick: Stick) -> None:
    assert not stick.hold(0.0, 0.5, obeyed=True)
    assert not stick.hold(0.5, 1.0, obeyed=True)
    assert not stick.tick(0.0, EStop("a bystander"))
    assert stick.hold(0.5, 1.0, obeyed=True)
