"""The rosbridge v2 protocol, without sockets: frames and times in, frames for clients out.

A server feeds it what arrives and sends what it puts out; a test does the same without a server.
Whatever a client sends, the answer is an answer or a ``status``: never silence, never an exception.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

from teleop.rosbridge.broker import Broker
from teleop.rosbridge.codec import Codec, Stamps, write_json
from teleop.rosbridge.errors import FrameError, OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.frames import operations
from teleop.rosbridge.limits import Allowance, Limits
from teleop.rosbridge.messages import complete
from teleop.rosbridge.outgoing import Close, Kind, Outgoing, Output, Sink
from teleop.rosbridge.services import Handler, Later, Service
from teleop.rosbridge.topics import Listener, Request, Topic, canonical
from teleop.rosbridge.types import Message, Registry

_LOG: Final = logging.getLogger(__name__)

_LEVELS: Final = {"none": 0, "error": 1, "warning": 2, "info": 3}

_NAME: Final = re.compile(r"[A-Za-z0-9_/~.\-]{1,256}")
"""Names of topics and services: ROS's, and the few more characters that others let pass."""

_LONGEST_ID: Final = 256

_POLICY, _TOO_BIG = 1008, 1009
"""Codes of close frames (RFC 6455, section 7.4.1)."""

Operation = dict[str, Any]


@dataclass(slots=True)
class _Client:
    id: int
    name: str
    messages: Allowance
    bytes: Allowance
    level: int = _LEVELS["error"]
    lossless: bool = False
    refused: int = 0
    """Operations over the limit since the last one within it."""

    closing: bool = False


