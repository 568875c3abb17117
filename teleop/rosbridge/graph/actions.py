"""ROS 2 actions of the host and of clients, and the goals sent to them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from teleop.rosbridge.errors import OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.framing.operation_fields import Operation, check_name
from teleop.rosbridge.framing.outgoing_frames import PLAIN, ReplyFormat
from teleop.rosbridge.graph.client_completion import ClientCompletion, CompletedAhead
from teleop.rosbridge.graph.goals import Goal, GoalHandler, GoalStatus
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_types import ActionType, Message
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.topic_names import HOST, canonical

SendJson: TypeAlias = Callable[[int, str, ReplyFormat], None]
"""Sends the JSON text of an operation to a client."""


@dataclass(frozen=True, slots=True)
class Action:
    """An action of the host or of a client."""

    name: str
    kind: ActionType
    handler: GoalHandler
    provider: int = HOST


@dataclass(slots=True)
class _Provider:
    client: int
    name: str
    type: str
    """Name and type of the action as the client spells them."""

    goals: dict[str, Goal] = field(default_factory=dict)


class Actions:
    """All actions by name, and the active goals."""

    def __init__(
        self,
        registry: TypeRegistry,
        codec: Codec,
        limits: ClientLimits,
        send: SendJson,
        completion: ClientCompletion,
    ) -> None:
        self._registry = registry
        self._codec = codec
        self._limits = limits
        self._send = send
        self._completion = completion
        self._actions: dict[str, Action] = {}
        self._providers: dict[int, dict[str, _Provider]] = {}
        """Clients' actions, by client and canonical name."""

        self._executed: dict[tuple[int, str], tuple[ActionType, Goal]] = {}
        """Active goals by the client that executes them and their id there."""

        self._goals: dict[int, dict[_Caller, Goal]] = {}
        self._numbers = itertools.count(1)

    @property
    def all(self) -> list[Action]:
        """All actions."""
        return list(self._actions.values())

    def find(self, name: str) -> Action | None:
        """Return the action of a name; None if there is none."""
        return self._actions.get(canonical(name))

    # Providers

    def serve(self, name: str, type: str, handler: GoalHandler) -> None:
        """Provide an action of the host; the handler starts each goal and ends it later."""
        key = canonical(check_name(name, "action"))
        self._actions[key] = Action(key, self._registry.action(type), handler)

    def advertise(self, client: int, name: str, type: str) -> None:
        """Add an action that a client provides."""
        key, wanted = canonical(name), self._registry.action(type)
        there = self._actions.get(key)
        if there is not None and there.provider == HOST:
            raise OperationError(f"action {name} is provided by the server only")
        if there is not None and there.provider != client:
            raise OperationError(f"action {name} is provided by another client")
        self.unadvertise(client, name)
        own = self._providers.setdefault(client, {})
        if len(own) >= self._limits.services:
            raise OperationError(f"at most {self._limits.services} actions may be provided")
        provider = own[key] = _Provider(client, name, type)
        self._actions[key] = Action(key, wanted, partial(self._forward, provider, wanted), client)

    def unadvertise(self, client: int, name: str) -> None:
        """Remove an action that a client provides; its active goals fail."""
        key = canonical(name)
        provider = self._providers.get(client, {}).pop(key, None)
        if provider is None:
            return
        del self._actions[key]
        for goal in list(provider.goals.values()):
            goal.abort(f"Action {name}: its provider has left")

    def remove_client(self, client: int) -> None:
        """Remove the actions that a client provides and cancel its goals."""
        for key in list(self._providers.get(client, ())):
            self.unadvertise(client, key)
        self._providers.pop(client, None)
        for goal in list(self._goals.pop(client, {}).values()):
            goal.cancel()

    # Goals

    def send(
        self,
        client: int,
        operation: Operation,
        wrapping: ReplyFormat,
        now: int,
        refusal: str | None = None,
    ) -> None:
        """Process a goal; a rejection, as by ``refusal``, is sent as its result."""
        name = operation.get("action")
        if not isinstance(name, str):
            raise OperationError("action must be given as a string")
        caller = _Caller(self, client, name, operation, wrapping)
        goals = self._goals.setdefault(client, {})
        action = self._actions.get(canonical(name))
        try:
            if refusal is not None:
                raise ServiceError(refusal)
            if action is None:
                raise ServiceError(f"Action {name} does not exist")
            if any(other.identity == caller.identity for other in goals if caller.identity):
                raise ServiceError(f"goal {caller.identity} is active already")
            if len(goals) >= self._limits.calls:
                raise ServiceError(f"at most {self._limits.calls} goals may be active")
            caller.kind = action.kind
            arguments = operation.get("args")
            partial = {} if arguments is None else arguments
            request, _ = self._completion(client, action.kind.goal, partial, now)
            goal = goals[caller] = Goal(client, request, now, caller)
            action.handler(goal)
        except RosbridgeError as error:
            goals.pop(caller, None)
            caller.fail(GoalStatus.UNKNOWN, str(error))
        except Exception:
            goals.pop(caller, None)
            caller.fail(GoalStatus.UNKNOWN, f"Action {name} failed: internal error")
            raise

    def cancel(self, client: int, identity: object) -> None:
        """Request cancellation of a goal, if it is active."""
        for caller, goal in list(self._goals.get(client, {}).items()):
            if caller.identity == identity:
                goal.cancel()

    # Feedback and results of providers

    def feedback(self, client: int, operation: Operation) -> bool:
        """Forward feedback of a provider; return whether its goal is active."""
        found = self._executed.get((client, str(operation.get("id"))))
        if found is None:
            return False
        kind, goal = found
        values = operation.get("values") or {}
        goal.feedback(self._completion(client, kind.feedback, values)[0])
        return True

    def result(self, client: int, operation: Operation) -> bool:
        """Forward the result of a provider; return whether its goal was active."""
        found = self._executed.get((client, str(operation.get("id"))))
        if found is None:
            return False
        kind, goal = found
        values, good = operation.get("values"), operation.get("result") is not False
        # Older clients omit the status on success.
        status = operation.get("status", GoalStatus.SUCCEEDED if good else GoalStatus.ABORTED)
        if values is None and good:
            values = {}
        if not isinstance(values, dict | CompletedAhead):
            goal.abort(str(values)[:1000] if values else "the goal was aborted")
            return True
        try:
            whole, _ = self._completion(client, kind.result, values)
        except RosbridgeError as error:
            goal.abort(f"the action returned an invalid result: {error}")
            raise
        if status == GoalStatus.CANCELED:
            goal.canceled(whole)
        elif status == GoalStatus.ABORTED:
            goal.abort("", whole)
        else:
            goal.succeed(whole)
        return True

    def _forward(self, provider: _Provider, kind: ActionType, goal: Goal) -> None:
        """Forward a goal to the client that provides the action."""
        identity = f"action_goal:{provider.name}:{next(self._numbers)}"
        provider.goals[identity] = goal
        self._executed[provider.client, identity] = kind, goal
        goal.on_end(lambda: self._forget(provider, identity))
        client, name = provider.client, write_json(provider.name)
        head = f'"id":{write_json(identity)},"action":{name}'
        goal.on_cancel(lambda: self._send(client, f'{{"op":"cancel_action_goal",{head}}}', PLAIN))
        self._send(
            client,
            f'{{"op":"send_action_goal",{head},"action_type":{write_json(provider.type)},'
            f'"args":{self._codec.json(kind.goal, goal.request)},"feedback":true}}',
            PLAIN,
        )

    def _forget(self, provider: _Provider, identity: str) -> None:
        provider.goals.pop(identity, None)
        self._executed.pop((provider.client, identity), None)

    def answer(self, caller: _Caller, text: str) -> None:
        """Send feedback or a result to the client that sent the goal."""
        self._send(caller.client, text, caller.wrapping)

    def remove(self, caller: _Caller) -> None:
        """Remove an ended goal."""
        self._goals.get(caller.client, {}).pop(caller, None)

    def json(self, caller: _Caller, values: Message, *, result: bool) -> str:
        """Return feedback or a result as JSON text."""
        assert caller.kind is not None
        return self._codec.json(caller.kind.result if result else caller.kind.feedback, values)


