"""Messages of the robot's sensors: scanners, inertial unit, wheel encoders, bumpers, controller packets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from localization.logs.laser_scan_message import scan_message
from localization.logs.motion_messages import inertial_message, wheels_message
from localization.types import Scan, WheelSpeeds
from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.arm_joints import arm_joints_message
from teleop.robot.topics.message_parts import Message, Messages, array, header


def scans_of(scanner: str) -> Callable[[DriveRecord], Messages]:
    """Return the builder of a scanner's scans; a mirror of 75 Hz ends one or two of them in a tick."""

    def scans(tick: DriveRecord) -> Messages:
        return tuple(
            _scan(reading)
            for reading in tick.sensed
            if isinstance(reading, Scan) and reading.scanner == scanner
        )

    return scans


def imu(tick: DriveRecord) -> Messages:
    """Return the newest inertial reading, with the attitude."""
    return () if tick.attitude is None else (_to_dict(inertial_message(tick.attitude)),)


def joint_states(tick: DriveRecord) -> Messages:
    """Return the joints of an arm, if there is one, and the newest wheel rates of both sides."""
    # Where only the newest message of a topic gets through, it is that of the wheels.
    arm = () if tick.arm is None else (_to_dict(arm_joints_message(tick.arm)),)
    found = [r for r in tick.sensed if isinstance(r, WheelSpeeds)]
    if not found:
        return arm
    return (*arm, _to_dict(wheels_message(found[-1], tick.robot.rolling_radius)))


def bumper_state(tick: DriveRecord) -> Messages:
    """Return the pressed segments of both bumpers."""
    bumpers = tick.condition.bumpers
    return (
        {
            "header": header(tick.stamp, "base_link"),
            "front_bumpers": list(bumpers.front),
            "rear_bumpers": list(bumpers.rear),
        },
    )


def firmware_packet(tick: DriveRecord) -> Messages:
    """Return the standard packet of a controller with firmware, if one was due."""
    if tick.packet is None:
        return ()
    return (array(tick.packet.to_bytes()),)


def _scan(scan: Scan) -> Message:
    message: Message = _to_dict(scan_message(scan))
    # JSON has no infinity, and some clients fail on null: a beam without return is beyond the range.
    clean = np.nan_to_num(message["ranges"], nan=0.0, posinf=scan.range_max + 1.0)
    return {**message, "ranges": clean}


def _to_dict(message: object) -> Any:
    """Return a message of the log's type store as dictionaries."""
    if is_dataclass(message):
        names = [f.name for f in fields(message) if f.name != "__msgtype__"]
        return {name: _to_dict(getattr(message, name)) for name in names}
    if isinstance(message, list):
        return [_to_dict(item) for item in message]
    return message
