"""Services of the host and of clients, and calls to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from teleop.rosbridge.errors import OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.framing.operation_fields import Operation, check_name
from teleop.rosbridge.graph.client_completion import ClientCompletion, CompletedAhead
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_types import Message, ServiceType
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.ros_time import SECOND
from teleop.rosbridge.timers import Timers
from teleop.rosbridge.topic_names import HOST, canonical

Handler: TypeAlias = Callable[[int, Message, int], Message | DeferredResponse]
"""Takes client id, request and time [ns]; returns the response or raises ServiceError."""

SendJson: TypeAlias = Callable[[int, str], None]
"""Sends the JSON text of an operation to a client."""


@dataclass(frozen=True, slots=True)
class Service:
    """A service of the host or of a client."""

    name: str
    kind: ServiceType
    handler: Handler
    provider: int = HOST
    """Id of the client that provides it."""

    timeout: float | None = None
    """Time for the response unless the caller sets one [s]; None for unlimited."""


@dataclass(slots=True)
class _Provider:
    """A client that provides a service, and the pending calls to it."""

    client: int
    name: str
    """Name of the service as the client spells it."""

    kind: ServiceType
    calls: dict[str, DeferredResponse] = field(default_factory=dict)
    number: int = 0
    """Number of the last call, which is part of its id."""


class Services:
    """All services by name; if several clients provide one, the latest provider is called."""

    def __init__(
        self,
        registry: TypeRegistry,
        codec: Codec,
        limits: ClientLimits,
        timers: Timers,
        send: SendJson,
        completion: ClientCompletion,
    ) -> None:
        self._registry = registry
        self._codec = codec
        self._limits = limits
        self._timers = timers
        self._send = send
        self._completion = completion
        self._services: dict[str, list[Service]] = {}
        self._providers: dict[int, dict[str, _Provider]] = {}
        """Clients' services, by client and canonical name."""

        self._calls: dict[tuple[int, str], _Provider] = {}
        """Who answers each pending call, by client and id of the call."""

        self._pending: dict[int, set[DeferredResponse]] = {}
        """Pending calls by caller."""

        self._numbers: dict[tuple[int, str], int] = {}
        """Last call number of withdrawn services that had pending calls."""

    @property
    def all(self) -> list[Service]:
        """All services, each with its current provider."""
        return [stack[-1] for stack in self._services.values()]

    def find(self, name: str) -> Service | None:
        """Return the service of a name; None if there is none."""
        stack = self._services.get(canonical(name))
        return stack[-1] if stack else None

    # Providers

    def serve(self, name: str, type: str, handler: Handler) -> None:
        """Provide a service of the host, which no client can replace.

        Args:
            name: Name of the service.
            type: Service type.
            handler: Returns the response, or a DeferredResponse, or raises ServiceError.
        """
        key = canonical(check_name(name, "service"))
        self._services[key] = [Service(key, self._registry.service(type), handler)]

    def advertise(self, client: int, name: str, type: str) -> None:
        """Add a service that a client provides."""
        key, wanted = canonical(name), self._registry.service(type)
        stack = self._services.get(key, [])
        if stack and stack[-1].provider == HOST:
            raise OperationError(f"service {name} is provided by the server only")
        if stack and stack[-1].kind.name != wanted.name:
            raise OperationError(f"service {name} already exists with type {stack[-1].kind.name}")
        own = self._providers.setdefault(client, {})
        if key in own:
            own[key].name = name
            return
        if len(own) >= self._limits.services:
            raise OperationError(f"at most {self._limits.services} services may be provided")
        # Continuing the numbers keeps a late response from completing a call of the same id.
        number = self._numbers.pop((client, key), 0)
        provider = own[key] = _Provider(client, name, wanted, number=number)
        service = Service(
            key, wanted, partial(self._forward, provider, wanted), client, self._limits.call_timeout
        )
        self._services[key] = [*stack, service]

    def unadvertise(self, client: int, name: str) -> None:
        """Remove a service that a client provides; pending calls to it fail."""
        key = canonical(name)
        provider = self._providers.get(client, {}).pop(key, None)
        if provider is None:
            return
        stack = [service for service in self._services[key] if service.provider != client]
        if stack:
            self._services[key] = stack
        else:
            del self._services[key]
        if provider.calls:
            self._numbers[client, key] = provider.number
            own = [other for other in self._numbers if other[0] == client]
            for oldest in own[: -self._limits.services]:
                del self._numbers[oldest]
        for call in list(provider.calls.values()):
            call.fail(f"Service {name}: its provider has left")

    def remove_client(self, client: int) -> None:
        """Remove the services that a client provides and its pending calls."""
        for key in list(self._providers.get(client, ())):
            self.unadvertise(client, key)
        self._providers.pop(client, None)
        for owner, key in list(self._numbers):
            if owner == client:
                del self._numbers[owner, key]
        for call in list(self._pending.pop(client, ())):
            call.fail("the caller has left")

    # Calls

    def call(
        self,
        caller: int,
        service: Service,
        arguments: object,
        timeout: float | None,
        now: int,
    ) -> Message | DeferredResponse:
        """Call a service.

        Args:
            caller: Id of the client.
            service: The service.
            arguments: Fields of the request by name, or a list in their order.
            timeout: Time for the response [s], unlimited if not positive; None for the default.
            now: Current time [ns].

        Raises:
            RosbridgeError: If the call is rejected or fails; its text is for the caller.
        """
        if len(self._pending.get(caller, ())) >= self._limits.calls:
            raise ServiceError(f"at most {self._limits.calls} calls may be pending")
        kind = service.kind.request
        request, _ = self._completion(caller, kind, _by_name(service, arguments), now)
        response = service.handler(caller, request, now)
        if not isinstance(response, DeferredResponse) or response.done:
            return response
        pending = self._pending.setdefault(caller, set())
        pending.add(response)
        response.on_done(lambda _: pending.discard(response))
        wait = service.timeout if timeout is None else timeout
        if wait is not None and wait > 0:
            timer = self._timers.at(
                now + int(wait * SECOND),
                lambda _: response.fail(
                    f"Timeout exceeded while waiting for service response: {wait:g} s"
                ),
            )
            response.on_done(lambda _: timer.cancel())
        return response

    def respond(self, client: int, operation: Operation) -> bool:
        """Process a provider's ``service_response``; return whether its call was pending.

        ``result`` counts only without values: some clients' service functions return false, or
        nothing, on success.
        """
        identity, values = str(operation.get("id")), operation.get("values")
        provider = self._calls.get((client, identity))
        if provider is None:
            return False
        call = provider.calls[identity]
        if values is None and operation.get("result") is True:
            values = {}
        if not isinstance(values, dict | CompletedAhead):
            reason = values if isinstance(values, str) and values else "its provider gave no reason"
            call.fail(f"Service {provider.name} failed: {reason}"[:1000])
            return True
        try:
            call.complete(self._completion(client, provider.kind.response, values)[0])
        except RosbridgeError as error:
            call.fail(f"Service {provider.name} returned an invalid response: {error}")
            raise
        return True

    def _forward(
        self, provider: _Provider, kind: ServiceType, caller: int, request: Message, now: int
    ) -> DeferredResponse:
        """Forward a call to the client that provides the service."""
        provider.number += 1
        identity = f"service_request:{provider.name}:{provider.number}"
        call = provider.calls[identity] = DeferredResponse()
        self._calls[provider.client, identity] = provider
        call.on_done(lambda _: self._forget(provider, identity))
        self._send(
            provider.client,
            f'{{"op":"call_service","id":{write_json(identity)},'
            f'"service":{write_json(provider.name)},'
            f'"args":{self._codec.json(kind.request, request)}}}',
        )
        return call

    def _forget(self, provider: _Provider, identity: str) -> None:
        provider.calls.pop(identity, None)
        self._calls.pop((provider.client, identity), None)


def _by_name(service: Service, arguments: object) -> object:
    """Return the arguments by name; roslibjs may send them as a list."""
    if arguments is None:
        return {}
    if not isinstance(arguments, list):
        return arguments
    names = [field.name for field in service.kind.request.fields]
    if len(arguments) > len(names):
        raise OperationError(f"{service.name} takes {len(names)} arguments, got {len(arguments)}")
    return dict(zip(names, arguments, strict=False))
