"""Messages to the arm, read into what clients want of it; what is wrong with one is named with its field."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from localization.logs.ros_stamps import stamp_from_message
from localization.types import Pose
from robot_sim.arm.arm_table import ArmTable
from teleop.robot.arm.arm_commands import (
    BASE_FRAMES,
    TOOL_FRAME,
    ArmTwist,
    Five,
    GripperGoal,
    Hand,
    JointJog,
    Move,
    Three,
    TipTarget,
    Trajectory,
)
from teleop.rosbridge.errors import MessageError

_NOT_UNIT: Final = 1e-3
"""Departure of a quaternion's norm from 1 from which a status says that it was normalised."""
_LARGEST_SCALE: Final = 2.0
"""Largest way of the tip over way of the hand: beyond, the noise of a hand is larger at the tip than in the air."""
_LARGEST: Final = 1e12
"""Bound of every number: squares of larger ones may overflow."""
MOST_POINTS: Final = 1000
"""Points of a trajectory."""
_NOT_IN_A_ROOM: Final = ("map", "odom", TOOL_FRAME)
"""Frames of the robot in which no hand is measured."""

Message = Mapping[str, Any]


def read_hand(message: Message) -> Hand:
    """Return the hand in a ``farsteer_msgs/Hand``.

    Raises:
        MessageError: If a field is invalid; the message names it. So do all functions here.
    """
    scale, trigger = _finite("scale", message["scale"]), _finite("trigger", message["trigger"])
    if not 0.0 <= scale <= _LARGEST_SCALE:
        raise MessageError(
            f"scale must be above 0 and up to {_LARGEST_SCALE:g}, or 0 for 1, got {scale:g}"
        )
    if not 0.0 <= trigger <= 1.0:
        raise MessageError(f"trigger must be 0 (open) to 1 (closed), got {trigger:g}")
    return Hand(
        pose=read_pose(message["pose"]),
        engaged=bool(message["engaged"]),
        trigger=trigger,
        tracked=bool(message["tracked"]),
        scale=scale or 1.0,
        stamp=stamp_from_message(message["header"]["stamp"]),
        frame=hand_frame(message["header"]["frame_id"]),
    )


def hand_frame(name: str) -> str:
    """Return the frame of a hand: the robot's base, or any name that its operator's room has."""
    if name in _NOT_IN_A_ROOM or name.startswith("arm_link"):
        raise MessageError(
            f"header.frame_id must be {' or '.join(BASE_FRAMES)}, or a name of your own for your room, got {name!r}"
        )
    return name[:64]


def read_twist(message: Message) -> ArmTwist:
    """Return the velocity of the tip in a ``geometry_msgs/TwistStamped``."""
    twist = message["twist"]
    return ArmTwist(
        _three("twist.linear", twist["linear"]),
        _three("twist.angular", twist["angular"]),
        frame_of(message, *BASE_FRAMES, TOOL_FRAME),
    )


def read_jog(message: Message, table: ArmTable) -> JointJog:
    """Return the rates of the joints in a ``control_msgs/JointJog``; joints that it does not name stand still."""
    names, velocities = message["joint_names"], message["velocities"]
    if len(message["displacements"]):
        raise MessageError(
            "displacements are not followed: send velocities, or a goal to /arm/move"
        )
    _check_names("joint_names", names, table, complete=False)
    rates = dict(zip(names, _numbers("velocities", velocities, len(names)), strict=True))
    return JointJog(_five(rates.get(joint.name, 0.0) for joint in table.joints))


def read_tip_target(message: Message) -> TipTarget:
    """Return the pose of the tip in a ``geometry_msgs/PoseStamped``."""
    return TipTarget(read_pose(message["pose"]), frame_of(message, *BASE_FRAMES))


def read_trajectory(
    number: int, trajectory: Message, table: ArmTable, goal: Message | None = None
) -> Trajectory:
    """Return the motion in a ``trajectory_msgs/JointTrajectory``.

    Args:
        number: Number of the goal.
        trajectory: The message.
        table: The arm.
        goal: The ``control_msgs/FollowJointTrajectory`` that it is part of, with its tolerances.
    """
    names, points = trajectory["joint_names"], trajectory["points"]
    _check_names("joint_names", names, table, complete=True)
    if not 1 <= len(points) <= MOST_POINTS:
        raise MessageError(f"points: there must be 1 to {MOST_POINTS}, got {len(points)}")
    order = [list(names).index(joint.name) for joint in table.joints]
    times: list[float] = []
    positions: list[Five] = []
    for i, point in enumerate(points):
        where = f"points[{i}]"
        values = _numbers(f"{where}.positions", point["positions"], len(order))
        positions.append(_five(values[k] for k in order))
        times.append(stamp_from_message(point["time_from_start"]) * 1e-9)
        if times[-1] < 0.0 or (i and times[-1] <= times[-2]):
            raise MessageError(
                f"{where}.time_from_start must rise from 0 on, got {times[-1]:g} s"
                + (f" after {times[-2]:g} s" if i else "")
            )
    goal = goal or {}
    return Trajectory(
        number,
        tuple(times),
        tuple(positions),
        _tolerance("path_tolerance", goal.get("path_tolerance", ()), table),
        _tolerance("goal_tolerance", goal.get("goal_tolerance", ()), table),
        stamp_from_message(goal["goal_time_tolerance"]) * 1e-9 if goal else 0.0,
    )


