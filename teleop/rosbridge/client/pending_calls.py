"""Services on a client's side: the calls it waits for, and those that it answers for others."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any, Final, TypeAlias

from teleop.rosbridge.errors import ServiceCallError, ServiceError
from teleop.rosbridge.messages.json_cbor_codec import write_json
from teleop.rosbridge.messages.message_types import Message

_LOG: Final = logging.getLogger(__name__)

Provider: TypeAlias = Callable[[Message], Message]
"""Takes a service's request, returns its response; ServiceError is the caller's answer."""


class PendingCalls:
    """Calls that wait for their answers, by id."""

    def __init__(self) -> None:
        self._waiting: dict[str, tuple[str, asyncio.Future[Message]]] = {}

    def begin(self, identity: str, service: str) -> asyncio.Future[Message]:
        """Return what will be the answer to a call."""
        future: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._waiting[identity] = service, future
        return future

    def end(self, identity: str) -> None:
        """Wait no longer."""
        self._waiting.pop(identity, None)

    def settle(self, identity: str, answer: Message) -> None:
        """Take in an answer; one that nobody waits for is let go."""
        _, future = self._waiting.get(identity, ("", None))
        if future is not None and not future.done():
            future.set_result(answer)

    def lose(self, reason: str) -> None:
        """Fail all: the connection is lost."""
        for service, future in self._waiting.values():
            if not future.done():
                future.set_exception(ServiceCallError(f"{service}: connection lost ({reason})"))


class ServiceProviders:
    """Services that a client provides for others."""

    def __init__(self) -> None:
        self._provided: dict[str, tuple[Message, Provider]] = {}

    def __contains__(self, service: object) -> bool:
        return service in self._provided

    @property
    def operations(self) -> list[Message]:
        """What says to a server what is provided."""
        return [operation for operation, _ in self._provided.values()]

    def add(self, operation: Message, provider: Provider) -> None:
        """Have ``provider`` answer the calls that an ``advertise_service`` invites."""
        self._provided[operation["service"]] = operation, provider

    def remove(self, service: str) -> bool:
        """Provide a service no more; return whether it was provided."""
        return self._provided.pop(service, None) is not None

    def answer(self, service: str, call: Message) -> Message:
        """Return the answer to another client's call."""
        answer: Message = {"op": "service_response", "service": service, "id": call["id"]}
        _, provider = self._provided[service]
        try:
            values: Any = provider(call.get("args") or {})
            write_json(values)  # which finds what JSON does not have
        except ServiceError as error:
            return {**answer, "result": False, "values": str(error)}
        except Exception:
            _LOG.exception("the provider of %s failed", service)
            return {**answer, "result": False, "values": "internal error"}
        return {**answer, "result": True, "values": values}
