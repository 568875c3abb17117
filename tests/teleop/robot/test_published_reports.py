"""What the robot reports of itself: bumpers, tilt, stalls, slip, and the controller's packets."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from localization.types import Health, Hint, Inertial, Pose, Twist, WheelSpeeds
from robot_sim import DriveConfig, Simulation, SimulationConfig, World, sensor_suite
from robot_sim.drive.aria_packets import StandardPacket
from robot_sim.drive.motor_controller import FirmwareConfig
from teleop.interfaces import registry
from teleop.joystick import Wish
from teleop.robot.robot import Drive, Message, Robot, Snapshot
from teleop.robot.topics import OUTPUTS
from teleop.rosbridge.messages.codec import Codec

REGISTRY = registry()
CODEC = Codec(REGISTRY)
TOPICS = {topic.name: topic for topic in OUTPUTS}
REPORTS = (
    "/bumper_state",
    "/firmware/packet",
    "/ground_truth/slip",
    "/ground_truth/condition",
    "/diagnostics",
)


def told(snapshot: Snapshot, name: str) -> dict[str, Any] | None:
    """Return a topic's message as a client reads it."""
    topic = TOPICS[name]
    message = topic.build(snapshot)
    return None if message is None else json.loads(CODEC.json(REGISTRY[topic.type], message))


def said(snapshot: Snapshot, name: str) -> dict[str, Any]:
    message = told(snapshot, name)
    assert message is not None
    return message


@pytest.fixture(scope="module")
def snapshots(office: World, office_cloud: Cloud, cache: Path) -> list[Snapshot]:
    """A robot with firmware that turns, then drives into the wall east of the office's lobby."""
    config = SimulationConfig(drive=DriveConfig(firmware=FirmwareConfig()), scanners=())
    start = Pose.planar(25.3, 3.0, math.radians(-12.0))
    simulation = Simulation(office, config=config, start=start)
    robot = Robot(simulation, Localizer(prepare(office_cloud, cache=cache), simulation.mounts))

    def tick(forward: float, turn: float) -> Snapshot:
        wish = Wish(Twist.planar(forward, turn), enabled=True)
        return robot.tick(simulation.stamp, [Drive("operator", wish)])

    return (
        [tick(0.0, 0.0) for _ in range(5)]
        + [tick(0.0, 0.4) for _ in range(35)]
        + [tick(0.4, 0.0) for _ in range(110)]
    )


def test_every_report_fits_its_type_in_json_and_cbor(snapshots: list[Snapshot]) -> None:
    for snapshot in snapshots[::7]:
        for name in REPORTS:
            message = TOPICS[name].build(snapshot)
            if message is not None:
                kind = REGISTRY[TOPICS[name].type]
                assert json.loads(CODEC.json(kind, message))
                assert CODEC.cbor(kind, message)


def test_bumpers_and_names_are_told_when_the_wall_is_met(snapshots: list[Snapshot]) -> None:
    early, late = snapshots[3], snapshots[-1]
    assert not any(said(early, "/bumper_state")["front_bumpers"])
    assert said(early, "/ground_truth/condition")["touching"] == []
    state = said(late, "/bumper_state")
    assert state["front_bumpers"] == list(late.condition.bumpers.front)
    assert any(state["front_bumpers"])
    assert state["rear_bumpers"] == [False] * 5
    condition = said(late, "/ground_truth/condition")
    assert condition["touching"] == ["east_0"]
    assert condition["wheels_down"] == [True] * 4
    assert condition["fallen"] is False


