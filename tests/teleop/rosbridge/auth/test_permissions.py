from __future__ import annotations

from typing import Any

import pytest

from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.rosbridge.auth.credentials import Credential, Credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Access, Role, RoleRules
from teleop.rosbridge.compat.rosapi import serve_rosapi
from teleop.rosbridge.framing.outgoing_frames import CloseFrame
from teleop.rosbridge.protocol.protocol import Protocol
from tests.teleop.rosbridge.auth.test_credentials import digest
from tests.teleop.rosbridge.support import REGISTRY, SECOND, ConnectionLog, Wire, error

TOKENS = {role: f"token of the {role} role" for role in Role}
TEXT = "std_msgs/String"


def credentials(anonymous: Role | None = None) -> Credentials:
    access = {role: Access(f"{role}er", role, DEFAULT_RULES[role]) for role in Role}
    keys = tuple(Credential(access[role], digest(token)) for role, token in TOKENS.items())
    return Credentials(keys, None if anonymous is None else access[anonymous])


class Guarded(Wire):
    """A protocol with authentication; the last three clients have one role each."""

    def __init__(self, strangers: int = 1) -> None:
        super().__init__(strangers, authenticator=Authenticator(credentials(), lambda: 1e9))
        serve_rosapi(self.protocol)
        self.protocol.services.serve("/lamp/on", "std_srvs/Trigger", lambda *_: {"success": True})
        for role in Role:
            access = credentials().find(TOKENS[role])
            self.clients.append(self.protocol.connect(self.now, access=access))


def test_higher_roles_include_lower_ones() -> None:
    assert [role.rank for role in (Role.VIEW, Role.OPERATE, Role.ADMIN)] == [0, 1, 2]
    for act in ("subscribe", "publish", "call", "provide"):
        for name in ("/x", "/rosapi/topics", "/rosapi/set_param", "/republish_tfs"):
            may = [DEFAULT_RULES[role].allow(act, name) for role in Role]
            assert may == sorted(may)


def test_exclusion_patterns_apply_in_any_position() -> None:
    rules = RoleRules(publish=("!/lamp/secret*", "/lamp/*"))
    assert rules.allow("publish", "/lamp/on")
    assert not rules.allow("publish", "/lamp/secret_one")
    assert not rules.allow("subscribe", "/lamp/on")
    with pytest.raises(ValueError, match="publish: 'lamp' matches no name"):
        RoleRules(publish=("lamp",))


@pytest.mark.parametrize(
    "operation",
    [
        {"op": "advertise", "topic": "/x", "type": TEXT},
        {"op": "subscribe", "topic": "/x", "type": TEXT},
        {"op": "publish", "topic": "/x", "msg": {}},
        {"op": "call_service", "service": "/rosapi/topics"},
        {"op": "advertise_service", "service": "/x", "type": "std_srvs/Empty"},
        {"op": "fragment", "id": "f", "num": 0, "total": 2, "data": "x"},
        {"op": "set_level", "level": "info"},
        {"op": "send_action_goal", "action": "/x", "action_type": "actionlib/Test"},
    ],
)
def test_operations_before_auth_are_rejected(operation: dict[str, Any]) -> None:
    wire = Guarded()
    topics = len(wire.protocol.topics.all)
    what = f"{operation['op']}: authentication with a token is required"
    assert wire.ask(operation) == [error(what, operation.get("id"))]
    assert len(wire.protocol.topics.all) == topics


def test_unauthenticated_clients_may_send_only_small_frames() -> None:
    wire = Guarded()
    wire.raw("[" * 4097)
    assert wire.received() == [CloseFrame(1009, "a frame may have at most 4096 bytes")]


def test_auth_by_token_is_confirmed_only_at_level_info() -> None:
    wire = Guarded()
    assert wire.ask({"op": "auth", "token": TOKENS[Role.VIEW]}) == []
    assert wire.ask({"op": "set_level", "level": "info"}) == []
    (welcome,) = wire.ask({"op": "auth", "token": TOKENS[Role.OPERATE]})
    assert welcome["msg"] == "auth: accepted operateer with role operate"
    access = wire.protocol.connections.access(wire.clients[0])
    assert access is not None
    assert access.role is Role.OPERATE


def test_wrong_token_disconnects_and_later_operations_are_ignored() -> None:
    wire = Guarded()
    log = ConnectionLog(wire.protocol)
    call = '{"op":"call_service","service":"/rosapi/topics"}'
    wire.raw('{"op":"auth","token":"a guess"}' + call)
    assert wire.received() == [CloseFrame(1008, "auth: rejected")]
    assert log.authentications == [(wire.clients[0], None)]


@pytest.mark.parametrize(
    ("operation", "may"),
    [
        ({"op": "subscribe", "topic": "/x", "type": TEXT}, (True, True, True)),
        ({"op": "advertise", "topic": "/x", "type": TEXT}, (False, True, True)),
        ({"op": "publish", "topic": "/known", "msg": {"data": "x"}}, (False, True, True)),
        ({"op": "publish", "topic": "/tf2_web_republisher/goal"}, (True, True, True)),
        ({"op": "call_service", "service": "/rosapi/topics"}, (True, True, True)),
        ({"op": "call_service", "service": "/lamp/on"}, (False, True, True)),
        (
            {"op": "call_service", "service": "rosapi/set_param", "args": ["/a", "1"]},
            (False, False, True),
        ),
        (
            {"op": "advertise_service", "service": "/mine", "type": "std_srvs/Empty"},
            (False, False, True),
        ),
        (
            {"op": "advertise_action", "action": "/mine", "type": "actionlib/Test"},
            (False, False, True),
        ),
    ],
)
def test_operations_are_permitted_or_rejected_by_role(
    operation: dict[str, Any], may: tuple[bool, bool, bool]
) -> None:
    for place, allowed in enumerate(may, 1):
        wire = Guarded()
        wire.send({"op": "advertise", "topic": "/known", "type": TEXT}, 3)
        received = str(wire.ask(operation, place))
        assert ("may not" in received) == (not allowed)
        if operation["op"] == "call_service":
            assert f"'result': {allowed}" in received


def test_forbidden_goal_receives_a_result() -> None:
    wire = Guarded()
    wire.send({"op": "advertise_action", "action": "/dim", "type": "actionlib/Test"}, 3)
    goal = {"op": "send_action_goal", "action": "/dim", "action_type": "actionlib/Test", "id": "g"}
    (result,) = wire.ask(goal, 1)
    assert (result["op"], result["result"]) == ("action_result", False)
    assert result["values"] == "role view may not call /dim"
    assert wire.received(3) == []
    wire.send(goal, 2)
    assert [asked["op"] for asked in wire.received(3)] == ["send_action_goal"]


def test_anonymous_clients_can_authenticate_later() -> None:
    protocol = Protocol(REGISTRY, authenticator=Authenticator(credentials(Role.VIEW), lambda: 1e9))
    client = protocol.connect(SECOND)
    before = protocol.connections.access(client)
    assert before is not None
    assert before.role is Role.VIEW
    protocol.receive(client, f'{{"op":"auth","token":"{TOKENS[Role.ADMIN]}"}}', SECOND)
    after = protocol.connections.access(client)
    assert after is not None
    assert after.role is Role.ADMIN
