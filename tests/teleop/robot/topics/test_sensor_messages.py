"""Messages of bumpers, tilt, stalls, slip, scans, and the controller's packets."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from localization.types import Health, Hint, Inertial, Pose, WheelSpeeds
from robot_sim import JACKAL, DriveConfig, Simulation, SimulationConfig, World, sensor_suite
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.motor_controller import FirmwareConfig
from teleop.robot.inbox import InboxMessage, PoseHint
from teleop.robot.tick_record import TickRecord
from teleop.robot.topics.topic_table import OUTPUTS
from teleop.ros_types import registry
from teleop.rosbridge.messages.json_cbor_codec import Codec
from tests.teleop.robot.conftest import RobotOf
from tests.teleop.robot.sticks import stick

REGISTRY = registry()
CODEC = Codec(REGISTRY)
TOPICS = {topic.name: topic for topic in OUTPUTS}


def published(tick: TickRecord, name: str) -> dict[str, Any]:
    """Return the one message of a topic in a tick as a client reads it."""
    topic = TOPICS[name]
    (message,) = topic.build(tick.drive)
    found: dict[str, Any] = json.loads(CODEC.json(REGISTRY[topic.type], message))
    return found


@pytest.fixture(scope="module")
def ticks(office: World, robot_of: RobotOf) -> list[TickRecord]:
    """A robot with firmware that turns, then drives into the wall east of the office's lobby."""
    config = SimulationConfig(drive=DriveConfig(firmware=FirmwareConfig()), scanners=())
    start = Pose.planar(25.3, 3.0, math.radians(-12.0))
    simulation = Simulation(office, config=config, start=start)
    robot = robot_of(simulation)

    def tick(forward: float, turn: float) -> TickRecord:
        return robot.tick(simulation.stamp, [stick("operator", forward, turn)])

    return (
        [tick(0.0, 0.0) for _ in range(5)]
        + [tick(0.0, 0.4) for _ in range(35)]
        + [tick(0.4, 0.0) for _ in range(110)]
    )


def test_contact_with_a_wall_is_published_as_bumpers_and_names(ticks: list[TickRecord]) -> None:
    early, late = ticks[3], ticks[-1]
    assert not any(published(early, "/bumper_state")["front_bumpers"])
    assert published(early, "/ground_truth/condition")["touching"] == []
    state = published(late, "/bumper_state")
    assert state["front_bumpers"] == list(late.condition.bumpers.front)
    assert any(state["front_bumpers"])
    assert state["rear_bumpers"] == [False] * 5
    condition = published(late, "/ground_truth/condition")
    assert condition["touching"] == ["east_0"]
    assert condition["wheels_down"] == [True] * 4
    assert condition["fallen"] is False


