"""State machine of clients that provide services and actions to each other and disconnect.

Each request receives at most one response, responses reach only their callers, and no state remains
when all have left.
"""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import settings, strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from teleop.rosbridge.limits import ClientLimits
from tests.teleop.rosbridge.protocol.test_bad_input import frames
from tests.teleop.rosbridge.support import Wire

CLIENTS = 3
NAMES = ("/a", "/b")
ACTION = "actionlib/Test"

clients = st.integers(0, CLIENTS - 1)
names = st.sampled_from(NAMES)


class Exchange(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.wire = Wire(clients=CLIENTS, limits=ClientLimits.unhurried())
        self.asked: list[dict[int, str]] = [{} for _ in range(CLIENTS)]
        """Pending requests of each client, by id."""
        self.received: list[list[Any]] = [[] for _ in range(CLIENTS)]
        """Requests that each client has received and not answered."""
        self.providers: dict[str, list[int]] = {name: [] for name in NAMES}
        self.action: int | None = None
        self.number = 0

    def look(self) -> None:
        """Receive the frames of all clients, and check that they were for them."""
        for client in range(CLIENTS):
            for received in self.wire.received(client):
                assert "forged" not in str(received.get("values"))
                match received["op"]:
                    case "call_service" | "send_action_goal":
                        self.received[client].append(received)
                    case "service_response" | "action_result":
                        assert received["id"] in self.asked[client], received
                        wanted = self.asked[client].pop(received["id"])
                        assert received["op"] == wanted
                    case "action_feedback":
                        assert received["id"] in self.asked[client]
                    case "cancel_action_goal":
                        assert self.action == client
                    case other:
                        assert other == "status"

    @rule(client=clients, name=names)
    def provide(self, client: int, name: str) -> None:
        self.wire.send(
            {"op": "advertise_service", "service": name, "type": "std_srvs/SetBool"}, client
        )
        if client not in self.providers[name]:
            self.providers[name].append(client)

    @rule(client=clients, name=names)
    def withdraw(self, client: int, name: str) -> None:
        self.wire.send({"op": "unadvertise_service", "service": name}, client)
        if client in self.providers[name]:
            self.providers[name].remove(client)

    @rule(client=clients)
    def provide_action(self, client: int) -> None:
        self.wire.send({"op": "advertise_action", "action": "/act", "type": ACTION}, client)
        if self.action is None:
            self.action = client

    @rule(client=clients)
    def withdraw_action(self, client: int) -> None:
        self.wire.send({"op": "unadvertise_action", "action": "/act"}, client)
        if self.action == client:
            self.action = None

    @rule(client=clients, name=names, timeout=st.sampled_from([None, 0, 0.5]))
    def call(self, client: int, name: str, timeout: float | None) -> None:
        self.number += 1
        self.asked[client][self.number] = "service_response"
        operation = {"op": "call_service", "service": name, "id": self.number, "timeout": timeout}
        self.wire.send(operation, client)

    @rule(client=clients)
    def send_goal(self, client: int) -> None:
        self.number += 1
        self.asked[client][self.number] = "action_result"
        goal = {"op": "send_action_goal", "action": "/act", "action_type": ACTION, "feedback": True}
        self.wire.send({**goal, "id": self.number}, client)

    @precondition(lambda self: any(self.received))
    @rule(data=st.data(), values=st.sampled_from([{}, {"success": True}, {"x": 1}, None, "no"]))
    def answer(self, data: st.DataObject, values: Any) -> None:
        client = data.draw(st.sampled_from([c for c in range(CLIENTS) if self.received[c]]))
        index = data.draw(st.integers(0, len(self.received[client]) - 1))
        request = self.received[client].pop(index)
        if request["op"] == "call_service":
            answer = {"op": "service_response", "service": request["service"], "values": values}
        else:
            answer = {"op": "action_result", "action": request["action"], "values": values}
        self.wire.send({**answer, "id": request["id"], "result": values is not None}, client)

    @precondition(lambda self: any(self.received))
    @rule(client=clients, other=clients)
    def answer_for_another(self, client: int, other: int) -> None:
        own = {request["id"] for request in self.received[client]}
        for request in self.received[other]:
            if client != other and request["id"] not in own:
                answer = {"service": "/a", "id": request["id"], "values": {"message": "forged"}}
                self.wire.send({"op": "service_response", **answer}, client)
                self.wire.send({"op": "action_result", **answer, "action": "/act"}, client)

    @rule(client=clients, identity=st.integers(1, 10))
    def cancel(self, client: int, identity: int) -> None:
        self.wire.send({"op": "cancel_action_goal", "action": "/act", "id": identity}, client)

    @rule(milliseconds=st.integers(0, 3000))
    def wait(self, milliseconds: int) -> None:
        self.wire.wait(milliseconds)

    @rule(client=clients, frame=frames)
    def garbage(self, client: int, frame: str | bytes) -> None:
        self.wire.raw(frame, client)

    @rule(client=clients)
    def reconnect(self, client: int) -> None:
        self.look()
        self.wire.protocol.disconnect(self.wire.clients[client], self.wire.now)
        self.wire.clients[client] = self.wire.protocol.connect(self.wire.now)
        self.asked[client], self.received[client] = {}, []
        for providers in self.providers.values():
            if client in providers:
                providers.remove(client)
        if self.action == client:
            self.action = None

    @invariant()
    def every_client_receives_only_its_own(self) -> None:
        self.look()

    @invariant()
    def services_and_actions_are_those_provided(self) -> None:
        there = {service.name: service.provider for service in self.wire.protocol.services.all}
        wanted = {name: self.wire.clients[p[-1]] for name, p in self.providers.items() if p}
        assert there == wanted
        assert len(self.wire.protocol.actions.all) == (self.action is not None)

    def teardown(self) -> None:
        """Disconnect all providers: then no request is pending and no state remains."""
        for client in range(CLIENTS):
            for name in NAMES:
                self.withdraw(client, name)
            self.withdraw_action(client)
        self.look()
        assert self.asked == [{}] * CLIENTS
        self.wire.wait(20_000)
        assert self.wire.protocol.timers.due is None


TestExchange = pytest.mark.slow(Exchange.TestCase)
TestExchange.settings = settings(max_examples=80, stateful_step_count=40)