class Protocol:
    """Clients, topics and services; ``now`` is always the time in [ns], of one and the same clock."""

    def __init__(
        self,
        registry: Registry,
        *,
        limits: Limits | None = None,
        stamps: Stamps = "both",
        sink: Sink | None = None,
    ) -> None:
        """Create a protocol without clients.

        Args:
            registry: The types that messages may have.
            limits: Bounds on each client.
            stamps: How the parts of a stamp are called in messages that leave.
            sink: Is handed what goes out, at once; without one, ``drain`` returns it.
        """
        self.registry = registry
        self.limits = limits or Limits()
        self.sink = sink
        self._codec = Codec(registry, stamps=stamps)
        self._broker = Broker(registry, self._codec, self.limits, self._emit)
        self._services: dict[str, Service] = {}
        self._clients: dict[int, _Client] = {}
        self._next = 1
        self._outbox: list[tuple[int, Output]] = []
        self._operations: Final[dict[str, Callable[[_Client, Operation, int], None]]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "set_level": self._set_level,
            "status": self._status,
        }

    # What the transport tells

    def connect(self, now: int, name: str = "") -> int:
        """Return the id of a new client; ``name`` is for people (an address)."""
        client, self._next = self._next, self._next + 1
        limits = self.limits
        self._clients[client] = _Client(
            client,
            name or f"client {client}",
            Allowance(limits.messages, limits.burst, now),
            Allowance(limits.bytes, limits.burst, now),
        )
        return client

    def rename(self, client: int, name: str) -> None:
        """Give a client another name."""
        self._clients[client].name = name

    def disconnect(self, client: int, now: int) -> None:
        """Forget a client and all it asked for."""
        if self._clients.pop(client, None) is not None:
            self._broker.leave(client)

    def receive(self, client: int, frame: str | bytes, now: int) -> None:
        """Do what a frame says; binary frames hold JSON too."""
        state = self._clients.get(client)
        if state is None or state.closing:
            return
        if len(frame) > self.limits.frame:
            self._close(state, _TOO_BIG, f"a frame has at most {self.limits.frame} bytes")
            return
        if not state.bytes.take(len(frame), now):
            self._refuse(state, f"more than {self.limits.bytes:g} bytes a second")
            return
        try:
            for operation in operations(frame):
                if not self._admit(state, now):
                    return
                self._operate(state, operation, now)
        except FrameError as error:
            if self._admit(state, now):
                self._tell(state, "error", str(error))

    def tick(self, now: int) -> None:
        """Send what was held back by a ``throttle_rate`` and is due."""
        self._broker.tick(now)

    @property
    def due(self) -> int | None:
        """When ``tick`` has something to do next [ns]; None while it has not."""
        return self._broker.due

    def drain(self) -> list[tuple[int, Output]]:
        """Return what has gone out since the last call, in order, by client."""
        out, self._outbox = self._outbox, []
        return out

    # What the host does

    @property
    def clients(self) -> dict[int, str]:
        """Names of the connected clients, by id."""
        return {client.id: client.name for client in self._clients.values()}

    @property
    def topics(self) -> list[Topic]:
        """Topics that anybody has to do with."""
        return self._broker.topics

    @property
    def services(self) -> list[Service]:
        """Services of the host."""
        return list(self._services.values())

    def advertise(self, topic: str, type: str, *, latch: bool = False) -> None:
        """Make a topic the host's, which no client may publish; ``latch`` keeps the last message."""
        self._broker.own(_named(topic, "topic"), type, latch)

    def publish(self, topic: str, message: Message | Callable[[], Message], now: int) -> None:
        """Publish on a topic of the host's; a callable is called only if somebody subscribes.

        Raises:
            MessageError: If the message does not fit its type, or holds NaN and goes out as JSON.
        """
        self._broker.publish(topic, message, now)

    def wanted(self, topic: str) -> bool:
        """Return whether anybody subscribes to a topic."""
        found = self._broker.find(topic)
        return found is not None and bool(found.subscriptions)

    def listen(self, topic: str, type: str, listener: Listener) -> None:
        """Have ``listener`` called with what clients publish, completed and checked.

        If it raises a RosbridgeError, the client is told and nobody else gets the message.
        """
        self._broker.listen(_named(topic, "topic"), type, listener)

    def serve(self, service: str, type: str, handler: Handler) -> None:
        """Offer a service. The handler returns the response, or Later, or raises ServiceError."""
        kind = self.registry.service(type)
        name = canonical(_named(service, "service"))
        self._services[name] = Service(name, kind, handler)

    def lossless(self, client: int, on: bool = True) -> None:
        """Have a client get everything, in the order in which it went out."""
        if client in self._clients:
            self._clients[client].lossless = on

    def status(self, client: int, level: str, text: str) -> None:
        """Tell a client something, if it wants to hear things of this level."""
        if client in self._clients:
            self._tell(self._clients[client], level, text)

    def close(self, client: int, code: int, reason: str) -> None:
        """Have a client disconnected."""
        if client in self._clients:
            self._close(self._clients[client], code, reason)

    # Operations

    def _operate(self, client: _Client, operation: Operation, now: int) -> None:
        op = operation.get("op")
        identity = operation.get("id")
        if type(identity) not in (str, int) or len(str(identity)) > _LONGEST_ID:
            identity = None
        act = self._operations.get(op) if isinstance(op, str) else None
        try:
            if act is None:
                raise OperationError(_unknown(op, self._operations))
            if operation.get("id") is not identity:
                raise OperationError("an id is a short string or a whole number")
            act(client, operation, now)
        except RosbridgeError as error:
            text = str(error) if act is None else f"{op}: {error}"
            self._tell(client, "error", text, identity)
        except Exception:
            # A mistake of the host's must not become the client's, nor end the connection.
            _LOG.exception("%s of %s failed", op, client.name)
            self._tell(client, "error", f"{op}: internal error", identity)

    def _advertise(self, client: _Client, operation: Operation, now: int) -> None:
        topic, kind = _name(operation, "topic"), _text(operation, "type")
        latch = operation.get("latch") is True
        self._broker.advertise(client.id, topic, kind, operation.get("id"), latch)

    def _unadvertise(self, client: _Client, operation: Operation, now: int) -> None:
        self._broker.unadvertise(client.id, _name(operation, "topic"), operation.get("id"))

    def _publish(self, client: _Client, operation: Operation, now: int) -> None:
        message, latch = operation.get("msg", {}), operation.get("latch") is True
        self._broker.relay(client.id, _name(operation, "topic"), message, latch, now)

    def _subscribe(self, client: _Client, operation: Operation, now: int) -> None:
        topic = _name(operation, "topic")
        kind = None if operation.get("type") is None else _text(operation, "type")
        request = Request(
            _count(operation, "throttle_rate"),
            _count(operation, "queue_length"),
            "cbor" if operation.get("compression") == "cbor" else "none",
        )
        self._broker.subscribe(client.id, topic, kind, operation.get("id"), request, now)

    def _unsubscribe(self, client: _Client, operation: Operation, now: int) -> None:
        self._broker.unsubscribe(client.id, _name(operation, "topic"), operation.get("id"))

    def _call_service(self, client: _Client, operation: Operation, now: int) -> None:
        name = operation.get("service")
        if not isinstance(name, str):
            raise OperationError("it needs a service, which is a string")
        service = self._services.get(canonical(name))
        reply = partial(self._reply, client.id, operation, service)
        if service is None:
            reply(ServiceError(f"Service {name} does not exist"))
            return
        try:
            arguments = _arguments(service, operation)
            request = complete(self.registry, service.kind.request, arguments, now=now)
            answer = service.handler(client.id, request, now)
        except RosbridgeError as error:
            reply(ServiceError(str(error)))
        except Exception:
            _LOG.exception("service %s failed", name)
            reply(ServiceError(f"Service {name} failed: internal error"))
        else:
            if isinstance(answer, Later):
                answer.when_settled(reply)
            else:
                reply(answer)

    def _reply(
        self,
        client: int,
        call: Operation,
        service: Service | None,
        result: Message | ServiceError,
    ) -> None:
        good = "false"
        if service is None or isinstance(result, ServiceError):
            values = write_json(str(result))
        else:
            try:
                values, good = self._codec.json(service.kind.response, result), "true"
            except RosbridgeError as error:
                _LOG.exception("service %s gave no good response", service.name)
                values = write_json(str(error))
        # An answer has an id only if the call had one.
        end = f',"id":{write_json(call["id"])}' if call.get("id") is not None else ""
        self._say(
            client,
            f'{{"op":"service_response","service":{write_json(call["service"])},'
            f'"values":{values},"result":{good}{end}}}',
        )

    def _set_level(self, client: _Client, operation: Operation, now: int) -> None:
        level = operation.get("level")
        if not isinstance(level, str) or level not in _LEVELS:
            raise OperationError(f"a level is one of {', '.join(_LEVELS)}")
        client.level = _LEVELS[level]

    def _status(self, client: _Client, operation: Operation, now: int) -> None:
        """Hear what a client has to say, and say nothing: statuses must not answer each other."""

    # What goes out

    def _tell(self, client: _Client, level: str, text: str, identity: object = None) -> None:
        if _LEVELS[level] <= client.level:
            status: Operation = {"op": "status", "level": level, "msg": text}
            if identity is not None:
                status["id"] = identity
            self._say(client.id, write_json(status))

    def _say(self, client: int, text: str) -> None:
        self._emit(client, Outgoing(Kind.CONTROL, text.encode("ascii")))

    def _emit(self, client: int, output: Output) -> None:
        state = self._clients.get(client)
        if state is None:  # it left while its answer was on the way
            return
        if state.lossless and isinstance(output, Outgoing):
            output = replace(output, lossless=True)
        if self.sink is not None:
            self.sink(client, output)
        else:
            self._outbox.append((client, output))

    def _admit(self, client: _Client, now: int) -> bool:
        if client.messages.take(1, now):
            client.refused = 0
            return True
        self._refuse(client, f"more than {self.limits.messages:g} operations a second")
        return False

    def _refuse(self, client: _Client, text: str) -> None:
        client.refused += 1
        if client.refused == 1:  # one is enough: the client is flooded or floods already
            self._tell(client, "error", f"{text}: not heard")
        elif client.refused > self.limits.messages * self.limits.burst:
            self._close(client, _POLICY, text)

    def _close(self, client: _Client, code: int, reason: str) -> None:
        if not client.closing:
            client.closing = True
            self._emit(client.id, Close(code, reason))


