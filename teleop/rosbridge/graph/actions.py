"""Actions of ROS 2: goals between clients, and to the host, by operations of their own."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from teleop.rosbridge.errors import OperationError, RosbridgeError, ServiceError
from teleop.rosbridge.framing.operation_fields import Operation
from teleop.rosbridge.graph.goals import Goal, GoalHandler, GoalStatus
from teleop.rosbridge.limits import ClientLimits
from teleop.rosbridge.messages.json_cbor_codec import Codec, write_json
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.message_types import ActionType, Message
from teleop.rosbridge.messages.type_registry import TypeRegistry
from teleop.rosbridge.protocol.connections import PLAIN, ReplyFormat
from teleop.rosbridge.topic_names import HOST, canonical

Say: TypeAlias = Callable[[int, str, ReplyFormat], None]
"""Sends an operation's JSON text to a client."""


@dataclass(frozen=True, slots=True)
class Action:
    """An action, whoever provides it."""

    name: str
    kind: ActionType
    handler: GoalHandler
    provider: int = HOST


@dataclass(slots=True)
class _Provider:
    client: int
    name: str
    type: str
    """Both as the client wrote them."""

    goals: dict[str, Goal] = field(default_factory=dict)


class Actions:
    """All actions by name, and the goals that have not ended."""

    def __init__(
        self, registry: TypeRegistry, codec: Codec, limits: ClientLimits, say: Say
    ) -> None:
        self._registry = registry
        self._codec = codec
        self._limits = limits
        self._say = say
        self._actions: dict[str, Action] = {}
        self._providers: dict[tuple[int, str], _Provider] = {}
        self._goals: dict[int, dict[_Caller, Goal]] = {}
        self._numbers = itertools.count(1)

    @property
    def all(self) -> list[Action]:
        """Those that there are."""
        return list(self._actions.values())

    # Who provides

    def serve(self, name: str, kind: str, handler: GoalHandler) -> None:
        """Offer an action of the host."""
        key = canonical(name)
        self._actions[key] = Action(key, self._registry.action(kind), handler)

    def advertise(self, client: int, name: str, kind: str) -> None:
        """Note that a client provides an action."""
        key, wanted = canonical(name), self._registry.action(kind)
        there = self._actions.get(key)
        if there is not None and there.provider == HOST:
            raise OperationError(f"action {name} is provided by the server only")
        if there is not None and there.provider != client:
            raise OperationError(f"action {name} is provided by another client")
        self.unadvertise(client, name)
        if sum(owner == client for owner, _ in self._providers) >= self._limits.services:
            raise OperationError(f"at most {self._limits.services} actions can be provided")
        provider = self._providers[client, key] = _Provider(client, name, kind)
        self._actions[key] = Action(key, wanted, partial(self._forward, provider, wanted), client)

    def unadvertise(self, client: int, name: str) -> None:
        """Note that a client provides an action no more; goals it has not ended fail."""
        key = canonical(name)
        provider = self._providers.pop((client, key), None)
        if provider is None:
            return
        del self._actions[key]
        for goal in list(provider.goals.values()):
            goal.abort(f"Action {name}: its provider has left")

    def leave(self, client: int) -> None:
        """Forget a client: what it provides, and what it wants."""
        for owner, key in list(self._providers):
            if owner == client:
                self.unadvertise(client, key)
        for goal in list(self._goals.pop(client, {}).values()):
            goal.cancel()

    # Who asks

    def send(
        self,
        client: int,
        operation: Operation,
        wrapping: ReplyFormat,
        now: int,
        refusal: str | None = None,
    ) -> None:
        """Take a goal; whatever is wrong with it is its result, as is why it may not be sent."""
        name = operation.get("action")
        if not isinstance(name, str):
            raise OperationError("it needs an action, which is a string")
        caller = _Caller(self, client, name, operation, wrapping)
        goals = self._goals.setdefault(client, {})
        action = self._actions.get(canonical(name))
        try:
            if refusal is not None:
                raise ServiceError(refusal)
            if action is None:
                raise ServiceError(f"Action {name} does not exist")
            if any(other.identity == caller.identity for other in goals if caller.identity):
                raise ServiceError(f"a goal {caller.identity} is under way")
            if len(goals) >= self._limits.calls:
                raise ServiceError(f"at most {self._limits.calls} goals can be under way")
            caller.kind = action.kind
            arguments = operation.get("args")
            request = complete(
                self._registry, action.kind.goal, {} if arguments is None else arguments, now=now
            )
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
        """Ask that a goal be ended; one that is not under way has ended already."""
        for caller, goal in list(self._goals.get(client, {}).items()):
            if caller.identity == identity:
                goal.cancel()

    # What providers say

    def feedback(self, client: int, operation: Operation) -> bool:
        """Pass on how far a goal is; return whether it is under way."""
        found = self._find(client, operation)
        if found is None:
            return False
        kind, goal = found
        goal.feedback(complete(self._registry, kind.feedback, operation.get("values") or {}))
        return True

    def result(self, client: int, operation: Operation) -> bool:
        """Pass on how a goal ended; return whether it was under way."""
        found = self._find(client, operation)
        if found is None:
            return False
        kind, goal = found
        values, good = operation.get("values"), operation.get("result") is not False
        # Older clients leave the status out, and mean that all is well.
        status = operation.get("status", GoalStatus.SUCCEEDED if good else GoalStatus.ABORTED)
        if values is None and good:
            values = {}
        if not isinstance(values, dict):
            goal.abort(str(values)[:1000] if values else "the goal was aborted")
            return True
        try:
            whole = complete(self._registry, kind.result, values)
        except RosbridgeError as error:
            goal.abort(f"the action gave no good result: {error}")
            raise
        if status == GoalStatus.CANCELED:
            goal.canceled(whole)
        elif status == GoalStatus.ABORTED:
            goal.abort("", whole)
        else:
            goal.succeed(whole)
        return True

    def _find(self, client: int, operation: Operation) -> tuple[ActionType, Goal] | None:
        identity = str(operation.get("id"))
        for (owner, key), provider in self._providers.items():
            if owner == client and identity in provider.goals:
                return self._actions[key].kind, provider.goals[identity]
        return None

    def _forward(self, provider: _Provider, kind: ActionType, goal: Goal) -> None:
        """Pass a goal on to the client that provides the action."""
        identity = f"action_goal:{provider.name}:{next(self._numbers)}"
        provider.goals[identity] = goal
        goal.on_end(lambda: provider.goals.pop(identity, None))
        client, name = provider.client, write_json(provider.name)
        head = f'"id":{write_json(identity)},"action":{name}'
        goal.on_cancel(lambda: self._say(client, f'{{"op":"cancel_action_goal",{head}}}', PLAIN))
        self._say(
            client,
            f'{{"op":"send_action_goal",{head},"action_type":{write_json(provider.type)},'
            f'"args":{self._codec.json(kind.goal, goal.request)},"feedback":true}}',
            PLAIN,
        )

    def answer(self, caller: _Caller, text: str) -> None:
        """Send a caller what became of its goal."""
        self._say(caller.client, text, caller.wrapping)

    def ended(self, caller: _Caller) -> None:
        """Forget a goal."""
        self._goals.get(caller.client, {}).pop(caller, None)

    def json(self, caller: _Caller, values: Message, *, result: bool) -> str:
        """Return feedback or a result as JSON text."""
        assert caller.kind is not None
        return self._codec.json(caller.kind.result if result else caller.kind.feedback, values)


class _Caller:
    """The client that wants a goal, as its sink."""

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
        self._actions.ended(self)
        if text:
            self.fail(status, text)
            return
        # Whatever way it went, there is a result: ``false`` is for goals that were never pursued.
        self._result(status, self._actions.json(self, values, result=True), "true")

    def fail(self, status: GoalStatus, text: str) -> None:
        self._result(status, write_json(text), "false")

    def _result(self, status: GoalStatus, values: str, good: str) -> None:
        self._actions.answer(
            self,
            f'{{"op":"action_result",{self._head},"values":{values},'
            f'"status":{int(status)},"result":{good}}}',
        )
