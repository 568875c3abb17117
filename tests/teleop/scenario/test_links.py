"""Link faults of a scenario become periods of its timeline."""

from __future__ import annotations

from teleop.link.emulation import SECOND
from teleop.ros_types import registry
from teleop.rosbridge import Protocol
from teleop.scenario.files.faults import Fault, Link
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.session.links import link_of


def arrivals(*faults: Fault, at: tuple[float, ...], size: int = 100) -> list[float]:
    """Return when frames of the first client reach the robot that set out at these times [s]."""
    link = link_of(Scenario(1, "x", fault=faults))
    protocol = Protocol(registry())
    protocol.observers.add(link)
    client = protocol.connect(0)
    return [link.arrival(client, size, round(time * SECOND)) / SECOND for time in at]


def test_each_figure_of_a_fault_holds_while_it_lasts() -> None:
    assert arrivals(Link("link", 1.0, 2.0, delay=0.5), at=(0.5, 1.0, 4.0)) == [0.5, 1.5, 4.0]
    assert arrivals(Link("link", 1.0, 2.0, rate=100.0), at=(0.5, 1.0, 4.0)) == [0.5, 2.0, 4.0]
    assert arrivals(Link("link", 1.0, 2.0, blackout=True), at=(0.5, 1.0)) == [0.5, 3.0]
    late = arrivals(Link("link", 1.0, jitter=0.4), at=(0.5, 2.0))
    assert late[0] == 0.5
    assert 2.0 < late[1] < 2.4


def test_fault_of_another_direction_or_client_changes_nothing() -> None:
    faults = (
        Link("link", 0.0, direction="down", delay=1.0),
        Link("link", 0.0, client=2, delay=1.0),
    )
    assert arrivals(*faults, at=(1.0,)) == [1.0]
