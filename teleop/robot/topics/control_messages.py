"""Messages about the robot's time, and about who drives it."""

from __future__ import annotations

from localization.logs.ros_stamps import stamp_to_dict
from teleop.robot.safety.control_state import ControlMode
from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.message_parts import Messages, header


def clock(tick: DriveRecord) -> Messages:
    """Return the robot's time."""
    return ({"clock": stamp_to_dict(tick.stamp)},)


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
        },
    )
