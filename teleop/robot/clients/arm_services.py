"""The services of the arm: stowing, ways out, MoveIt's kinematics and Servo settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_to_dict
from localization.types import InvalidReadingError, Pose
from robot_sim.arm.arm_table import ArmTable
from robot_sim.arm.inverse import solutions
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.parts import JAWS, arm_bodies, placed
from robot_sim.errors import ArmError
from teleop.robot.arm.arm_commands import BASE_FRAMES, TOOL_FRAME, Goal, Move, WayOut
from teleop.robot.arm.goal_results import GoalOutcome, GoalResult
from teleop.robot.clients.arm_input_messages import frame_of, read_pose
from teleop.robot.clients.arm_inputs import ArmInputs
from teleop.robot.clients.arm_requests import ArmRequests
from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.arm_messages import BASE
from teleop.robot.topics.arm_topics import (
    COMPUTE_FK,
    COMPUTE_IK,
    PAUSE,
    STOW,
    SWITCH,
    WAY_OUT,
)
from teleop.robot.topics.message_parts import Message, header
from teleop.rosbridge.errors import MessageError, ServiceError
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.protocol.protocol import Protocol

_GROUPS: Final = ("", "arm")
_SUCCESS, _INVALID_GROUP, _INVALID_CONSTRAINTS, _INVALID_STATE = 1, -15, -16, -17
_INVALID_LINK, _NO_FRAME, _NO_COLLISION_CHECKING, _NO_SOLUTION = -18, -21, -22, -31
"""Values of ``moveit_msgs/MoveItErrorCodes``."""


class _Refusal(Exception):
    """A request that MoveIt answers with a code."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


