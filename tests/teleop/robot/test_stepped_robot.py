"""A robot and its server in one thread: messages in, records out, in an order that clients can rely on."""

from __future__ import annotations

from pathlib import Path

import pytest

from localization.maps.cloud import Cloud
from localization.types import Twist
from robot_sim import TICK_NS, World
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import DriveCommand, EStop
from teleop.robot.tick_record import TickRecord
from tests.teleop.scenario.operators.support import Stage


@pytest.fixture
def stage(office: World, office_cloud: Cloud, cache: Path) -> Stage:
    return Stage(office, office_cloud, cache, known=False)


def test_tick_takes_what_clients_want_and_hands_its_record_to_each_observer(stage: Stage) -> None:
    seen: list[TickRecord] = []
    stage.stepped.observers += (seen.append,)
    stage.adapter.wishes.post(EStop("ann"))
    tick = stage.stepped.tick()
    assert tick.inbox == (EStop("ann"),)
    assert seen == stage.ticks == [tick]
    assert stage.stepped.tick().inbox == ()
    assert stage.stepped.stamp == 2 * TICK_NS


def test_other_inbox_replaces_what_clients_want(stage: Stage) -> None:
    neutral = DriveCommand("bob", VelocityRequest(Twist.planar(0.0, 0.0), enabled=True))
    stage.adapter.wishes.post(EStop("ann"))
    stage.stepped.inbox = lambda: (neutral,)
    tick = stage.stepped.tick()
    assert tick.inbox == (neutral,)
    assert (tick.control.control, tick.control.controller) == ("armed", "bob")


def test_observers_see_a_tick_after_its_topics_are_published(stage: Stage) -> None:
    wire = stage.transport.connect()
    heard: list[int] = []
    seen: list[int] = []
    wire.subscribe("/imu/data", "sensor_msgs/msg/Imu", lambda message: heard.append(1))

    def observe(tick: TickRecord) -> None:
        wire.deliver()
        seen.append(len(heard))

    stage.stepped.observers += (observe,)
    stage.stepped.tick()
    assert seen == [1]


def test_timers_of_the_server_run_by_the_time_of_the_tick(stage: Stage) -> None:
    rung: list[int] = []
    stage.protocol.timers.at(3 * TICK_NS, rung.append)
    for _ in range(2):
        stage.stepped.tick()
    assert rung == []
    stage.stepped.tick()
    assert rung == [3 * TICK_NS]
