"""What clients ask for: reads each operation and has it done by who is in charge of it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.permissions import Access, Act
from teleop.rosbridge.errors import FrameError, OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.framing.fragments import TIMEOUT_NS
from teleop.rosbridge.framing.json_frames import operations
from teleop.rosbridge.framing.large_frames import LARGE_FRAME, LargeFrameReader, PayloadField
from teleop.rosbridge.framing.operation_fields import (
    Operation,
    count,
    fragment_size,
    identity,
    name,
    quality,
    seconds,
    text,
)
from teleop.rosbridge.graph.actions import Actions
from teleop.rosbridge.graph.services import DeferredResponse, Service, Services
from teleop.rosbridge.graph.subscription import ENCODINGS, SubscribeOptions
from teleop.rosbridge.graph.topics import Topics
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_types import ActionType, Message, MessageType, ServiceType
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.protocol.connections import (
    LEVELS,
    POLICY_VIOLATION,
    Connection,
    Connections,
    ReplyFormat,
)
from teleop.rosbridge.protocol.refusals import Refusal
from teleop.rosbridge.timers import Timers
from teleop.rosbridge.topic_names import canonical

_LOG: Final = logging.getLogger(__name__)


class Dispatcher:
    """The operations that clients may send, by name."""

    def __init__(
        self,
        connections: Connections,
        broker: Topics,
        services: Services,
        actions: Actions,
        timers: Timers,
        codec: Codec,
        flavour: RosVersion,
        gate: Authenticator | None,
    ) -> None:
        self._connections = connections
        self._broker = broker
        self._services = services
        self._actions = actions
        self._timers = timers
        self._codec = codec
        self._flavour: RosVersion = flavour
        self._gate = gate
        self._shapes = LargeFrameReader(broker.registry, _places(broker, services, actions))
        self.judged: Callable[[int, Access | None, int], None] = lambda client, access, now: None
        """Called when a client has said who it is; without an access if that is not good."""

        self._operations: Final[dict[str, Callable[[Connection, Operation, int], None]]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "advertise_service": self._advertise_service,
            "unadvertise_service": self._unadvertise_service,
            "service_response": self._service_response,
            "advertise_action": self._advertise_action,
            "unadvertise_action": self._unadvertise_action,
            "send_action_goal": self._send_action_goal,
            "cancel_action_goal": self._cancel_action_goal,
            "action_feedback": self._action_feedback,
            "action_result": self._action_result,
            "fragment": self._fragment,
            "auth": self._auth,
            "set_level": self._set_level,
            "status": self._status,
        }

    def frame(
        self, client: Connection, frame: str | bytes, now: int, *, joined: bool = False
    ) -> None:
        """Do the operations in a frame, or in fragments that have been joined."""
        paid = joined  # by its pieces, for one operation
        try:
            read = operations(frame) if len(frame) < LARGE_FRAME else (self._shapes.read(frame),)
            for operation in read:
                if client.closing:
                    return
                if joined and operation.get("op") == "fragment":
                    raise FrameError("a fragment holds no fragments")
                if not paid and not self._connections.admit(client, now):
                    return
                paid = False
                self._operate(client, operation, now)
        except FrameError as error:
            if joined or self._connections.admit(client, now):
                self._refuse(client, {}, error)
                self._connections.tell(client, "error", str(error))

    def _operate(self, client: Connection, operation: Operation, now: int) -> None:
        op, key = operation.get("op"), None
        act = self._operations.get(op) if isinstance(op, str) else None
        try:
            key = identity(operation)
            if act is None:
                raise OperationError(_unknown(op, self._operations))
            if client.access is None and op != "auth":
                raise OperationError("not before auth with a token")
            act(client, operation, now)
        except RosbridgeError as error:
            what = str(error) if act is None else f"{op}: {error}"
            self._refuse(client, operation, error)
            self._connections.tell(client, "error", what, key)
        except Exception:
            # A mistake of the host's must not become the client's, nor end the connection.
            _LOG.exception("%s of %s failed", op, client.name)
            self._connections.tell(client, "error", f"{op}: internal error", key)

    def _refuse(self, client: Connection, operation: Operation, why: object) -> None:
        self._connections.refused(client.id, Refusal.of(operation, str(why)))

    def _advertise(self, client: Connection, operation: Operation, now: int) -> None:
        topic, kind = name(operation, "topic"), text(operation, "type")
        _permit(client, "publish", topic)
        latch = operation.get("latch") is True or quality(operation).transient
        self._broker.advertise(client.id, topic, kind, operation.get("id"), latch, now)

    def _unadvertise(self, client: Connection, operation: Operation, now: int) -> None:
        self._broker.unadvertise(client.id, name(operation, "topic"), operation.get("id"), now)

    def _publish(self, client: Connection, operation: Operation, now: int) -> None:
        latch = operation.get("latch") is True or quality(operation).transient
        topic, message = name(operation, "topic"), operation.get("msg", {})
        _permit(client, "publish", topic)
        self._broker.relay(client.id, topic, message, latch, now)

    def _subscribe(self, client: Connection, operation: Operation, now: int) -> None:
        topic = name(operation, "topic")
        _permit(client, "subscribe", topic)
        kind = None if operation.get("type") is None else text(operation, "type")
        wished, compression = quality(operation), operation.get("compression")
        request = SubscribeOptions(
            count(operation, "throttle_rate"),
            count(operation, "queue_length") if wished.depth is None else wished.depth,
            next((known for known in ENCODINGS if known == compression), "none"),
            fragment_size(operation),
            "ros2" if kind is not None and kind.count("/") == 2 else self._flavour,
        )
        self._broker.subscribe(
            client.id, topic, kind, operation.get("id"), request, now, past=not wished.volatile
        )

    def _unsubscribe(self, client: Connection, operation: Operation, now: int) -> None:
        self._broker.unsubscribe(client.id, name(operation, "topic"), operation.get("id"), now)

    def _call_service(self, client: Connection, operation: Operation, now: int) -> None:
        called = operation.get("service")
        if not isinstance(called, str):
            raise OperationError("it needs a service, which is a string")
        # rosbridge 1 had a call's id behind the service's name.
        path, _, key = called.partition("#")
        if key and operation.get("id") is None:
            operation = {**operation, "id": key}
        service = self._services.find(path)
        reply = partial(self._reply, client.id, operation, service)
        if refusal := _refusal(client, "call", path):
            self._refuse(client, operation, refusal)
            reply(ServiceError(refusal))
            return
        if service is None:
            reply(ServiceError(f"Service {path} does not exist"))
            return
        try:
            wait = seconds(operation, "timeout")
            arguments = operation.get("args")
            answer = self._services.call(client.id, service, arguments, wait, now)
        except RosbridgeError as error:
            if not isinstance(error, ServiceError):  # which is the service's own answer
                self._refuse(client, operation, error)
            reply(ServiceError(str(error)))
        except Exception:
            _LOG.exception("service %s failed", path)
            reply(ServiceError(f"Service {path} failed: internal error"))
        else:
            if isinstance(answer, DeferredResponse):
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
        self._connections.say(
            client,
            f'{{"op":"service_response","service":{write_json(call["service"])},'
            f'"values":{values},"result":{good}{end}}}',
            _wrapping(call),
        )

    def _advertise_service(self, client: Connection, operation: Operation, now: int) -> None:
        service, kind = name(operation, "service"), text(operation, "type")
        _permit(client, "provide", service)
        self._services.advertise(client.id, service, kind)

    def _unadvertise_service(self, client: Connection, operation: Operation, now: int) -> None:
        self._services.unadvertise(client.id, name(operation, "service"))

    def _service_response(self, client: Connection, operation: Operation, now: int) -> None:
        if not self._services.respond(client.id, operation):
            self._late(client, operation)

    def _advertise_action(self, client: Connection, operation: Operation, now: int) -> None:
        action, kind = name(operation, "action"), text(operation, "type")
        _permit(client, "provide", action)
        self._actions.advertise(client.id, action, kind)

    def _unadvertise_action(self, client: Connection, operation: Operation, now: int) -> None:
        self._actions.unadvertise(client.id, name(operation, "action"))

    def _send_action_goal(self, client: Connection, operation: Operation, now: int) -> None:
        action = operation.get("action")
        refusal = _refusal(client, "call", action) if isinstance(action, str) else None
        if refusal is not None:
            self._refuse(client, operation, refusal)
        self._actions.send(client.id, operation, _wrapping(operation), now, refusal)

    def _cancel_action_goal(self, client: Connection, operation: Operation, now: int) -> None:
        self._actions.cancel(client.id, operation.get("id"))

    def _action_feedback(self, client: Connection, operation: Operation, now: int) -> None:
        if not self._actions.feedback(client.id, operation):
            self._late(client, operation)

    def _action_result(self, client: Connection, operation: Operation, now: int) -> None:
        if not self._actions.result(client.id, operation):
            self._late(client, operation)

    def _fragment(self, client: Connection, operation: Operation, now: int) -> None:
        key, assembly = identity(operation), client.assembly
        if key is None:
            raise OperationError("it needs an id")
        begun = key in assembly
        joined = assembly.add(
            key, operation.get("num"), operation.get("total"), operation.get("data"), now
        )
        if joined is not None:
            self.frame(client, joined, now, joined=True)
        elif not begun:
            self._timers.at(now + TIMEOUT_NS, partial(self._expire, client))

    def _expire(self, client: Connection, now: int) -> None:
        for key in client.assembly.expire(now):
            wait = TIMEOUT_NS // 10**9
            what = f"fragment: the other pieces did not come within {wait} s"
            self._connections.tell(client, "error", what, key)

    def _auth(self, client: Connection, operation: Operation, now: int) -> None:
        """Let a client in, or hang up; where nobody is asked who it is, it may go on."""
        if self._gate is None:
            what = "auth: authentication is not enabled here"
            self._connections.tell(client, "warning", what, operation.get("id"))
            return
        admission = self._gate.operation(operation)
        if admission is None:
            self.judged(client.id, None, now)
            self._connections.close(client, POLICY_VIOLATION, "auth: not accepted")
            return
        client.access = admission.access
        if admission.lasts is not None:
            end = partial(self._dismiss, client, client.access)
            self._timers.at(now + int(admission.lasts * 1e9), end)
        self.judged(client.id, client.access, now)
        what = f"auth: welcome, {client.access.holder}; your role is {client.access.role}"
        self._connections.tell(client, "info", what, operation.get("id"))

    def _dismiss(self, client: Connection, access: Access, now: int) -> None:
        if client.access is access:
            self._connections.close(client, POLICY_VIOLATION, "auth: its time is over")

    def _set_level(self, client: Connection, operation: Operation, now: int) -> None:
        level = operation.get("level")
        if not isinstance(level, str) or level not in LEVELS:
            raise OperationError(f"a level is one of {', '.join(LEVELS)}")
        client.level = LEVELS[level]

    def _status(self, client: Connection, operation: Operation, now: int) -> None:
        """Hear what a client has to say, and say nothing: statuses must not answer each other."""

    def _late(self, client: Connection, operation: Operation) -> None:
        """Answer an answer that nobody waits for: it timed out, or whoever asked has left."""
        what = f"{operation['op']}: nobody waits for {str(operation.get('id'))[:80]}"
        self._connections.tell(client, "warning", what, operation.get("id"))


def _places(broker: Topics, services: Services, actions: Actions) -> dict[str, PayloadField]:
    """Return which operations may be large, and of what type they then are."""

    def service(name: str) -> ServiceType | None:
        found = services.find(name.partition("#")[0])
        return found.kind if found else None

    def action(name: str) -> ActionType | None:
        wanted = canonical(name)
        return next((one.kind for one in actions.all if canonical(one.name) == wanted), None)

    def part(
        find: Callable[[str], ServiceType | ActionType | None], which: str
    ) -> Callable[[str], MessageType | None]:
        return lambda name: getattr(find(name), which, None)

    return {
        "publish": PayloadField(
            "topic", "msg", lambda name: getattr(broker.find(name), "kind", None)
        ),
        "call_service": PayloadField("service", "args", part(service, "request")),
        "service_response": PayloadField(
            "service", "values", part(service, "response"), or_text=True
        ),
        "send_action_goal": PayloadField("action", "args", part(action, "goal")),
        "action_feedback": PayloadField("action", "values", part(action, "feedback")),
        "action_result": PayloadField("action", "values", part(action, "result"), or_text=True),
    }


def _refusal(client: Connection, act: Act, name: str) -> str | None:
    return client.access.refusal(act, name) if client.access else "not before auth with a token"


def _permit(client: Connection, act: Act, name: str) -> None:
    if refusal := _refusal(client, act, name):
        raise OperationError(refusal)


def _wrapping(operation: Operation) -> ReplyFormat:
    return ReplyFormat(operation.get("compression") == "png", fragment_size(operation))


def _unknown(op: object, allowed: dict[str, Any]) -> str:
    names = ", ".join(sorted(allowed))
    if op is None:
        return f"Received a message without an op; it is one of {names}"
    return f"Unknown operation: {str(op)[:80]}. Allowed operations: {names}"
