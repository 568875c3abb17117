"""Services that a client provides to others."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final, TypeAlias

from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.messages.json_cbor_codec import write_json
from teleop.rosbridge.messages.message_types import Message

_LOG: Final = logging.getLogger(__name__)

Provider: TypeAlias = Callable[[Message], Message]
"""Takes the request of a service and returns its response, or raises ServiceError."""


class ServiceProviders:
    """The provided services by name."""

    def __init__(self) -> None:
        self._provided: dict[str, tuple[Message, Provider]] = {}

    def __contains__(self, service: object) -> bool:
        return service in self._provided

    @property
    def operations(self) -> list[Message]:
        """The ``advertise_service`` operations of all provided services."""
        return [operation for operation, _ in self._provided.values()]

    def add(self, operation: Message, provider: Provider) -> None:
        """Add the provider of an ``advertise_service`` operation."""
        self._provided[operation["service"]] = operation, provider

    def remove(self, service: str) -> bool:
        """Remove a service; return whether it was provided."""
        return self._provided.pop(service, None) is not None

    def respond(self, service: str, call: Message) -> Message:
        """Return the response to another client's call."""
        response: Message = {"op": "service_response", "service": service, "id": call["id"]}
        _, provider = self._provided[service]
        try:
            values: Any = provider(call.get("args") or {})
            write_json(values)  # raises if JSON cannot represent them
        except ServiceError as error:
            return {**response, "result": False, "values": str(error)}
        except Exception:
            _LOG.exception("the provider of %s failed", service)
            return {**response, "result": False, "values": "internal error"}
        return {**response, "result": True, "values": values}
