"""The robot behind a rosbridge server: clients' messages become wishes, its records go out on topics."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Final

from teleop.link.command_age import RoundTrips
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.client_inputs import ClientInputs
from teleop.robot.clients.description_file import serve_description
from teleop.robot.clients.disconnect_service import DisconnectService
from teleop.robot.clients.link_service import LinkService
from teleop.robot.clients.move_action import MoveAction
from teleop.robot.clients.name_services import serve_names
from teleop.robot.clients.preview_service import PreviewService
from teleop.robot.clients.robot_services import RobotServices
from teleop.robot.clients.step_requests import StepRequests
from teleop.robot.clients.turtle_control import TurtleControl
from teleop.robot.clients.whoami_service import serve_whoami
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import Disconnected
from teleop.robot.tick_record import DriveRecord, EstimateRecord, Rejection
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.topic_table import (
    DRIVE_OUTPUTS,
    ESTIMATE_OUTPUTS,
    ROBOT_DESCRIPTION,
    Interface,
    Record,
    Topic,
)
from teleop.rosbridge.compat.client_traffic import publish_client_traffic
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.graph.topic import Topic as Advertised
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.server.server import Server

if TYPE_CHECKING:  # imported only where there is an arm
    from teleop.robot.clients.arm_adapter import ArmAdapter

_PAUSED_EVERY: Final = 5
"""Ticks between two messages about the driver while the world stands still."""


class RosbridgeAdapter(Observer):
    """Joins a server and a robot that may be in another process.

    What clients want waits in ``wishes``; what the robot does is handed to ``driven`` and ``estimated``.
    """

    def __init__(
        self,
        server: Server,
        latched: Mapping[Interface, Message],
        *,
        undo_memory: int,
        round_trips: Callable[[int], RoundTrips | None] = lambda client: None,
        audit: AuditLog | None = None,
        hidden: Collection[str] = (),
        arm: ArmFit | None = None,
    ) -> None:
        """Advertise the robot's topics and services on the server.

        Args:
            server: The server, not yet started.
            latched: Messages that are published once, see ``latched_messages``.
            undo_memory: Time for which a placement can be undone [ns].
            round_trips: Returns the round trips of a client; None where no time passes on the way.
            audit: Log of what clients do to the robot.
            hidden: Names of topics that are not published; clients cannot publish them either.
            arm: The arm that the robot carries, if any.
        """
        self.server, self.wishes, self._audit = server, Wishes(), audit
        protocol = server.protocol
        self._clients: dict[str, int] = {}
        self._reported: dict[int, str] = {}
        self._paused = 0
        for name in hidden:
            protocol.topics.reserve(name)
        self._arm: ArmAdapter | None = None
        if arm is not None:
            # Imported here, since most robots have none.
            from teleop.robot.clients.arm_adapter import ArmAdapter

            self._arm = ArmAdapter(server, self.wishes, arm, round_trips=round_trips, audit=audit)
        drive_outputs, estimate_outputs = DRIVE_OUTPUTS, ESTIMATE_OUTPUTS
        if self._arm is not None:
            drive_outputs = self._arm.drive_outputs(DRIVE_OUTPUTS)
            estimate_outputs = self._arm.estimate_outputs(ESTIMATE_OUTPUTS)
        self._drive_outputs = self._advertised(drive_outputs, hidden)
        self._estimate_outputs = self._advertised(estimate_outputs, hidden)
        for topic, message in latched.items():
            protocol.topics.advertise(topic.name, topic.type, latch=True)
            protocol.topics.publish(topic.name, message, 0)
        self._steps = StepRequests(
            protocol.connections, self.wishes, round_trips=round_trips, now=self._now
        )
        self._turtle_control = TurtleControl(protocol, self._steps, now=self._now, audit=audit)
        MoveAction(protocol, self._steps, audit)
        self._inputs = ClientInputs(
            protocol,
            self.wishes,
            round_trips=round_trips,
            audit=audit,
            turtle_control=self._turtle_control.receive,
        )
        self._services = RobotServices(protocol, self.wishes, undo_memory, audit)
        self.previews = PreviewService(protocol)
        """Previews of hints, which the estimator answers."""
        serve_description(protocol, latched[ROBOT_DESCRIPTION]["data"])
        serve_whoami(protocol)
        serve_names(protocol)
        DisconnectService(protocol, audit)
        self._link = LinkService(server)
        serve_standard(protocol)
        publish_client_traffic(server)
        protocol.observers.add(self)

    def driven(self, tick: DriveRecord) -> None:
        """Publish what control did in a tick, and report to clients what it rejected."""
        self._link.driven(tick)
        self._services.driven(tick)
        self._steps.driven(tick)
        if self._arm is not None:
            self._arm.driven(tick)
        for rejection in tick.rejections:
            self._report(rejection)
        self._paused = self._paused + 1 if tick.paused else 0
        if not tick.paused:
            self._publish(self._drive_outputs, tick)
        elif self._paused % _PAUSED_EVERY == 0:
            # Nothing new but who has the robot, and why it stands still.
            for output, topic in self._drive_outputs:
                if output.name == "/teleop/state":
                    for message in output.build(tick):
                        self.server.protocol.topics.publish_on(topic, message, self.server.now)
        if self._audit is not None:
            self._audit.driven(tick)

    def estimated(self, tick: EstimateRecord) -> None:
        """Publish what the localiser made of a tick."""
        self._services.estimated(tick)
        self._publish(self._estimate_outputs, tick)
        if self._audit is not None:
            self._audit.estimated(tick)

    def _now(self) -> int:
        return self.server.now

    def _advertised(
        self, outputs: Iterable[Topic[Record]], hidden: Collection[str]
    ) -> list[tuple[Topic[Record], Advertised]]:
        """Advertise topics that are not hidden; return each with what the server knows of it."""
        advertise = self.server.protocol.topics.advertise
        return [
            (
                output,
                advertise(
                    output.name,
                    output.type,
                    latch=output.latch,
                    newest=not output.latch,
                    thin=output.thin,
                ),
            )
            for output in outputs
            if output.name not in hidden
        ]

    def _publish(self, outputs: Iterable[tuple[Topic[Record], Advertised]], tick: Record) -> None:
        """Build and publish what somebody wants of a tick; most topics are wanted by nobody."""
        for output, topic in outputs:
            if (topic.wanted or output.latch) and output.due(tick):
                for message in output.build(tick):
                    captured = self._link.captured(message, tick.stamp)
                    self.server.protocol.topics.publish_on(
                        topic, message, self.server.now, captured=captured
                    )

    def _report(self, rejection: Rejection) -> None:
        """Say why a message was rejected: once as an error, and then as a warning."""
        client = self._clients.get(rejection.client)
        if client is None:
            return
        # Figures in it may change; what the client must do does not.
        sentence = "".join(c for c in rejection.reason if not c.isdigit())
        level = "warning" if self._reported.get(client) == sentence else "error"
        self._reported[client] = sentence
        self.server.protocol.connections.send_status(client, level, rejection.reason)

    def connected(self, connection: Connection, now: int) -> None:
        """Note a client's name, by which the robot knows it."""
        self._clients[connection.name] = connection.id

    def renamed(self, connection: Connection, old: str) -> None:
        """Have the robot release what the client controls under its old name."""
        self._clients[connection.name] = self._clients.pop(old, connection.id)
        self.wishes.post(Disconnected(old))

    def disconnected(self, connection: Connection, now: int) -> None:
        """Have the robot release what the client controls."""
        self._clients.pop(connection.name, None)
        self._reported.pop(connection.id, None)
        self._inputs.forget(connection.id)
        self._services.forget(connection.id)
        self._steps.forget(connection.id)
        if self._arm is not None:
            self._arm.forget(connection.id)
        self._turtle_control.forget(connection.id)
        self.previews.forget(connection.id)
        self.wishes.post(Disconnected(connection.name))