class ArmServices:
    """Serves what needs no waiting by what is known of the arm; owns its newest angles."""

    def __init__(
        self,
        protocol: Protocol,
        requests: ArmRequests,
        inputs: ArmInputs,
        table: ArmTable,
        mount: Pose,
    ) -> None:
        """Offer the services.

        Args:
            protocol: The protocol of the robot's server.
            requests: Takes the goals.
            inputs: What the settings of MoveIt Servo hold for.
            table: The arm.
            mount: ``base_from_arm_base``.
        """
        self._requests, self._inputs, self._table = requests, inputs, table
        self._kinematics, self._mount = Kinematics(table), mount
        self._angles: FloatArray = np.array(table.poses["stow"])
        serve = protocol.services.serve
        serve(SWITCH.name, SWITCH.type, self._switch)
        serve(PAUSE.name, PAUSE.type, self._pause)
        serve(COMPUTE_IK.name, COMPUTE_IK.type, self._compute_ik)
        serve(COMPUTE_FK.name, COMPUTE_FK.type, self._compute_fk)
        serve(STOW.name, STOW.type, self._stow)
        serve(WAY_OUT.name, WAY_OUT.type, self._way_out)

    def driven(self, tick: DriveRecord) -> None:
        """Note where the joints are."""
        if tick.arm is not None:
            self._angles = tick.arm.angles

    def _switch(self, client: int, request: Message, now: int) -> Message:
        if not self._inputs.choose(client, request["command_type"]):
            raise ServiceError(
                f"command_type must be 0 (joint jog), 1 (twist) or 2 (pose), got {request['command_type']}"
            )
        return {"success": True}

    def _pause(self, client: int, request: Message, now: int) -> Message:
        self._inputs.pause(client, request["data"])
        return {"success": True, "message": "paused" if request["data"] else "going on"}

    def _stow(self, client: int, request: Message, now: int) -> DeferredResponse:
        return self._done_later(client, lambda number: Move(number, name="stow"), "stowed")

    def _way_out(self, client: int, request: Message, now: int) -> DeferredResponse:
        return self._done_later(client, WayOut, "done")

    def _done_later(
        self, client: int, goal: Callable[[int], Goal], answer: str
    ) -> DeferredResponse:
        response = DeferredResponse()

        def ended(result: GoalResult) -> None:
            done = result.outcome is GoalOutcome.DONE
            why = f"{result.outcome.value}: {result.message}"
            response.complete({"success": done, "message": answer if done else why})

        self._requests.ask(client, goal, ended)
        return response

    def _compute_ik(self, client: int, request: Message, now: int) -> Message:
        try:
            angles = self._inverse(request["ik_request"])
        except _Refusal as refusal:
            return {"error_code": _code(refusal.code, str(refusal))}
        names = [joint.name for joint in self._table.joints]
        state = {"header": header(0, BASE), "name": names, "position": angles}
        return {"solution": {"joint_state": state}, "error_code": _code(_SUCCESS)}

    def _inverse(self, asked: Message) -> FloatArray:
        if asked["group_name"] not in _GROUPS:
            raise _Refusal(_INVALID_GROUP, f"group_name must be arm, got {asked['group_name']:.40}")
        if asked["avoid_collisions"]:
            text = "avoid_collisions is not offered here: /arm/move plans around what is near"
            raise _Refusal(_NO_COLLISION_CHECKING, text)
        if any(len(part) for part in asked["constraints"].values() if not isinstance(part, str)):
            raise _Refusal(_INVALID_CONSTRAINTS, "constraints must be empty")
        links = list(asked["ik_link_names"]) or [asked["ik_link_name"] or TOOL_FRAME]
        if links != [TOOL_FRAME]:
            raise _Refusal(_INVALID_LINK, f"ik_link_name must be {TOOL_FRAME}, got {links[0]:.40}")
        poses = list(asked["pose_stamped_vector"]) or [asked["pose_stamped"]]
        pose = self._in_arm_base(poses[0])
        near = self._state(asked["robot_state"]["joint_state"])
        try:
            found = solutions(self._kinematics, pose.position, pose.rotation[:, 0])
        except ArmError as error:
            raise _Refusal(_NO_SOLUTION, str(error)) from None
        if not len(found):
            raise _Refusal(_NO_SOLUTION, "no angles within the limits reach this pose")
        nearest: FloatArray = found[np.argmin(np.abs(found - near).max(axis=1))]
        return nearest

    def _in_arm_base(self, stamped: Mapping[str, Any]) -> Pose:
        try:
            frame = frame_of(stamped, *BASE_FRAMES)
            pose = read_pose(stamped["pose"])
        except (MessageError, InvalidReadingError) as error:
            raise _Refusal(_NO_FRAME, str(error)) from None
        return self._mount.inverse() @ pose if frame == "base_link" else pose

    def _compute_fk(self, client: int, request: Message, now: int) -> Message:
        try:
            stamped = self._forward(request)
        except _Refusal as refusal:
            return {"error_code": _code(refusal.code, str(refusal))}
        names = list(request["fk_link_names"])
        return {"pose_stamped": stamped, "fk_link_names": names, "error_code": _code(_SUCCESS)}

    def _forward(self, request: Message) -> Sequence[Message]:
        try:
            frame = frame_of(request, *BASE_FRAMES)
        except MessageError as error:
            raise _Refusal(_NO_FRAME, str(error)) from None
        angles = self._state(request["robot_state"]["joint_state"])
        names = [joint.name for joint in self._table.joints]
        turned, poses = dict(zip(names, angles, strict=True)), {BASE: Pose.identity()}
        for body in arm_bodies(self._table)[1:]:
            if body.name not in JAWS:
                poses[body.name] = poses[body.parent] @ placed(body, turned, 0.0)
        stamped = []
        for name in request["fk_link_names"]:
            if name not in poses:
                known = ", ".join(poses)
                raise _Refusal(_INVALID_LINK, f"no link {name[:40]!r}; there are: {known}")
            pose = self._mount @ poses[name] if frame == "base_link" else poses[name]
            stamped.append({"header": header(0, frame), "pose": pose_to_dict(pose)})
        return stamped

    def _state(self, state: Mapping[str, Any]) -> FloatArray:
        """Return the angles (5,) of a ``sensor_msgs/JointState``; the measured ones of joints that it leaves out."""
        angles = self._angles.copy()
        index = {joint.name: i for i, joint in enumerate(self._table.joints)}
        if len(state["name"]) != len(state["position"]):
            raise _Refusal(_INVALID_STATE, "robot_state: as many names as positions, please")
        for name, position in zip(state["name"], state["position"], strict=True):
            # A state of the whole robot has wheels as well.
            if name in index:
                angles[index[name]] = position
        if not np.isfinite(angles).all():
            raise _Refusal(_INVALID_STATE, "robot_state: positions must be finite")
        return angles


def _code(value: int, message: str = "") -> Message:
    return {"val": value, "message": message, "source": "farsteer" if message else ""}
