"""A robot and its server in one thread: messages in, records out, in an order that clients can rely on."""

from __future__ import annotations

from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from robot_sim import TICK_NS, World
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.inbox import EStop
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.tick_record import TickRecord
from teleop.scenario.operators.memory_transport import MemoryTransport
from tests.teleop.robot.sticks import stick


@pytest.fixture
def stepped(office: World, office_cloud: Cloud, cache: Path) -> SteppedRobot:
    prepared, config = prepare(office_cloud, cache=cache), ServeConfig(port=0, lockstep=True)
    return build_stepped_robot(RobotParts(office), office_cloud, prepared, config)


def test_tick_takes_what_clients_want_and_hands_its_record_to_each_observer(
    stepped: SteppedRobot,
) -> None:
    seen: list[TickRecord] = []
    ticks: list[TickRecord] = []
    stepped.observers = (ticks.append, seen.append)
    stepped.adapter.wishes.post(EStop("ann"))
    tick = stepped.tick()
    assert tick.inbox == (EStop("ann"),)
    assert seen == ticks == [tick]
    assert stepped.tick().inbox == ()
    assert stepped.stamp == 2 * TICK_NS


def test_other_inbox_replaces_what_clients_want(stepped: SteppedRobot) -> None:
    neutral = stick("bob", 0.0)
    stepped.adapter.wishes.post(EStop("ann"))
    stepped.inbox = lambda: (neutral,)
    tick = stepped.tick()
    assert tick.inbox == (neutral,)
    assert (tick.control.control, tick.control.controller) == ("armed", "bob")


def test_observers_see_a_tick_after_its_topics_are_published(stepped: SteppedRobot) -> None:
    protocol = stepped.gateway.server.protocol
    wire = MemoryTransport(protocol, lambda: stepped.stamp).connect()
    heard: list[int] = []
    seen: list[int] = []
    wire.subscribe("/imu/data", "sensor_msgs/msg/Imu", lambda message: heard.append(1))

    def observe(tick: TickRecord) -> None:
        wire.deliver()
        seen.append(len(heard))

    stepped.observers += (observe,)
    stepped.tick()
    assert seen == [1]


def test_timers_of_the_server_run_by_the_time_of_the_tick(stepped: SteppedRobot) -> None:
    rung: list[int] = []
    stepped.gateway.server.protocol.timers.at(3 * TICK_NS, rung.append)
    for _ in range(2):
        stepped.tick()
    assert rung == []
    stepped.tick()
    assert rung == [3 * TICK_NS]
