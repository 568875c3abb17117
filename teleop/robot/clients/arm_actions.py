"""The actions of the arm: joint trajectories, the gripper, and planned moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from robot_sim.arm.arm_table import ArmTable
from teleop.robot.arm.arm_commands import Goal as ArmGoal
from teleop.robot.arm.goal_results import GoalOutcome, GoalResult, Grip
from teleop.robot.clients.arm_input_messages import read_gripper, read_move, read_trajectory
from teleop.robot.clients.arm_requests import ArmRequests, Report
from teleop.robot.topics.arm_messages import BASE, point, trajectory
from teleop.robot.topics.arm_topics import ARM_MOVE, FOLLOW, GRIPPER
from teleop.robot.topics.message_parts import Message, header
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.goals import Goal
from teleop.rosbridge.protocol.protocol import Protocol

_INVALID_GOAL: Final = -1
_CODES: Final = {GoalOutcome.DONE: 0, GoalOutcome.OFF_PATH: -4, GoalOutcome.OFF_GOAL: -5}
"""``error_code`` of ``control_msgs/FollowJointTrajectory``; all other ends have no code of their own there."""


class ArmActions:
    """Turns goals into those of the arm, and their results back."""

    def __init__(
        self,
        protocol: Protocol,
        requests: ArmRequests,
        table: ArmTable,
        on_goal: Callable[[int, str], object] = lambda client, action: None,
    ) -> None:
        """Offer the actions.

        Args:
            protocol: The protocol of the robot's server.
            requests: Takes the goals.
            table: The arm.
            on_goal: Called with a client's number and the name of the action, for each goal that was taken.
        """
        self._requests, self._table, self._on_goal = requests, table, on_goal
        protocol.actions.serve(FOLLOW.name, FOLLOW.type, self._follow)
        protocol.actions.serve(GRIPPER.name, GRIPPER.type, self._grip)
        protocol.actions.serve(ARM_MOVE.name, ARM_MOVE.type, self._move)

    def _follow(self, goal: Goal) -> None:
        given = goal.request
        if len(given["multi_dof_trajectory"]["points"]):
            raise ServiceError("multi_dof_trajectory must be empty: every joint has one axis")

        def ended(result: GoalResult) -> None:
            code = _CODES.get(result.outcome, _INVALID_GOAL)
            _end(goal, result, {"error_code": code, "error_string": _said(result)})

        def went_on(report: Report) -> None:
            goal.feedback(self._follow_feedback(report))

        self._ask(
            goal,
            FOLLOW.name,
            lambda number: read_trajectory(number, given["trajectory"], self._table, given),
            ended,
            went_on,
        )

    def _grip(self, goal: Goal) -> None:
        def ended(result: GoalResult) -> None:
            _end(goal, result, _grip_values(result.grip))

        def went_on(report: Report) -> None:
            goal.feedback(_grip_values(report[0].grip))

        command = goal.request["command"]
        self._ask(
            goal,
            GRIPPER.name,
            lambda number: read_gripper(number, command, self._table),
            ended,
            went_on,
        )

    def _move(self, goal: Goal) -> None:
        def ended(result: GoalResult) -> None:
            path = trajectory(result.path, self._table)
            values = {"outcome": result.outcome.value, "message": result.message, "path": path}
            _end(goal, result, values)

        def went_on(report: Report) -> None:
            progress, _ = report
            path = trajectory(progress.path, self._table)
            goal.feedback({"state": progress.state, "share": progress.share, "path": path})

        self._ask(
            goal,
            ARM_MOVE.name,
            lambda number: read_move(number, goal.request, self._table),
            ended,
            went_on,
        )

    def _ask(
        self,
        goal: Goal,
        action: str,
        make: Callable[[int], ArmGoal],
        ended: Callable[[GoalResult], object],
        went_on: Callable[[Report], object],
    ) -> None:
        goal.on_cancel(self._requests.ask(goal.client, make, ended, went_on))
        self._on_goal(goal.client, action)

    def _follow_feedback(self, report: Report) -> Message:
        _, arm = report
        return {
            "header": header(arm.stamp, BASE),
            "joint_names": [joint.name for joint in self._table.joints],
            "desired": point(arm.wanted, velocities=arm.wanted_rates),
            "actual": point(arm.angles, velocities=arm.rates),
            "error": point(
                np.asarray(arm.wanted - arm.angles), velocities=arm.wanted_rates - arm.rates
            ),
        }


def _said(result: GoalResult) -> str:
    return ": ".join(filter(None, [result.outcome.value, result.message]))


def _grip_values(grip: Grip | None) -> dict[str, Any]:
    if grip is None:
        return {}
    return {
        "position": grip.opening,
        "effort": grip.force,
        "stalled": grip.stalled,
        "reached_goal": grip.reached,
    }


def _end(goal: Goal, result: GoalResult, values: Mapping[str, Any]) -> None:
    """End a goal with its result; one that was refused says so instead, as a server that rejects it does."""
    if result.outcome in (GoalOutcome.DONE, GoalOutcome.PREVIEWED):
        goal.succeed(dict(values))
    elif result.outcome is GoalOutcome.CANCELLED:
        goal.canceled(dict(values))
    else:
        goal.abort("", dict(values))