def _unknown(op: object, allowed: dict[str, Any]) -> str:
    names = ", ".join(sorted(allowed))
    if op is None:
        return f"Received a message without an op; it is one of {names}"
    return f"Unknown operation: {str(op)[:80]}. Allowed operations: {names}"


def _named(name: str, what: str) -> str:
    if not _NAME.fullmatch(name) or not name.strip("/"):
        raise OperationError(f"{name[:80]!r} is no name of a {what}")
    return name


def _text(operation: Operation, key: str) -> str:
    value = operation.get(key)
    if not isinstance(value, str):
        raise OperationError(f"it needs a {key}, which is a string")
    return value


def _name(operation: Operation, key: str) -> str:
    return _named(_text(operation, key), key)


def _count(operation: Operation, key: str) -> int:
    """Return a whole number; some clients write it as a float, or as null."""
    value = operation.get(key)
    if value is None:
        return 0
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise OperationError(f"{key} must be a number")
    return int(min(max(value, 0), 2**31))


def _arguments(service: Service, operation: Operation) -> object:
    """Return the arguments by name; roslibjs may send them in order."""
    arguments = operation.get("args")
    if arguments is None:
        return {}
    if not isinstance(arguments, list):
        return arguments
    names = [field.name for field in service.kind.request.fields]
    if len(arguments) > len(names):
        raise OperationError(f"{service.name} takes {len(names)} arguments, got {len(arguments)}")
    return dict(zip(names, arguments, strict=False))