class _Caller:
    """Forwards feedback and result to the client that sent the goal."""

    def __init__(
        self, actions: Actions, client: int, name: str, operation: Operation, wrapping: ReplyFormat
    ) -> None:
        self.client = client
        self.identity = operation.get("id")
        self.wrapping = wrapping
        self.kind: ActionType | None = None
        self._actions = actions
        self._feedback = operation.get("feedback") is True
        end = f',"id":{write_json(self.identity)}' if self.identity is not None else ""
        self._head = f'"action":{write_json(name)}{end}'

    def feedback(self, values: Message) -> None:
        if self._feedback:
            text = self._actions.json(self, values, result=False)
            self._actions.answer(self, f'{{"op":"action_feedback",{self._head},"values":{text}}}')

    def done(self, status: GoalStatus, values: Message, text: str) -> None:
        self._actions.remove(self)
        if text:
            self.fail(status, text)
            return
        # ``result`` is false only for goals that were never executed.
        self._result(status, self._actions.json(self, values, result=True), "true")

    def fail(self, status: GoalStatus, text: str) -> None:
        self._result(status, write_json(text), "false")

    def _result(self, status: GoalStatus, values: str, good: str) -> None:
        self._actions.answer(
            self,
            f'{{"op":"action_result",{self._head},"values":{values},'
            f'"status":{int(status)},"result":{good}}}',
        )