def test_slip_message_has_the_centres_of_rotation_of_a_turn(
    ticks: list[TickRecord],
) -> None:
    still, turning = (
        published(ticks[3], "/ground_truth/slip"),
        published(ticks[35], "/ground_truth/slip"),
    )
    assert still["turning"] is False
    assert still["icr_left"] == 0.0
    assert turning["turning"] is True
    slip = ticks[35].truth.slip
    assert turning["icr_left"] == pytest.approx(slip.icr_left)
    # Turning to the left in place, by about the effective track.
    assert 0.2 < abs(turning["icr_left"]) < 0.4
    assert turning["icr_left"] * turning["icr_right"] < 0.0
    np.testing.assert_allclose(turning["longitudinal"], slip.longitudinal, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(turning["lateral"], slip.lateral, rtol=1e-6, atol=1e-9)


def test_controller_packets_are_published_at_10_hz(ticks: list[TickRecord]) -> None:
    packets = [(s, s.drive.packet) for s in ticks if s.drive.packet is not None]
    assert len(packets) == len(ticks) // 5
    last, packet = packets[-1]
    (message,) = TOPICS["/firmware/packet"].build(last.drive)
    assert StandardPacket.from_bytes(bytes(message["data"])) == packet
    assert packet is not None
    assert packet.left_stalled
    assert any(packet.bumpers.front)
    assert TOPICS["/firmware/packet"].build(ticks[-2].drive) == ()
    wheels = sum(isinstance(r, WheelSpeeds) for s in ticks for r in s.readings)
    inertial = sum(isinstance(r, Inertial) for s in ticks for r in s.readings)
    assert (wheels, inertial) == (len(packets), len(ticks))


def test_diagnostics_warn_of_a_bump(ticks: list[TickRecord]) -> None:
    def drive_status(tick: TickRecord) -> dict[str, Any]:
        status: list[dict[str, Any]] = published(tick, "/diagnostics")["status"]
        return next(s for s in status if s["name"] == "drive")

    calm, bumped = drive_status(ticks[3]), drive_status(ticks[-1])
    assert (calm["level"], calm["message"]) == (0, "ok")
    assert (bumped["level"], bumped["message"]) == (1, "bumped in front")
    front = "".join("-#"[pressed] for pressed in ticks[-1].condition.bumpers.front)
    assert {"key": "front bumpers", "value": front} in bumped["values"]
    assert "#" in front


def test_a_fall_is_an_error(office: World, ticks: list[TickRecord]) -> None:
    lying = Pose.from_euler((24.2, 3.0, 0.6), roll=math.pi)
    simulation = Simulation(office, config=SimulationConfig(scanners=()), start=lying)
    for _ in range(60):
        simulation.step()
    drive = replace(ticks[-1].drive, condition=simulation.condition)
    fallen = replace(ticks[-1], drive=drive)
    status = published(fallen, "/diagnostics")["status"][0]
    assert status["level"] == 2
    assert status["message"].startswith("fallen")
    assert published(fallen, "/ground_truth/condition")["fallen"] is True


@pytest.mark.slow
def test_localiser_follows_wheels_that_come_ten_times_a_second(
    office: World, robot_of: RobotOf
) -> None:
    config = SimulationConfig(drive=DriveConfig(firmware=FirmwareConfig()))
    simulation = Simulation(office, config=config, seed=4)
    robot = robot_of(simulation)
    start = simulation.truth().map_from_base
    inbox: list[InboxMessage] = [PoseHint("a", Hint(0, start, np.zeros((6, 6))))]
    errors, healths = [], set()
    for number in range(350):
        tick = robot.tick(simulation.stamp, inbox)
        # Stop and go, to the left and to the right.
        forward, turn = (0.5, 0.0) if number % 100 < 50 else (0.1, 2.0 if number < 200 else -2.0)
        inbox = [stick("operator", forward, turn)]
        estimate = tick.estimate
        if number > 100:
            healths.add(estimate.health)
            assert estimate.map_from_base is not None
            off = estimate.map_from_base.position - tick.truth.map_from_base.position
            errors.append(float(np.hypot(off[0], off[1])))
    assert healths == {Health.TRACKING}
    assert max(errors) < 0.04
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.015


def test_every_scan_of_a_mirror_faster_than_the_ticks_is_published(
    office: World, robot_of: RobotOf
) -> None:
    """An LMS-200 at 0.5 deg ends 75 half scans a second; ticks are 50."""
    scanners = sensor_suite("sick_lms200").scanners
    simulation = Simulation(office, config=SimulationConfig(scanners=scanners))
    robot = robot_of(simulation)
    found: dict[str, list[tuple[int, float]]] = {"/scan": [], "/scan_vertical": []}
    for _ in range(16):
        tick = robot.tick(simulation.stamp, [])
        for name, stamps in found.items():
            for message in TOPICS[name].build(tick.drive):
                stamp = message["header"]["stamp"]
                stamps.append((stamp["nanosec"], math.degrees(message["angle_min"])))
                assert len(message["ranges"]) == 180 + (message["angle_min"] < math.radians(-89.9))
                assert math.degrees(message["angle_increment"]) == pytest.approx(1.0)
                assert message["time_increment"] == pytest.approx(37.04e-6, rel=1e-3)
    for stamps in found.values():
        assert len(stamps) == 24
        times, firsts = zip(*stamps, strict=True)
        assert np.diff(times) == pytest.approx(13_333_333, abs=20_000)
        assert firsts == pytest.approx([-90.0, -89.5] * 12, abs=1e-4)


def test_messages_describe_the_robot_that_is_driven(ticks: list[TickRecord]) -> None:
    tick = replace(ticks[-1], drive=replace(ticks[-1].drive, robot=JACKAL))
    (reading,) = (r for r in tick.readings if isinstance(r, WheelSpeeds))
    velocity = published(tick, "/joint_states")["velocity"]
    assert velocity[0] == pytest.approx(reading.left / JACKAL.rolling_radius)
    assert [s["hardware_id"] for s in published(tick, "/diagnostics")["status"]] == ["jackal"] * 2
    assert [s["hardware_id"] for s in published(ticks[-1], "/diagnostics")["status"]] == [
        "p3at"
    ] * 2