def read_move(number: int, goal: Message, table: ArmTable) -> Move:
    """Return the goal of a ``farsteer_msgs/ArmMove``: a name, angles, or a pose, the first that is given."""
    name, angles = str(goal["name"]), goal["angles"]
    preview, hold = bool(goal["preview"]), bool(goal["hold_to_run"])
    if name:
        if name not in table.poses:
            known = ", ".join(table.poses)
            raise MessageError(f"name: no pose {name[:40]!r}; there are: {known}")
        return Move(number, name=name, preview=preview, hold_to_run=hold)
    if len(angles):
        five = _five(_numbers("angles", angles, len(table.joints)))
        return Move(number, angles=five, preview=preview, hold_to_run=hold)
    frame = frame_of(goal["pose"], *BASE_FRAMES, TOOL_FRAME, field="pose.header.frame_id")
    pose = read_pose(goal["pose"]["pose"], "pose.pose")
    return Move(number, pose=pose, frame=frame, preview=preview, hold_to_run=hold)


def read_gripper(number: int, command: Message, table: ArmTable) -> GripperGoal:
    """Return the goal of a ``control_msgs/GripperCommand``; its position is the distance between the pads."""
    opening = _finite("command.position", command["position"])
    effort = _finite("command.max_effort", command["max_effort"])
    gripper = table.gripper
    if not 0.0 <= opening <= gripper.opening:
        raise MessageError(
            f"command.position must be 0 (closed) to {gripper.opening:g} m (open), got {opening:g}"
        )
    if not 0.0 <= effort <= gripper.force:
        raise MessageError(
            f"command.max_effort must be up to {gripper.force:g} N, or 0 for that, got {effort:g}"
        )
    return GripperGoal(number, opening, effort)


def read_pose(message: Message, field: str = "pose") -> Pose:
    """Return the pose in a ``geometry_msgs/Pose``, normalised."""
    place, turn = message["position"], message["orientation"]
    position = [_finite(f"{field}.position.{axis}", place[axis]) for axis in "xyz"]
    quaternion = [_finite(f"{field}.orientation.{axis}", turn[axis]) for axis in "wxyz"]
    if math.hypot(*quaternion) < _NOT_UNIT:
        raise MessageError(
            f"{field}.orientation must be a unit quaternion, got a norm of {math.hypot(*quaternion):g}"
        )
    return Pose(np.array(position), np.array(quaternion))


def off_unit(message: Message) -> float:
    """Return the norm of the quaternion of a ``geometry_msgs/Pose`` if it is not 1, otherwise 0."""
    turn = message["orientation"]
    norm = math.hypot(*(float(turn[axis]) for axis in "wxyz"))
    return norm if abs(norm - 1.0) > _NOT_UNIT else 0.0


def frame_of(message: Message, *frames: str, field: str = "header.frame_id") -> str:
    """Return the frame of a message with a header; empty is the first of those allowed."""
    name = message["header"]["frame_id"].removeprefix("/")
    if name and name not in frames:
        raise MessageError(f"{field} must be {' or '.join(frames)}, got {name[:40]!r}")
    return name or frames[0]


def _check_names(field: str, names: Sequence[str], table: ArmTable, *, complete: bool) -> None:
    """Raise a MessageError if a name is unknown or there twice, or if one of all is missing."""
    known = [joint.name for joint in table.joints]
    for name in names:
        if name not in known:
            raise MessageError(f"{field}: no joint {name[:40]!r}; there are: {', '.join(known)}")
        if list(names).count(name) > 1:
            raise MessageError(f"{field}: {name} is there twice")
    if complete and (missing := [name for name in known if name not in names]):
        raise MessageError(f"{field}: {', '.join(missing)} missing")


def _tolerance(field: str, given: Sequence[Message], table: ArmTable) -> Five:
    names = [tolerance["name"] for tolerance in given]
    _check_names(field, names, table, complete=False)
    # -1 erases a default, and there is none that a client can set.
    allowed = {t["name"]: max(0.0, _finite(f"{field}.position", t["position"])) for t in given}
    return _five(allowed.get(joint.name, 0.0) for joint in table.joints)


def _numbers(field: str, values: Sequence[float], count: int) -> list[float]:
    if len(values) != count:
        raise MessageError(f"{field} must have {count} numbers, got {len(values)}")
    return [_finite(f"{field}[{i}]", value) for i, value in enumerate(values)]


def _finite(field: str, value: float) -> float:
    number = float(value)
    if not abs(number) < _LARGEST:
        raise MessageError(f"{field} must be a finite number below {_LARGEST:g}, got {number}")
    return number


def _three(field: str, vector: Message) -> Three:
    x, y, z = (_finite(f"{field}.{axis}", vector[axis]) for axis in "xyz")
    return x, y, z


def _five(values: Iterable[float]) -> Five:
    first, second, third, fourth, fifth = values
    return first, second, third, fourth, fifth
