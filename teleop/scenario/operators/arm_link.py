"""What a person at an arm sends and sees: hands, goals, rates and velocities; the arm's state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from localization.logs.ros_geometry import pose_from_message, pose_to_dict
from localization.types import Pose
from teleop.rosbridge.ros_time import SECOND, stamp
from teleop.scenario.operators.simulated_hand import HandSample
from teleop.scenario.operators.wire import Answer, Wire

MOVE: Final = "/arm/move", "farsteer_msgs/action/ArmMove"
GRIPPER: Final = "/gripper_controller/gripper_cmd", "control_msgs/action/GripperCommand"
FOLLOW: Final = (
    "/arm_controller/follow_joint_trajectory",
    "control_msgs/action/FollowJointTrajectory",
)


class Asked:
    """A goal that was sent."""

    answered = False
    """Whether its result has come."""

    def take(self, answer: Answer) -> None:
        """Take the result."""
        self.answered = True


class ArmLink:
    """One person's connection to the arm; owns what was seen of it last."""

    def __init__(self, wire: Wire) -> None:
        """Subscribe to the arm."""
        self._wire = wire
        self.tip: Pose | None = None
        """``arm_base_from_tool0`` as it was seen last; None before that."""
        self.stopped = False
        """Whether the robot says that something stopped the arm."""
        self.opening = 0.0
        """Of the gripper [m]."""
        self.joints: Sequence[str] = ()
        """Names of the joints, from the base."""
        wire.subscribe("/arm/state", "farsteer_msgs/msg/ArmState", self._see)
        wire.subscribe("/arm/info", "farsteer_msgs/msg/ArmInfo", self._learn)

    def _see(self, message: Mapping[str, Any]) -> None:
        self.tip = pose_from_message(message["tip"])
        self.stopped, self.opening = message["mode"] == "held", float(message["opening"])

    def _learn(self, message: Mapping[str, Any]) -> None:
        self.joints = message["joints"]

    def hand(self, sample: HandSample, *, tracked: bool = True) -> None:
        """Send what was measured of a hand, up to now."""
        header = {"stamp": self._wire.stamp_before(self._wire.now - sample.stamp)}
        message = {
            "header": {**header, "frame_id": "arm_base"},
            "pose": pose_to_dict(sample.pose),
            "engaged": sample.engaged,
            "trigger": sample.trigger,
            "tracked": tracked,
        }
        self._wire.publish("/arm/hand", "farsteer_msgs/msg/Hand", message)

    def jog(self, rates: Sequence[float]) -> None:
        """Ask for rates of the joints [rad/s]."""
        message = {"joint_names": list(self.joints), "velocities": list(rates)}
        self._wire.publish("/servo_node/delta_joint_cmds", "control_msgs/msg/JointJog", message)

    def drive(self, speed: float, turn: float) -> None:
        """Ask for a speed [m/s] and a turn rate [rad/s] of the vehicle."""
        message = {"linear": {"x": speed}, "angular": {"z": turn}}
        self._wire.publish("/cmd_vel", "geometry_msgs/Twist", message)

    def move(self, to: str | Pose) -> Asked:
        """Ask for a planned way to a named pose, or to a pose of the tip."""
        if isinstance(to, str):
            return self._ask(MOVE, {"name": to})
        pose = {"header": {"frame_id": "arm_base"}, "pose": pose_to_dict(to)}
        return self._ask(MOVE, {"pose": pose})

    def grip(self, opening: float, effort: float) -> Asked:
        """Ask for an opening of the gripper [m] with a force [N], 0 for its own."""
        return self._ask(GRIPPER, {"command": {"position": opening, "max_effort": effort}})

    def way_out(self) -> Asked:
        """Ask for what the robot offers."""
        asked = Asked()
        self._wire.call("/arm/way_out", "std_srvs/srv/Trigger", {}, asked.take)
        return asked

    def follow(
        self, times: Sequence[float], angles: Sequence[Sequence[float]], names: Sequence[str]
    ) -> Asked:
        """Ask for a timed motion of the joints: times [s], and angles at each of them [rad]."""
        points = [
            {"positions": list(row), "time_from_start": stamp(round(time * SECOND))}
            for time, row in zip(times, angles, strict=False)
        ]
        trajectory = {"joint_names": list(names or self.joints), "points": points}
        return self._ask(FOLLOW, {"trajectory": trajectory})

    def _ask(self, action: tuple[str, str], values: Mapping[str, Any]) -> Asked:
        asked = Asked()
        self._wire.goal(*action, values, asked.take)
        return asked
