"""A robot that drives and talks but does not localise, and clients that speak rosbridge to it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from localization.maps.cloud import Cloud
from localization.types import Pose
from robot_sim import TICK_NS, SimulationConfig, World
from teleop.link.command_age import RoundTrips
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.assembly import RobotParts, build_drive, latched_of
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.inbox import InboxMessage
from teleop.robot.tick_record import DriveRecord
from teleop.ros_types import registry
from teleop.rosbridge.framing.outgoing_frames import CloseFrame, Output
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.server.server import Server


class StepClient:
    """A client of the robot's own process that keeps all it receives."""

    def __init__(self, rig: StepRig, number: int) -> None:
        self._rig, self.number = rig, number
        self.name = rig.protocol.connections.name(number)
        self.received: list[dict[str, Any]] = []

    def send(self, **operation: object) -> None:
        """Send an operation."""
        now = self._rig.drive.simulation.stamp
        self._rig.protocol.receive(self.number, json.dumps(operation), now)

    def goal(self, identity: str, **values: object) -> None:
        """Send a goal of the action."""
        self.send(
            op="send_action_goal",
            id=identity,
            action="/move",
            action_type="farsteer_msgs/action/Move",
            args=values,
            feedback=True,
        )

    def cancel(self, identity: str) -> None:
        """Cancel a goal."""
        self.send(op="cancel_action_goal", id=identity, action="/move")

    def control(self, text: str) -> None:
        """Publish a step command."""
        self.send(op="publish", topic="/turtle_control", msg={"data": text})

    def velocity(self, forward: float) -> None:
        """Publish a velocity, as one who drives by hand does."""
        twist = {"linear": {"x": forward, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}
        self.send(op="publish", topic="/cmd_vel", msg=twist)

    def joy(self, *, held: bool, forward: float = 0.0) -> None:
        """Publish a stick."""
        buttons = [0, 0, 0, 0, int(held), 0]
        self.send(op="publish", topic="/joy", msg={"axes": [0.0, forward], "buttons": buttons})

    def call(self, service: str) -> None:
        """Call a service without arguments."""
        self.send(op="call_service", service=service, args={})

    def leave(self) -> None:
        """Be gone."""
        self._rig.protocol.disconnect(self.number, self._rig.drive.simulation.stamp)

    def results(self) -> list[tuple[str, Any]]:
        """Return id and outcome of each result, or the text of one that was never begun."""
        return [
            (o["id"], o["values"]["outcome"] if o["result"] else o["values"])
            for o in self.received
            if o["op"] == "action_result"
        ]

    def result(self, identity: str) -> dict[str, Any]:
        """Return the one result of a goal."""
        (found,) = [o for o in self.received if o["op"] == "action_result" and o["id"] == identity]
        return found

    def answers(self) -> list[dict[str, Any]]:
        """Return the results on ``/turtle_control/result``."""
        return [
            json.loads(o["msg"]["data"])
            for o in self.received
            if o["op"] == "publish" and o["topic"] == "/turtle_control/result"
        ]

    def errors(self) -> list[str]:
        """Return the texts of ``status``."""
        return [o["msg"] for o in self.received if o["op"] == "status"]


class StepRig:
    """The drive behind its protocol, ticked by the test; scanners would cost and show nothing."""

    def __init__(
        self,
        world: World,
        cloud: Cloud,
        *,
        start: Pose | None = None,
        config: SimulationConfig | None = None,
        guard: bool = False,
        round_trips: Callable[[int], RoundTrips | None] = lambda client: None,
    ) -> None:
        config = config or SimulationConfig(scanners=())
        self.drive = build_drive(RobotParts(world, simulation=config, start=start, guard=guard))
        simulation, arm = self.drive.simulation, ArmFit.of(world)
        self.protocol = Protocol(registry(), limits=ClientLimits.unhurried())
        server = Server(self.protocol, port=0, clock=lambda: simulation.stamp, lockstep=True)
        self.adapter = RosbridgeAdapter(
            server,
            latched_of(simulation, cloud),
            undo_memory=0,
            round_trips=round_trips,
            arm=arm,
        )
        self.inboxes: list[list[InboxMessage]] = []
        self.clients: dict[int, StepClient] = {}
        self.protocol.connections.detach()
        self.protocol.connections.attach(self)

    def connect(self) -> StepClient:
        """Connect a client."""
        number = self.protocol.connect(self.drive.simulation.stamp)
        client = self.clients[number] = StepClient(self, number)
        return client

    def send(self, client: int, output: Output) -> None:
        """Hand a frame to its client, as a transport does."""
        if not isinstance(output, CloseFrame) and client in self.clients:
            self.clients[client].received.append(json.loads(output.payload))

    def wake(self) -> None:
        """Do nothing: timers are ticked with the robot."""

    def tick(self, ticks: int = 1) -> DriveRecord:
        """Advance the robot."""
        for _ in range(max(1, ticks)):
            self.inboxes.append(self.adapter.wishes.take())
            record = self.drive.tick(self.drive.simulation.stamp, self.inboxes[-1])
            self.adapter.driven(record)
            self.protocol.timers.tick(record.stamp)
        return record

    def until(self, true: Callable[[], object], *, seconds: float = 30.0) -> DriveRecord:
        """Advance the robot until something holds."""
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            record = self.tick()
            if true():
                return record
        raise AssertionError(f"not within {seconds:g} s")


def outcome(result: Mapping[str, Any]) -> str:
    """Return the outcome in a result."""
    found: str = result["values"]["outcome"]
    return found
