"""Services: of the host and of clients, and calls whose answers come later."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final, TypeAlias

from teleop.rosbridge.errors import OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_types import Message, ServiceType
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.timers import Timers
from teleop.rosbridge.topic_names import HOST, canonical

_SECOND: Final = 1_000_000_000


class DeferredResponse:
    """An answer that a handler owes: return one, and settle it when there is something to say.

    The answer leaves in the moment it is settled, behind everything published before.
    """

    def __init__(self) -> None:
        self._done: list[Callable[[Message | ServiceError], object]] = []
        self._result: Message | ServiceError | None = None

    @property
    def settled(self) -> bool:
        """Whether there is an answer."""
        return self._result is not None

    def answer(self, response: Message) -> None:
        """Answer with a response; all but the first answer are ignored."""
        self._settle(response)

    def refuse(self, text: str) -> None:
        """Answer ``result: false`` with a text."""
        self._settle(ServiceError(text))

    def when_settled(self, done: Callable[[Message | ServiceError], object]) -> None:
        """Have ``done`` called with the result; at once if there is one."""
        if self._result is not None:
            done(self._result)
        else:
            self._done.append(done)

    def _settle(self, result: Message | ServiceError) -> None:
        if self._result is None:
            self._result = result
            for done in self._done:
                done(result)


Handler: TypeAlias = Callable[[int, Message, int], Message | DeferredResponse]
"""Takes a client's id, the request and the time [ns]; returns the response, raises ServiceError."""

Say: TypeAlias = Callable[[int, str], None]
"""Sends an operation's JSON text to a client."""


@dataclass(frozen=True, slots=True)
class Service:
    """A service, whoever provides it."""

    name: str
    kind: ServiceType
    handler: Handler
    provider: int = HOST
    """The client that provides it."""

    timeout: float | None = None
    """Time for an answer if the caller names none [s]; None for no bound."""


@dataclass(slots=True)
class _Provider:
    """A client that provides a service, and the calls that wait for it."""

    client: int
    name: str
    """As the client wrote it."""

    calls: dict[str, DeferredResponse] = field(default_factory=dict)
    number: int = 0


