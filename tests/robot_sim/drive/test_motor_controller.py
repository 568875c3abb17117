"""The motor controller: rounded commands, packets, and when it cuts the power."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, strategies as st

from localization.types import SECOND, Inertial, Twist, WheelSpeeds
from robot_sim.drive.aria_packets import POSITION_UNITS, StandardPacket
from robot_sim.drive.bumpers import Bumpers
from robot_sim.drive.drivetrain import DriveConfig
from robot_sim.drive.motor_controller import (
    Firmware,
    FirmwareConfig,
    MotionCommand,
    Override,
    quantised_command,
)
from robot_sim.drive.robot_condition import Condition
from robot_sim.simulation import TICK_NS, Simulation, SimulationConfig
from robot_sim.worlds.world import World
from tests.robot_sim.driving import BLIND, run

P3AT_FIRMWARE = FirmwareConfig()
LIKE_THE_VENDOR = SimulationConfig(drive=DriveConfig(firmware=P3AT_FIRMWARE), scanners=())
EXACT = SimulationConfig(
    drive=DriveConfig(firmware=P3AT_FIRMWARE, encoder_noise=0.0, encoder_scale_sigma=0.0),
    scanners=(),
)
AT_EASE = Condition(
    stamp=0,
    bumpers=Bumpers(),
    touching=(),
    roll=0.0,
    pitch=0.0,
    wheels_down=(True, True, True, True),
    grounded=False,
    left_stalled=False,
    right_stalled=False,
    fallen=False,
)
AHEAD = Bumpers(front=(False, False, True, False, False))


def packets_of(firmware: Firmware, left: float, right: float, ticks: int) -> list[StandardPacket]:
    """Let wheels turn at constant speeds [m/s]; return the packets."""
    packets = []
    for i in range(1, ticks + 1):
        firmware.take(WheelSpeeds(i * TICK_NS, left, right), TICK_NS / SECOND)
        if firmware.packet is not None:
            packets.append(firmware.packet)
    return packets


def moved_units(before: int, after: int) -> int:
    """Return the smaller difference of a position between two packets, across its wrap-around."""
    half = POSITION_UNITS // 2
    return (after - before + half) % POSITION_UNITS - half


@given(st.floats(-2.0, 2.0), st.floats(-5.0, 5.0))
def test_vel_commands_are_rounded_to_millimetres_and_degrees(forward: float, turn: float) -> None:
    v, w = quantised_command(forward, turn, P3AT_FIRMWARE)
    assert abs(v - forward) <= 0.5e-3 + 1e-12
    assert abs(w - turn) <= math.radians(0.5) + 1e-12
    assert 1e3 * v == pytest.approx(round(1e3 * v), abs=1e-9)
    assert math.degrees(w) == pytest.approx(round(math.degrees(w)), abs=1e-9)


@given(st.floats(-1.0, 1.0), st.floats(-2.0, 2.0))
def test_vel2_commands_are_steps_of_20_mm_per_second_on_each_side(
    forward: float, turn: float
) -> None:
    config = replace(P3AT_FIRMWARE, motion=MotionCommand.VEL2)
    v, w = quantised_command(forward, turn, config)
    across = 0.5 * w * config.effective_track
    wanted = 0.5 * turn * config.effective_track
    for side, asked in ((v - across, forward - wanted), (v + across, forward + wanted)):
        assert side / 0.02 == pytest.approx(round(side / 0.02), abs=1e-9)
        assert abs(side - asked) <= 0.01 + 1e-12


def test_vel2_commands_end_where_a_signed_byte_does() -> None:
    config = replace(P3AT_FIRMWARE, motion=MotionCommand.VEL2)
    assert quantised_command(100.0, 0.0, config)[0] == pytest.approx(2.54)


def test_effective_track_is_that_of_the_vendors_constant() -> None:
    # p2os: yaw rate is the difference over 2 / DiffConvFactor, 588 mm.
    assert P3AT_FIRMWARE.effective_track == pytest.approx(0.588, abs=3e-4)


def test_packet_is_sent_every_100_ms_with_mean_speeds_in_integer_units() -> None:
    packets = packets_of(Firmware(P3AT_FIRMWARE), 0.2014, 0.1986, 50)
    assert len(packets) == 10
    assert {(p.left, p.right) for p in packets} == {(201, 199)}
    assert all(p.moving for p in packets)
    assert [p.x for p in packets] == [20, 40, 60, 80, 100, 120, 140, 160, 180, 200]


def test_position_wraps_after_32_metres_and_is_followed_over_it() -> None:
    packets = packets_of(Firmware(P3AT_FIRMWARE), 0.7, 0.7, 3000)
    assert max(p.x for p in packets) < 32768
    steps = [moved_units(a.x, b.x) for a, b in pairwise(packets)]
    assert packets[0].x + sum(steps) == pytest.approx(42_000, abs=1)
    assert packets[-1].x == pytest.approx(42_000 - 32_768, abs=1)


def test_backwards_from_the_origin_wraps_to_the_top() -> None:
    packets = packets_of(Firmware(P3AT_FIRMWARE), -0.1, -0.1, 5)
    assert packets[0].x == 32768 - 10


def test_heading_stays_within_half_a_turn_and_yaw_rate_is_in_tenths_of_degrees() -> None:
    turn = 1.0
    across = 0.5 * turn * P3AT_FIRMWARE.effective_track
    packets = packets_of(Firmware(P3AT_FIRMWARE), -across, across, 500)
    units = [p.heading for p in packets]
    assert max(map(abs, units)) <= math.pi / 0.00153 + 1.0
    for i, heading in enumerate(units, start=1):
        error = math.remainder(heading * 0.00153 - 0.1 * i * turn, math.tau)
        assert abs(error) < 0.00153
    assert {p.turn for p in packets} == {573}


def test_circle_ends_where_it_began() -> None:
    speed, turn = 0.3, 2.0 * math.pi / 10.0
    across = 0.5 * turn * P3AT_FIRMWARE.effective_track
    last = packets_of(Firmware(P3AT_FIRMWARE), speed - across, speed + across, 500)[-1]
    assert abs(moved_units(0, last.x)) <= 2
    assert abs(moved_units(0, last.y)) <= 2


def test_factors_of_another_robot_scale_what_is_sent() -> None:
    config = FirmwareConfig(distance_factor=0.5, velocity_factor=0.25, angle_factor=0.001)
    last = packets_of(Firmware(config), 0.1, 0.1, 50)[-1]
    assert last.x == 200
    assert last.left == 400


def test_events_between_two_packets_are_in_the_next_one_only() -> None:
    firmware = Firmware(P3AT_FIRMWARE)
    for tick in range(1, 11):
        seen = replace(AT_EASE, stamp=tick * TICK_NS, bumpers=AHEAD if tick == 2 else Bumpers())
        firmware.judge(seen, 0.0)
        firmware.take(WheelSpeeds(tick * TICK_NS, 0.0, 0.0), 0.02)
        if tick == 5:
            assert firmware.packet is not None
            assert firmware.packet.bumpers == AHEAD
            # It did not move that way: no stall.
            assert not firmware.packet.left_stalled
        if tick == 10:
            assert firmware.packet is not None
            assert not firmware.packet.bumpers.pressed


def test_bumper_stops_travel_towards_it_and_no_other() -> None:
    firmware = Firmware(P3AT_FIRMWARE)
    bumped = replace(AT_EASE, bumpers=AHEAD)
    assert firmware.judge(bumped, 0.2) is Override.STOP
    assert firmware.judge(bumped, -0.2) is Override.NONE
    assert firmware.judge(bumped, 0.0) is Override.NONE
    careless = Firmware(replace(P3AT_FIRMWARE, bump_stall=False))
    assert careless.judge(bumped, 0.2) is Override.NONE


def test_stall_cuts_the_power_for_the_configured_time() -> None:
    firmware = Firmware(P3AT_FIRMWARE)
    assert firmware.judge(replace(AT_EASE, right_stalled=True), 0.2) is Override.RELAX
    assert firmware.judge(replace(AT_EASE, stamp=SECOND // 10), 0.2) is Override.RELAX
    assert firmware.judge(replace(AT_EASE, stamp=SECOND // 5), 0.2) is Override.NONE


@pytest.mark.parametrize("name", ["cycle", "differential_factor", "vel2_divisor", "battery"])
def test_invalid_constants_are_rejected(name: str) -> None:
    wrong: dict[str, Any] = {name: 0}
    with pytest.raises(ValueError, match=name):
        FirmwareConfig(**wrong)


def test_wheel_speeds_come_at_10_hz_and_agree_with_the_packets(field: World) -> None:
    simulation = Simulation(field, seed=3, config=LIKE_THE_VENDOR)
    simulation.command(Twist.planar(0.4, 0.3))
    stamps, inertial = [], 0
    for _ in range(200):
        readings = simulation.step()
        inertial += sum(isinstance(r, Inertial) for r in readings)
        wheels = [r for r in readings if isinstance(r, WheelSpeeds)]
        packet = simulation.packet
        assert len(wheels) == (packet is not None)
        if packet is not None:
            stamps.append(wheels[0].stamp)
            assert 1e3 * wheels[0].left == pytest.approx(packet.left, abs=1e-4)
            assert 1e3 * wheels[0].right == pytest.approx(packet.right, abs=1e-4)
            assert StandardPacket.from_bytes(packet.to_bytes()) == packet
    assert inertial == 200
    assert stamps == [100_000_000 * i for i in range(1, 41)]


def test_the_robot_turns_by_the_vendors_constant_and_not_by_the_closed_form(field: World) -> None:
    simulation = Simulation(field, config=EXACT)
    run(simulation, 100, Twist.planar(0.0, math.radians(45.0)))
    rates = []
    for _ in range(100):
        simulation.step()
        rates.append(float(simulation.truth().twist.angular[2]))
        if simulation.packet is not None:
            # The controller assumes that it moves as commanded.
            assert simulation.packet.turn == pytest.approx(450, abs=3)
    excess = P3AT_FIRMWARE.effective_track / field.robot.effective_track
    assert sum(rates) / 100 == pytest.approx(excess * math.radians(45.0), rel=0.01)


def test_odometry_of_the_packets_follows_a_straight_drive(field: World) -> None:
    simulation = Simulation(field, config=EXACT)
    simulation.command(Twist.planar(0.5, 0.0))
    packet = None
    for _ in range(500):
        simulation.step()
        packet = simulation.packet or packet
    assert packet is not None
    truth = simulation.truth().map_from_base.position
    assert 1e-3 * packet.x == pytest.approx(truth[0], rel=0.005)
    assert moved_units(0, packet.y) == pytest.approx(1e3 * truth[1], abs=2.0)


def test_without_firmware_there_is_no_packet(field: World) -> None:
    simulation = Simulation(field, config=BLIND)
    for _ in range(10):
        assert any(isinstance(r, WheelSpeeds) for r in simulation.step())
        assert simulation.packet is None
