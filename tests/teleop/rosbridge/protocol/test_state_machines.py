"""State machine of clients that provide services and actions and disconnect, against a model.

Every request receives exactly one response, at once, from its provider or by its timeout.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from hypothesis import settings, strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from teleop.rosbridge.limits import ClientLimits
from tests.teleop.rosbridge.support import SECOND, Wire

CLIENTS = 3
TIMEOUTS = {None: 5.0, 0.5: 0.5, 0: math.inf}
"""Time that a call waits [s] by the timeout that its caller gives."""

clients = st.integers(0, CLIENTS - 1)
identities = st.integers(0, 10**6)


@dataclass
class Asked:
    """A pending call or goal."""

    caller: int
    identity: int
    timeout: float = math.inf
    until: float = math.inf
    cancelled: bool = False


@dataclass
class Side:
    """State of the service or of the action in the model."""

    providers: list[int] = field(default_factory=list)
    """The last of several providers is called; an action has at most one."""

    asked: dict[int, dict[str, Asked]] = field(
        default_factory=lambda: {i: {} for i in range(CLIENTS)}
    )
    """Pending requests by provider and id."""

    def take(self, provider: int, which: int) -> tuple[str, Asked]:
        """Remove one of the requests that a provider has to answer; return its key and it."""
        waiting = self.asked[provider]
        key = list(waiting)[which % len(waiting)]
        return key, waiting.pop(key)

    def of(self, caller: int) -> list[tuple[int, str]]:
        return [
            (provider, key)
            for provider, asked in self.asked.items()
            for key, each in asked.items()
            if each.caller == caller
        ]


class ClientExchange(RuleBasedStateMachine):
    """Each request is answered once; disconnected clients neither respond nor are waited for."""

    def __init__(self) -> None:
        super().__init__()
        self.wire = Wire(clients=CLIENTS, limits=ClientLimits.unhurried())
        self.services, self.actions = Side(), Side()
        self.numbers = itertools.count()

    def received(self) -> list[list[Any]]:
        return [self.wire.received(client) for client in range(CLIENTS)]

    def answered(
        self, answers: list[tuple[Asked, object, bool]], cancelled: Counter[int] | None = None
    ) -> None:
        """Compare the received responses with the expected ones: caller, values, result.

        ``cancelled`` counts the expected cancellations by provider.
        """
        expected: list[list[tuple[int, str, bool]]] = [[] for _ in range(CLIENTS)]
        for asked, values, good in answers:
            expected[asked.caller].append((asked.identity, str(values), good))
        for client, received in enumerate(self.received()):
            cancels = [each for each in received if each["op"] == "cancel_action_goal"]
            assert len(cancels) == (cancelled or Counter())[client]
            got = [
                (each["id"], str(each["values"]), each["result"])
                for each in received
                if each not in cancels
            ]
            assert sorted(got) == sorted(expected[client])

    def forwarded(self, provider: int, op: str, args: object) -> str:
        """Return the id of the request that has come to its provider, and to nobody else."""
        received = self.received()
        (request,) = received.pop(provider)
        assert (request["op"], request["args"]) == (op, args)
        assert received == [[]] * (CLIENTS - 1)
        return str(request["id"])

    # Services

    @rule(client=clients)
    def provide(self, client: int) -> None:
        kind = {"service": "/s", "type": "std_srvs/Trigger"}
        self.wire.send({"op": "advertise_service", **kind}, client)
        if client not in self.services.providers:
            self.services.providers.append(client)
        self.answered([])

    @rule(client=clients)
    def withdraw(self, client: int) -> None:
        self.wire.send({"op": "unadvertise_service", "service": "/s"}, client)
        self.answered(self.abandon(self.services, client))

    @rule(client=clients, timeout=st.sampled_from([*TIMEOUTS]))
    def call(self, client: int, timeout: float | None) -> None:
        lasts = TIMEOUTS[timeout]
        asked = Asked(client, next(self.numbers), lasts, self.wire.now + lasts * SECOND)
        call = {"op": "call_service", "service": "/s", "id": asked.identity, "timeout": timeout}
        self.wire.send(call, client)
        if not self.services.providers:
            self.answered([(asked, "Service /s does not exist", False)])
            return
        provider = self.services.providers[-1]
        self.services.asked[provider][self.forwarded(provider, "call_service", {})] = asked

    @rule(client=clients, good=st.booleans(), which=identities)
    def respond(self, client: int, good: bool, which: int) -> None:
        if not self.services.asked[client]:
            return
        key, asked = self.services.take(client, which)
        values: object = {"success": True, "message": key} if good else "no"
        answer = {"service": "/s", "id": key, "values": values, "result": good}
        self.wire.send({"op": "service_response", **answer}, client)
        told = values if good else "Service /s failed: no"
        self.answered([(asked, told, good)])

    @rule(client=clients, which=identities)
    def respond_with_what_is_no_response(self, client: int, which: int) -> None:
        if not self.services.asked[client]:
            return
        key, asked = self.services.take(client, which)
        answer = {"service": "/s", "id": key, "values": {"x": 1}, "result": True}
        self.wire.send({"op": "service_response", **answer}, client)
        ends = {each: self.wire.received(each) for each in {client, asked.caller}}
        (status,) = (each for each in ends[client] if each["op"] == "status")
        assert status["level"] == "error"
        (failed,) = (each for each in ends[asked.caller] if each["op"] != "status")
        assert (failed["id"], failed["result"]) == (asked.identity, False)
        self.answered([])

    @rule(client=clients, which=identities)
    def answer_for_another_or_late(self, client: int, which: int) -> None:
        others = [
            key
            for side in (self.services, self.actions)
            for provider, asked in side.asked.items()
            for key in asked
            if provider != client and key not in side.asked[client]
        ]
        key = [*others, "service_request:/s:999999"][which % (len(others) + 1)]
        answer = {"id": key, "values": {"success": True}, "result": True}
        self.wire.send({"op": "service_response", "service": "/s", **answer}, client)
        self.wire.send({"op": "action_result", "action": "/a", **answer}, client)
        self.answered([])

    # Actions

    @rule(client=clients)
    def offer(self, client: int) -> None:
        self.wire.send({"op": "advertise_action", "action": "/a", "type": "actionlib/Test"}, client)
        ends: list[tuple[Asked, object, bool]] = []
        if self.actions.providers and self.actions.providers != [client]:
            (status,) = self.wire.received(client)
            assert "provided by another client" in status["msg"]
        else:  # advertising it again resets it
            ends = self.abandon(self.actions, client)
            self.actions.providers = [client]
        self.answered(ends)

    @rule(client=clients)
    def retract(self, client: int) -> None:
        self.wire.send({"op": "unadvertise_action", "action": "/a"}, client)
        self.answered(self.abandon(self.actions, client))

    @rule(client=clients)
    def send_goal(self, client: int) -> None:
        asked = Asked(client, next(self.numbers))
        goal = {"action": "/a", "id": asked.identity, "args": {"goal": asked.identity}}
        self.wire.send({"op": "send_action_goal", **goal}, client)
        if not self.actions.providers:
            self.answered([(asked, "Action /a does not exist", False)])
            return
        (provider,) = self.actions.providers
        key = self.forwarded(provider, "send_action_goal", {"goal": asked.identity})
        self.actions.asked[provider][key] = asked

    @precondition(lambda self: any(self.actions.asked.values()))
    @rule(which=identities, by=clients)
    def cancel(self, which: int, by: int) -> None:
        """Cancel a goal; only its sender can, and only once."""
        goals = [(p, key) for p, asked in self.actions.asked.items() for key in asked]
        provider, key = goals[which % len(goals)]
        asked = self.actions.asked[provider][key]
        self.wire.send({"op": "cancel_action_goal", "action": "/a", "id": asked.identity}, by)
        received = self.received()
        if by == asked.caller and not asked.cancelled:
            asked.cancelled = True
            assert [(each["op"], each["id"]) for each in received.pop(provider)] == [
                ("cancel_action_goal", key)
            ]
            assert received == [[]] * (CLIENTS - 1)
        else:
            assert received == [[]] * CLIENTS

    @rule(client=clients, which=identities, status=st.sampled_from([4, 5, 6]))
    def finish(self, client: int, which: int, status: int) -> None:
        if not self.actions.asked[client]:
            return
        key, asked = self.actions.take(client, which)
        result = {"action": "/a", "id": key, "values": {"result": 7}, "status": status}
        self.wire.send({"op": "action_result", **result, "result": True}, client)
        self.answered([(asked, {"result": 7}, True)])

    # Time and disconnections

    @rule(seconds=st.sampled_from([0.3, 1, 3, 6]))
    def wait(self, seconds: float) -> None:
        self.wire.wait(1000 * seconds)
        ends: list[tuple[Asked, object, bool]] = []
        why = "Timeout exceeded while waiting for service response:"
        for asked in self.services.asked.values():
            for key in [key for key, each in asked.items() if each.until <= self.wire.now]:
                late = asked.pop(key)
                ends.append((late, f"{why} {late.timeout:g} s", False))
        self.answered(ends)

    @rule(client=clients)
    def leave(self, client: int) -> None:
        ends = [*self.abandon(self.services, client), *self.abandon(self.actions, client)]
        for provider, key in self.services.of(client):
            del self.services.asked[provider][key]
        self.wire.protocol.disconnect(self.wire.clients[client], self.wire.now)
        self.wire.received(client)
        # Goals of disconnected clients are cancelled, and their results are dropped.
        left = [(p, self.actions.asked[p].pop(key)) for p, key in self.actions.of(client)]
        cancelled = Counter(p for p, asked in left if not asked.cancelled)
        self.answered([end for end in ends if end[0].caller != client], cancelled)
        self.wire.clients[client] = self.wire.protocol.connect(self.wire.now)

    def abandon(self, side: Side, provider: int) -> list[tuple[Asked, object, bool]]:
        """Remove a provider; return the expected responses to its pending requests."""
        if provider not in side.providers:
            return []
        side.providers.remove(provider)
        what = "Service /s" if side is self.services else "Action /a"
        asked, side.asked[provider] = side.asked[provider], {}
        return [(each, f"{what}: its provider has left", False) for each in asked.values()]

    @invariant()
    def no_state_remains(self) -> None:
        protocol = self.wire.protocol
        there = {service.name: service.provider for service in protocol.services.all}
        expected = self.services.providers[-1:]
        assert list(there) == ["/s"] * len(expected)
        assert list(there.values()) == [self.wire.clients[i] for i in expected]
        assert [action.provider for action in protocol.actions.all] == [
            self.wire.clients[i] for i in self.actions.providers
        ]
        waiting = (each for asked in self.services.asked.values() for each in asked.values())
        assert (protocol.timers.due is not None) == any(each.until < math.inf for each in waiting)


TestClientExchange = ClientExchange.TestCase
TestClientExchange.settings = settings(max_examples=60, stateful_step_count=30)
