"""The operations of ROS 2 actions: goals, cancellation, feedback and results."""

from __future__ import annotations

from teleop.rosbridge.framing.operation_fields import Operation, name, text
from teleop.rosbridge.graph.actions import Actions
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.connections import Connections
from teleop.rosbridge.protocol.dispatcher import OperationHandler
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.protocol.service_operations import reply_format, warn_late


class ActionOperations:
    """Handlers of the action operations."""

    def __init__(self, actions: Actions, connections: Connections, observer: Observer) -> None:
        self._actions = actions
        self._connections = connections
        self._observer = observer

    @property
    def operations(self) -> dict[str, OperationHandler]:
        """Handlers by operation."""
        return {
            "advertise_action": self._advertise,
            "unadvertise_action": self._unadvertise,
            "send_action_goal": self._send_goal,
            "cancel_action_goal": self._cancel_goal,
            "action_feedback": self._feedback,
            "action_result": self._result,
        }

    def _advertise(self, client: Connection, operation: Operation, now: int) -> None:
        action, type = name(operation, "action"), text(operation, "type")
        client.require("provide", action)
        self._actions.advertise(client.id, action, type)

    def _unadvertise(self, client: Connection, operation: Operation, now: int) -> None:
        self._actions.unadvertise(client.id, name(operation, "action"))

    def _send_goal(self, client: Connection, operation: Operation, now: int) -> None:
        action = operation.get("action")
        refusal = client.refusal("call", action) if isinstance(action, str) else None
        if refusal is not None:
            self._observer.refused(client, Refusal.of(operation, refusal))
        self._actions.send(client.id, operation, reply_format(operation), now, refusal)

    def _cancel_goal(self, client: Connection, operation: Operation, now: int) -> None:
        self._actions.cancel(client.id, operation.get("id"))

    def _feedback(self, client: Connection, operation: Operation, now: int) -> None:
        if not self._actions.feedback(client.id, operation):
            warn_late(self._connections, client, operation)

    def _result(self, client: Connection, operation: Operation, now: int) -> None:
        if not self._actions.result(client.id, operation):
            warn_late(self._connections, client, operation)
