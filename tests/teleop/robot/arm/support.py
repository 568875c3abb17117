"""A robot with an arm, and clients that send it plain JSON as foreign programs do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.clearance import Clearance
from robot_sim.arm.kinematics import Kinematics
from robot_sim.arm.obstacles import Box
from teleop.robot.arm.arm_state import ArmState
from teleop.robot.tick_record import DriveRecord
from tests.teleop.robot.steps.support import StepClient, StepRig

TABLE = load_arm()
JOINTS = [joint.name for joint in TABLE.joints]
STOW, READY = np.array(TABLE.poses["stow"]), np.array(TABLE.poses["ready"])
LOWER, UPPER = np.array(TABLE.lower), np.array(TABLE.upper)
MOUNT = TABLE.mounts["bracket"]
KINEMATICS = Kinematics(TABLE)
READY_TIP = KINEMATICS.tip(READY)


def among(*boxes: Box) -> Clearance:
    """Return what measures distances to boxes."""
    clearance = Clearance(TABLE)
    clearance.surround(boxes)
    return clearance


class ArmRig:
    """A robot with an arm behind its protocol, ticked by the test."""

    def __init__(self, rig: StepRig) -> None:
        self.rig = rig

    def connect(self) -> ArmClient:
        """Connect a client."""
        return ArmClient(self.rig.connect(), self)

    def tick(self, ticks: int = 1) -> ArmState:
        """Advance the robot; return the arm after it."""
        return arm_of(self.rig.tick(ticks))

    def hold(self, ticks: int, command: Callable[[], object]) -> ArmState:
        """Give a command before each tick; return the arm after the last."""
        for _ in range(ticks):
            command()
            state = self.tick()
        return state

    def result(self, client: ArmClient, identity: str) -> dict[str, Any]:
        """Wait for the result of a goal."""
        self.until(lambda: client.ended(identity))
        return client.client.result(identity)

    def until(self, true: Any, *, seconds: float = 10.0) -> ArmState:
        """Advance the robot until something holds."""
        return arm_of(self.rig.until(true, seconds=seconds))


class ArmClient:
    """A client that moves the arm."""

    def __init__(self, client: StepClient, rig: ArmRig) -> None:
        self.client, self._rig = client, rig

    @property
    def name(self) -> str:
        """The name by which the robot knows it."""
        return self.client.name

    def publish(self, topic: str, message: Mapping[str, Any]) -> None:
        """Publish, without having advertised."""
        self.client.send(op="publish", topic=topic, msg=message)

    def hand(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        *,
        engaged: bool = True,
        frame: str = "arm_base",
        **more: Any,
    ) -> None:
        """Publish where the hand is."""
        message = {
            "header": {"frame_id": frame},
            "pose": pose(x, y, z),
            "engaged": engaged,
            "tracked": True,
            **more,
        }
        self.publish("/arm/hand", message)

    def jog(self, **rates: float) -> None:
        """Publish rates of joints, as MoveIt Servo's keyboard demo does."""
        message = {"joint_names": list(rates), "velocities": list(rates.values())}
        self.publish("/servo_node/delta_joint_cmds", message)

    def goal(self, identity: str, action: str, kind: str, **values: Any) -> None:
        """Send a goal."""
        self.client.send(
            op="send_action_goal",
            id=identity,
            action=action,
            action_type=kind,
            args=values,
            feedback=True,
        )

    def ended(self, identity: str) -> bool:
        """Return whether a goal has a result."""
        received = self.client.received
        return any(o["op"] == "action_result" and o["id"] == identity for o in received)

    def call(self, service: str, **values: Any) -> Mapping[str, Any] | None:
        """Call a service; return its answer if it came at once."""
        identity = f"call {len(self.client.received)}"
        self.client.send(op="call_service", id=identity, service=service, args=values)
        return self.answer(identity)

    def answer(self, identity: str) -> Mapping[str, Any] | None:
        """Return the answer of a call, if it has come."""
        found = [
            o
            for o in self.client.received
            if o["op"] == "service_response" and o.get("id") == identity
        ]
        return found[0] if found else None

    def messages(self, topic: str) -> list[dict[str, Any]]:
        """Return what came on a topic."""
        return [
            o["msg"] for o in self.client.received if o["op"] == "publish" and o["topic"] == topic
        ]

    def subscribe(self, *topics: str) -> None:
        """Subscribe to topics."""
        for topic in topics:
            self.client.send(op="subscribe", topic=topic)

    def feedback(self, identity: str) -> list[dict[str, Any]]:
        """Return the feedback on a goal."""
        return [
            o["values"]
            for o in self.client.received
            if o["op"] == "action_feedback" and o["id"] == identity
        ]

    @property
    def said(self) -> str:
        """The last ``status``; empty without one."""
        return self.client.errors()[-1] if self.client.errors() else ""


def pose(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    wxyz: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
) -> dict[str, Any]:
    """Return a ``geometry_msgs/Pose``."""
    w, i, j, k = wxyz
    return {
        "position": {"x": x, "y": y, "z": z},
        "orientation": {"w": w, "x": i, "y": j, "z": k},
    }


def arm_of(record: DriveRecord) -> ArmState:
    """Return the arm in a record."""
    assert record.arm is not None
    return record.arm
