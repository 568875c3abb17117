"""The operations ``call_service``, ``advertise_service``, ``service_response`` and their inverses."""

from __future__ import annotations

import logging
from functools import partial
from typing import Final

from teleop.rosbridge.errors import OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.framing.operation_fields import Operation, fragment_size, name, seconds, text
from teleop.rosbridge.framing.outgoing_frames import ReplyFormat
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.graph.services import Service, Services
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_types import Message
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.connections import Connections
from teleop.rosbridge.protocol.dispatcher import OperationHandler
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.protocol.refusals import Refusal

_LOG: Final = logging.getLogger(__name__)


class ServiceOperations:
    """Handlers of the service operations."""

    def __init__(
        self, services: Services, codec: Codec, connections: Connections, observer: Observer
    ) -> None:
        self._services = services
        self._codec = codec
        self._connections = connections
        self._observer = observer

    @property
    def operations(self) -> dict[str, OperationHandler]:
        """Handlers by operation."""
        return {
            "call_service": self._call,
            "advertise_service": self._advertise,
            "unadvertise_service": self._unadvertise,
            "service_response": self._respond,
        }

    def _call(self, client: Connection, operation: Operation, now: int) -> None:
        called = operation.get("service")
        if not isinstance(called, str):
            raise OperationError("service must be given as a string")
        # In rosbridge 1, the id of a call follows the name of the service.
        path, _, key = called.partition("#")
        if key and operation.get("id") is None:
            operation = {**operation, "id": key}
        service = self._services.find(path)
        reply = partial(self._reply, client.id, operation, service)
        if refusal := client.refusal("call", path):
            self._observer.refused(client, Refusal.of(operation, refusal))
            reply(ServiceError(refusal))
            return
        if service is None:
            reply(ServiceError(f"Service {path} does not exist"))
            return
        try:
            timeout = seconds(operation, "timeout")
            arguments = operation.get("args")
            response = self._services.call(client.id, service, arguments, timeout, now)
        except RosbridgeError as error:
            if not isinstance(error, ServiceError):  # which is the response of the service itself
                self._observer.refused(client, Refusal.of(operation, str(error)))
            reply(ServiceError(str(error)))
        except Exception:
            _LOG.exception("service %s failed", path)
            reply(ServiceError(f"Service {path} failed: internal error"))
        else:
            if isinstance(response, DeferredResponse):
                response.on_done(reply)
            else:
                reply(response)

    def _reply(
        self,
        client: int,
        call: Operation,
        service: Service | None,
        result: Message | ServiceError,
    ) -> None:
        success = "false"
        if service is None or isinstance(result, ServiceError):
            values = write_json(str(result))
        else:
            try:
                values, success = self._codec.json(service.kind.response, result), "true"
            except RosbridgeError as error:
                _LOG.exception("service %s returned an invalid response", service.name)
                values = write_json(str(error))
        # A response has an id only if its call has one.
        end = f',"id":{write_json(call["id"])}' if call.get("id") is not None else ""
        text = (
            f'{{"op":"service_response","service":{write_json(call["service"])},'
            f'"values":{values},"result":{success}{end}}}'
        )
        # A call of 70 bytes can ask for megabytes, so its answer counts for the caller's rate.
        self._connections.charge(client, size=len(text))
        self._connections.send_json(client, text, reply_format(call))

    def _advertise(self, client: Connection, operation: Operation, now: int) -> None:
        service, type = name(operation, "service"), text(operation, "type")
        client.require("provide", service)
        self._services.advertise(client.id, service, type)

    def _unadvertise(self, client: Connection, operation: Operation, now: int) -> None:
        self._services.unadvertise(client.id, name(operation, "service"))

    def _respond(self, client: Connection, operation: Operation, now: int) -> None:
        if not self._services.respond(client.id, operation):
            warn_late(self._connections, client, operation)


def reply_format(operation: Operation) -> ReplyFormat:
    """Return how the client wants the response to an operation to be encoded."""
    return ReplyFormat(operation.get("compression") == "png", fragment_size(operation))


def warn_late(connections: Connections, client: Connection, operation: Operation) -> None:
    """Report a response whose call or goal timed out, or whose caller has left."""
    text = f"{operation['op']}: no pending request with id {str(operation.get('id'))[:80]}"
    connections.send_status(client.id, "warning", text, operation.get("id"))
