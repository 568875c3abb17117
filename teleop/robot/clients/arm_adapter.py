"""The arm behind a rosbridge server: its topics, actions and services; a robot without an arm loads nothing of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from teleop.link.command_age import RoundTrips
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.arm_actions import ArmActions
from teleop.robot.clients.arm_inputs import ArmInputs
from teleop.robot.clients.arm_requests import ArmRequests
from teleop.robot.clients.arm_services import ArmServices
from teleop.robot.clients.mirror_topic import MirrorTopic
from teleop.robot.clients.wishes import Wishes
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics.arm_messages import ArmLinks
from teleop.robot.topics.arm_topics import ARM_OUTPUTS
from teleop.robot.topics.table_rows import Topic
from teleop.rosbridge.server.server import Server


class ArmAdapter:
    """Joins what a server's clients want of the arm and what it does."""

    def __init__(
        self,
        server: Server,
        wishes: Wishes,
        arm: ArmFit,
        *,
        round_trips: Callable[[int], RoundTrips | None],
        audit: AuditLog | None,
    ) -> None:
        """Offer inputs, actions and services of the arm.

        Args:
            server: The server, not yet started.
            wishes: Takes what clients want.
            arm: The arm.
            round_trips: Returns the round trips of a client; None where no time passes on the way.
            audit: Log of what clients do to the robot.
        """
        protocol, table = server.protocol, arm.table
        self._links, self._mirror = ArmLinks(table), MirrorTopic(server, table)
        self._requests = ArmRequests(
            protocol.connections, wishes, round_trips=round_trips, now=lambda: server.now
        )
        self._inputs = ArmInputs(protocol, wishes, self._requests, table, round_trips=round_trips)

        def log(client: int, action: str) -> None:
            if audit is not None:
                audit.action(protocol.connections.name(client), action)

        ArmActions(protocol, self._requests, table, log)
        mount = arm.base_from_arm_base
        self._services = ArmServices(protocol, self._requests, self._inputs, table, mount)

    def drive_outputs(self, rows: Sequence[Topic[DriveRecord]]) -> tuple[Topic[DriveRecord], ...]:
        """Return the topics of control, with the arm's."""
        mirror = self._mirror.messages
        own = (replace(r, build=mirror) if r.name == "/arm/mirror" else r for r in ARM_OUTPUTS)
        return (*rows, *own)

    def estimate_outputs(
        self, rows: Sequence[Topic[EstimateRecord]]
    ) -> tuple[Topic[EstimateRecord], ...]:
        """Return the topics of the estimator; the arm's links are on ``/tf`` as well."""
        return tuple(replace(r, build=self._links.tf) if r.name == "/tf" else r for r in rows)

    def driven(self, tick: DriveRecord) -> None:
        """Hand on what the arm did in a tick."""
        self._links.driven(tick)
        self._mirror.driven(tick)
        self._services.driven(tick)
        self._requests.driven(tick)

    def forget(self, client: int) -> None:
        """Note that a client has left."""
        self._inputs.forget(client)
        self._requests.forget(client)