def test_slip_is_told_with_its_centres_of_rotation_while_the_robot_turns(
    snapshots: list[Snapshot],
) -> None:
    still, turning = (
        said(snapshots[3], "/ground_truth/slip"),
        said(snapshots[35], "/ground_truth/slip"),
    )
    assert still["turning"] is False
    assert still["icr_left"] == 0.0
    assert turning["turning"] is True
    slip = snapshots[35].truth.slip
    assert turning["icr_left"] == pytest.approx(slip.icr_left)
    # Turning to the left in place, by about the effective track.
    assert 0.2 < abs(turning["icr_left"]) < 0.4
    assert turning["icr_left"] * turning["icr_right"] < 0.0
    np.testing.assert_allclose(turning["longitudinal"], slip.longitudinal, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(turning["lateral"], slip.lateral, rtol=1e-6, atol=1e-9)


def test_packets_come_at_10_hz_and_can_be_read_by_a_client(snapshots: list[Snapshot]) -> None:
    packets = [(s, s.packet) for s in snapshots if s.packet is not None]
    assert len(packets) == len(snapshots) // 5
    last, packet = packets[-1]
    message = TOPICS["/firmware/packet"].build(last)
    assert message is not None
    assert StandardPacket.from_bytes(bytes(message["data"])) == packet
    assert packet is not None
    assert packet.left_stalled
    assert any(packet.bumpers.front)
    assert told(snapshots[-2], "/firmware/packet") is None
    wheels = sum(isinstance(r, WheelSpeeds) for s in snapshots for r in s.readings)
    inertial = sum(isinstance(r, Inertial) for s in snapshots for r in s.readings)
    assert (wheels, inertial) == (len(packets), len(snapshots))


def test_diagnostics_warn_of_a_bump(snapshots: list[Snapshot]) -> None:
    def drive_status(snapshot: Snapshot) -> dict[str, Any]:
        status: list[dict[str, Any]] = said(snapshot, "/diagnostics")["status"]
        return next(s for s in status if s["name"] == "drive")

    calm, bumped = drive_status(snapshots[3]), drive_status(snapshots[-1])
    assert (calm["level"], calm["message"]) == (0, "ok")
    assert (bumped["level"], bumped["message"]) == (1, "bumped in front")
    front = "".join("-#"[pressed] for pressed in snapshots[-1].condition.bumpers.front)
    assert {"key": "front bumpers", "value": front} in bumped["values"]
    assert "#" in front


def test_a_fall_is_an_error(office: World, snapshots: list[Snapshot]) -> None:
    lying = Pose.from_euler((24.2, 3.0, 0.6), roll=math.pi)
    simulation = Simulation(office, config=SimulationConfig(scanners=()), start=lying)
    for _ in range(60):
        simulation.step()
    fallen = replace(snapshots[-1], condition=simulation.condition)
    status = said(fallen, "/diagnostics")["status"][-1]
    assert status["level"] == 2
    assert status["message"].startswith("fallen")
    assert said(fallen, "/ground_truth/condition")["fallen"] is True


def test_localiser_follows_wheels_that_come_ten_times_a_second(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    config = SimulationConfig(drive=DriveConfig(firmware=FirmwareConfig()))
    simulation = Simulation(office, config=config, seed=4)
    localizer = Localizer(prepare(office_cloud, cache=cache), simulation.mounts)
    robot = Robot(simulation, localizer)
    start = simulation.truth().map_from_base
    inbox: list[Message] = [Hint(0, start, np.zeros((6, 6)))]
    errors, healths = [], set()
    for tick in range(350):
        snapshot = robot.tick(simulation.stamp, inbox)
        # Stop and go, to the left and to the right.
        forward, turn = (0.5, 0.0) if tick % 100 < 50 else (0.1, 2.0 if tick < 200 else -2.0)
        inbox = [Drive("operator", Wish(Twist.planar(forward, turn), enabled=True))]
        estimate = snapshot.estimate
        if tick > 100:
            healths.add(estimate.health)
            assert estimate.map_from_base is not None
            off = estimate.map_from_base.position - snapshot.truth.map_from_base.position
            errors.append(float(np.hypot(off[0], off[1])))
    assert healths == {Health.TRACKING}
    assert max(errors) < 0.04
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.015


def test_every_scan_of_a_mirror_that_outruns_the_tick_is_told(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    """An LMS-200 at 0.5 deg ends 75 half scans a second; ticks are 50."""
    scanners = sensor_suite("sick_lms200").scanners
    simulation = Simulation(office, config=SimulationConfig(scanners=scanners))
    robot = Robot(simulation, Localizer(prepare(office_cloud, cache=cache), simulation.mounts))
    told_of: dict[str, list[tuple[int, float]]] = {"/scan": [], "/scan_vertical": []}
    for _ in range(16):
        snapshot = robot.tick(simulation.stamp, [])
        for name, stamps in told_of.items():
            for message in TOPICS[name].messages(snapshot):
                stamp = message["header"]["stamp"]
                stamps.append((stamp["nanosec"], math.degrees(message["angle_min"])))
                assert len(message["ranges"]) == 180 + (message["angle_min"] < math.radians(-89.9))
                assert math.degrees(message["angle_increment"]) == pytest.approx(1.0)
                assert message["time_increment"] == pytest.approx(37.04e-6, rel=1e-3)
    for stamps in told_of.values():
        assert len(stamps) == 24
        times, firsts = zip(*stamps, strict=True)
        assert np.diff(times) == pytest.approx(13_333_333, abs=20_000)
        assert firsts == pytest.approx([-90.0, -89.5] * 12, abs=1e-4)
