"""Messages about the robot's time, and about who drives it."""

from __future__ import annotations

from dataclasses import asdict

from localization.logs.ros_stamps import stamp_to_dict
from robot_sim import DriveConfig
from teleop.robot.guard.settings import GuardConfig
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.message_parts import Message, Messages, header


def clock(tick: DriveRecord) -> Messages:
    """Return the robot's time."""
    return ({"clock": stamp_to_dict(tick.stamp)},)


def drive_limits(drive: DriveConfig) -> Message:
    """Return how the robot answers a command; the lag is the one that its guard counts with."""
    return {
        "acceleration": drive.acceleration,
        "braking": drive.braking,
        "turn_acceleration": drive.turn_acceleration,
        "turn_braking": drive.turn_braking,
        "lag": GuardConfig().lag,
    }


def teleop_state(tick: DriveRecord) -> Messages:
    """Return the driver, the state of the command path and the command in force."""
    state = tick.control
    return (
        {
            "header": header(tick.stamp, "base_link"),
            "state": state.control.value,
            "reason": state.reason,
            "controller": state.controller,
            "armed": state.control is ControlMode.ARMED,
            "estop": state.control is ControlMode.ESTOP,
            "command_age": state.command_age / 1e9,
            "linear": float(state.twist.linear[0]),
            "angular": float(state.twist.angular[2]),
            "link_age": state.link_age / 1e9,
            "slow_above": state.stale.slow / 1e9,
            "refuse_above": state.stale.refuse / 1e9,
            "asking": state.asking.number if state.asking else 0,
            "asking_name": state.asking.client if state.asking else "",
            "asking_age": state.asking_age / 1e9,
            "guard": tick.guard.state.value,
            "guard_factor": tick.guard.factor,
            "guard_reason": tick.guard.reason,
            "guard_overridden_by": tick.guard.overridden_by,
            "guard_ahead": tick.guard.ahead,
            "late_factor": state.stale.speed_share(state.link_age),
        },
    )


def guard(tick: DriveRecord) -> Messages:
    """Return what the guard made of the driver's command."""
    verdict, near = tick.guard, tick.guard.near
    swept = () if verdict.swept is None else verdict.swept.tolist()
    return (
        {
            "header": header(tick.stamp, "base_link"),
            "state": verdict.state.value,
            "factor": verdict.factor,
            "reason": verdict.reason,
            "asked_linear": float(verdict.asked.linear[0]),
            "asked_angular": float(verdict.asked.angular[2]),
            "speed_limit": verdict.speed_limit,
            "has_point": near is not None,
            "point": {"x": near.x if near else 0.0, "y": near.y if near else 0.0, "z": 0.0},
            "source": near.source if near else "",
            "distance": near.distance if near else 0.0,
            **asdict(verdict.ways),
            "outline": {"points": [{"x": x, "y": y, "z": 0.0} for x, y in swept]},
            "overridden_by": verdict.overridden_by,
        },
    )
