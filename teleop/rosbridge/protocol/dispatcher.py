"""Dispatch of operations: reads frames and calls the handler of each operation."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias

from teleop.rosbridge.errors import FrameError, OperationError, RosbridgeError
from teleop.rosbridge.framing.json_frames import count_objects, operations
from teleop.rosbridge.framing.large_frames import LARGE_FRAME, LargeFrameReader, PayloadField
from teleop.rosbridge.framing.operation_fields import Operation, identity
from teleop.rosbridge.graph.actions import Action, Actions
from teleop.rosbridge.graph.services import Service, Services
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.messages.message_types import MessageType
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.connections import Connections
from teleop.rosbridge.protocol.large_frame_rights import LargeFrameRights, RefusedFrame
from teleop.rosbridge.protocol.large_frame_work import PreparedFrame
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal

_LOG: Final = logging.getLogger(__name__)

OperationHandler: TypeAlias = Callable[[Connection, Operation, int], None]
"""Processes an operation of a client at a time [ns]."""

_ANSWERED: Final = ("call_service", "send_action_goal")
"""Operations whose handlers ask for the right themselves, since a refusal is a response."""


class Dispatcher:
    """Calls the handlers of operations, by name, and reports their errors to the client."""

    def __init__(
        self,
        connections: Connections,
        observer: Observer,
        large_frames: LargeFrameReader,
        rights: LargeFrameRights,
    ) -> None:
        self._connections = connections
        self._observer = observer
        self._large_frames = large_frames
        self._rights = rights
        self.defer = False
        """Whether reassembled messages are left in ``Connection.deferred``."""

        self._handlers: dict[str, OperationHandler] = {}

    def add(self, handlers: Mapping[str, OperationHandler]) -> None:
        """Add handlers of operations."""
        self._handlers.update(handlers)

    def dispatch(self, client: Connection, frame: str | bytes | PreparedFrame, now: int) -> None:
        """Process the operations in a frame; each counts for the client's rate."""
        self._process(client, frame, now, reassembled=False)

    def reassembled(self, client: Connection, message: str | PreparedFrame, now: int) -> None:
        """Process a reassembled message, whose fragments count for the first operation."""
        if self.defer and isinstance(message, str):
            client.deferred.append(message)
        else:
            self.deferred(client, message, now)

    def deferred(self, client: Connection, message: str | PreparedFrame, now: int) -> None:
        """Process a reassembled message now."""
        self._process(client, message, now, reassembled=True)

    def _process(
        self,
        client: Connection,
        frame: str | bytes | PreparedFrame,
        now: int,
        *,
        reassembled: bool,
    ) -> None:
        refused, counted = self._refused(client, frame), reassembled
        parts = 0 if refused or reassembled else count_objects(_plain(frame))
        try:
            for operation in self._read(frame, refused):
                self._connections.charge(client.id, parts=parts)
                parts = 0  # all of them are charged with the first
                if client.closing or not (counted or self._connections.admit(client, now)):
                    return
                if reassembled and operation.get("op") == "fragment":
                    raise FrameError("a fragmented message must not contain fragments")
                self._handle(client, operation, now, refused)
                counted = False
        except FrameError as error:
            if reassembled or self._connections.admit(client, now):
                self._observer.refused(client, Refusal.of({}, str(error)))
                self._connections.send_status(client.id, "error", str(error))

    def _refused(
        self, client: Connection, frame: str | bytes | PreparedFrame
    ) -> RefusedFrame | None:
        return None if isinstance(frame, PreparedFrame) else self._rights.refused(client, frame)

    def _read(self, frame: str | bytes | PreparedFrame, refused: RefusedFrame | None) -> Any:
        if refused is not None:
            return (refused.operation,)
        if isinstance(frame, PreparedFrame):
            if frame.error is not None:
                raise frame.error
            return (frame.operation,)
        if len(frame) < LARGE_FRAME:
            return operations(frame)
        return (self._large_frames.read(frame),)

    def _handle(
        self, client: Connection, operation: Operation, now: int, refused: RefusedFrame | None
    ) -> None:
        op, key = operation.get("op"), None
        handler = self._handlers.get(op) if isinstance(op, str) else None
        try:
            key = identity(operation)
            if handler is None:
                raise OperationError(self._unknown(op))
            if client.access is None and op != "auth":
                raise OperationError(client.barred or "authentication with a token is required")
            if refused is not None and op not in _ANSWERED:
                raise OperationError(refused.why)
            handler(client, operation, now)
        except RosbridgeError as error:
            text = str(error) if handler is None else f"{op}: {error}"
            self._observer.refused(client, Refusal.of(operation, str(error)))
            self._connections.send_status(client.id, "error", text, key)
        except Exception:
            # A defect of the host must not end the client's connection.
            _LOG.exception("%s of %s failed", op, client.name)
            self._connections.send_status(client.id, "error", f"{op}: internal error", key)

    def _unknown(self, op: object) -> str:
        names = ", ".join(sorted(self._handlers))
        if op is None:
            return f"Received a message without an op; it must be one of {names}"
        return f"Unknown operation: {str(op)[:80]}. Allowed operations: {names}"


def _plain(frame: str | bytes | PreparedFrame) -> str | bytes:
    return frame.frame if isinstance(frame, PreparedFrame) else frame


def large_payloads(topics: Topics, services: Services, actions: Actions) -> dict[str, PayloadField]:
    """Return the operations that may be large, with the types of their payloads."""

    def topic(name: str) -> MessageType | None:
        found = topics.find(name)
        return found.kind if found else None

    def part(
        find: Callable[[str], Service | Action | None], which: str
    ) -> Callable[[str], MessageType | None]:
        return lambda name: getattr(getattr(find(name), "kind", None), which, None)

    def service(name: str) -> Service | None:
        return services.find(name.partition("#")[0])

    return {
        "publish": PayloadField("topic", "msg", topic),
        "call_service": PayloadField("service", "args", part(service, "request")),
        "service_response": PayloadField(
            "service", "values", part(service, "response"), or_text=True
        ),
        "send_action_goal": PayloadField("action", "args", part(actions.find, "goal")),
        "action_feedback": PayloadField("action", "values", part(actions.find, "feedback")),
        "action_result": PayloadField(
            "action", "values", part(actions.find, "result"), or_text=True
        ),
    }