class Services:
    """All services by name; of several clients that provide one, the last to come answers."""

    def __init__(
        self, registry: TypeRegistry, codec: Codec, limits: ClientLimits, timers: Timers, say: Say
    ) -> None:
        self._registry = registry
        self._codec = codec
        self._limits = limits
        self._timers = timers
        self._say = say
        self._services: dict[str, list[Service]] = {}
        self._providers: dict[tuple[int, str], _Provider] = {}
        self._waiting: dict[int, set[DeferredResponse]] = {}
        self._numbers: dict[tuple[int, str], int] = {}
        """Of calls, where the last provision of a service left some unanswered."""

    @property
    def all(self) -> list[Service]:
        """Those that would answer now."""
        return [stack[-1] for stack in self._services.values()]

    def find(self, name: str) -> Service | None:
        """Return the service of a name, if anybody provides it."""
        stack = self._services.get(canonical(name))
        return stack[-1] if stack else None

    # Who provides

    def serve(self, name: str, kind: str, handler: Handler) -> None:
        """Offer a service of the host; no client can take its place."""
        key = canonical(name)
        self._services[key] = [Service(key, self._registry.service(kind), handler)]

    def advertise(self, client: int, name: str, kind: str) -> None:
        """Note that a client provides a service."""
        key, wanted = canonical(name), self._registry.service(kind)
        stack = self._services.get(key, [])
        if stack and stack[-1].provider == HOST:
            raise OperationError(f"service {name} is provided by the server only")
        if stack and stack[-1].kind.name != wanted.name:
            raise OperationError(f"service {name} is already there with type {stack[-1].kind.name}")
        if (client, key) in self._providers:
            self._providers[client, key].name = name
            return
        if sum(owner == client for owner, _ in self._providers) >= self._limits.services:
            raise OperationError(f"at most {self._limits.services} services can be provided")
        number = self._numbers.pop((client, key), 0)  # so that no late answer meets a new call
        provider = self._providers[client, key] = _Provider(client, name, number=number)
        service = Service(
            key, wanted, partial(self._forward, provider, wanted), client, self._limits.call_timeout
        )
        self._services[key] = [*stack, service]

    def unadvertise(self, client: int, name: str) -> None:
        """Note that a client provides a service no more; calls that wait for it fail."""
        key = canonical(name)
        provider = self._providers.pop((client, key), None)
        if provider is None:
            return
        stack = [service for service in self._services[key] if service.provider != client]
        if stack:
            self._services[key] = stack
        else:
            del self._services[key]
        if provider.calls:
            self._numbers[client, key] = provider.number
            mine = [other for other in self._numbers if other[0] == client]
            for oldest in mine[: -self._limits.services]:
                del self._numbers[oldest]
        for later in list(provider.calls.values()):
            later.refuse(f"Service {name}: its provider has left")

    def leave(self, client: int) -> None:
        """Forget a client: what it provides, and what it waits for."""
        for owner, key in list(self._providers):
            if owner == client:
                self.unadvertise(client, key)
        for owner, key in list(self._numbers):
            if owner == client:
                del self._numbers[owner, key]
        for later in list(self._waiting.pop(client, ())):
            later.refuse("the caller has left")

    # PendingCalls

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
            caller: The client.
            service: What it calls.
            arguments: The request by names, or in order.
            timeout: Time for an answer [s], none if not positive; the service's own if None.
            now: The time [ns].

        Raises:
            RosbridgeError: If there is no good answer; its text is for the caller.
        """
        if len(self._waiting.get(caller, ())) >= self._limits.calls:
            raise ServiceError(f"at most {self._limits.calls} calls can wait for their answers")
        request = complete(
            self._registry, service.kind.request, _by_name(service, arguments), now=now
        )
        answer = service.handler(caller, request, now)
        if not isinstance(answer, DeferredResponse) or answer.settled:
            return answer
        waiting = self._waiting.setdefault(caller, set())
        waiting.add(answer)
        answer.when_settled(lambda _: waiting.discard(answer))
        wait = service.timeout if timeout is None else timeout
        if wait is not None and wait > 0:
            timer = self._timers.at(
                now + int(wait * _SECOND),
                lambda _: answer.refuse(
                    f"Timeout exceeded while waiting for service response: {wait:g} s"
                ),
            )
            answer.when_settled(lambda _: timer.cancel())
        return answer

    def respond(self, client: int, operation: Operation) -> bool:
        """Take a provider's answer; return whether somebody waited for it.

        A provider's ``result`` counts only if there are no values: there are clients whose service
        functions return false, or nothing, when all is well.
        """
        identity, values = operation.get("id"), operation.get("values")
        for (owner, key), provider in self._providers.items():
            later = provider.calls.get(str(identity)) if owner == client else None
            if later is None:
                continue
            kind = self._services[key][-1].kind
            if values is None and operation.get("result") is True:
                values = {}
            if not isinstance(values, dict):
                why = (
                    values if isinstance(values, str) and values else "its provider gave no reason"
                )
                later.refuse(f"Service {provider.name} failed: {why}"[:1000])
                return True
            try:
                later.answer(complete(self._registry, kind.response, values))
            except RosbridgeError as error:
                later.refuse(f"Service {provider.name} gave no good response: {error}")
                raise
            return True
        return False

    def _forward(
        self, provider: _Provider, kind: ServiceType, caller: int, request: Message, now: int
    ) -> DeferredResponse:
        """Pass a call on to the client that provides the service."""
        provider.number += 1
        identity = f"service_request:{provider.name}:{provider.number}"
        later = provider.calls[identity] = DeferredResponse()
        later.when_settled(lambda _: provider.calls.pop(identity, None))
        self._say(
            provider.client,
            f'{{"op":"call_service","id":{write_json(identity)},'
            f'"service":{write_json(provider.name)},'
            f'"args":{self._codec.json(kind.request, request)}}}',
        )
        return later


def _by_name(service: Service, arguments: object) -> object:
    """Return the arguments by name; roslibjs may send them in order."""
    if arguments is None:
        return {}
    if not isinstance(arguments, list):
        return arguments
    names = [field.name for field in service.kind.request.fields]
    if len(arguments) > len(names):
        raise OperationError(f"{service.name} takes {len(names)} arguments, got {len(arguments)}")
    return dict(zip(names, arguments, strict=False))
