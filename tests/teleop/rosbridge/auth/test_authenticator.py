from __future__ import annotations

import hashlib
from typing import Any

import pytest

from teleop.rosbridge.auth.authenticator import Authenticator, token_in
from teleop.rosbridge.auth.credentials import Credential, Credentials
from teleop.rosbridge.auth.permissions import DEFAULT_RULES, Access, Role
from teleop.rosbridge.errors import OperationError
from teleop.rosbridge.framing.outgoing_frames import CloseFrame
from tests.teleop.rosbridge.support import SECOND, Wire

SECRET = "abcdefghijklmnop"
NOW = 1_700_000_000


def ring(role: Role = Role.OPERATE) -> Credentials:
    return Credentials((Credential(Access("lab", role, DEFAULT_RULES[role]), secret=SECRET),))


def signed(secret: str = SECRET, **changes: Any) -> dict[str, Any]:
    """Return the operation that ``authenticate`` of roslibjs and roslibpy sends."""
    fields: dict[str, Any] = {"client": "192.168.1.2", "dest": "192.168.1.3", "rand": "r4nd"}
    fields |= {"t": NOW, "level": "user", "end": NOW + 60, **changes}
    t, end = (v["secs"] if isinstance(v, dict) else v for v in (fields["t"], fields["end"]))
    parts = (secret, fields["client"], fields["dest"], fields["rand"], t, fields["level"], end)
    mac = hashlib.sha512("".join(map(str, parts)).encode()).hexdigest()
    return {"op": "auth", "mac": mac, **fields}


def test_codes_are_accepted_once_and_expire() -> None:
    authenticator = Authenticator(ring(), lambda: NOW + 1.0)
    admission = authenticator.verify_operation(signed())
    assert admission is not None
    assert (admission.access.holder, admission.duration) == ("lab", 59.0)
    assert authenticator.verify_operation(signed()) is None  # replayed
    assert authenticator.verify_operation(signed(rand="other")) is not None
    made, end = {"secs": NOW, "nsecs": 5}, {"secs": NOW + 9, "nsecs": 0}
    assert authenticator.verify_operation(signed(t=made, end=end)) is not None, "ROS stamps"


def test_code_is_that_of_rosauth() -> None:
    # printf 'abcdefghijklmnop192.168.1.2192.168.1.3r4nd1700000000user1700000060' | sha512sum
    assert signed()["mac"] == (
        "34f92cd9f4f7149aa245536b8e617acab6cfd6cd7bce17d614654b959f65e65f"
        "33222820a4764e040ec254fe02392a85cc188b0f47eca35eb918dd352d509a9c"
    )


@pytest.mark.parametrize(
    "operation",
    [
        signed("another secret!!"),
        signed(t=NOW - 6),
        signed(t=NOW + 6),
        signed(end=NOW),
        {**signed(), "level": "admin"},
        {**signed(), "end": NOW + 61},
        {**signed(), "mac": ""},
        {**signed(), "mac": "é"},
        {"op": "auth", "token": SECRET},
        {"op": "auth", "token": ""},
    ],
)
def test_wrong_late_and_early_codes_are_rejected(operation: dict[str, Any]) -> None:
    assert Authenticator(ring(), lambda: float(NOW)).verify_operation(operation) is None


@pytest.mark.parametrize(
    "operation",
    [
        {},
        {"token": 1},
        {**signed(), "rand": None},
        {**signed(), "t": "now"},
        {**signed(), "end": True},
        {**signed(), "end": -1},
        {**signed(), "t": {}},
        {**signed(), "client": "x" * 257},
    ],
)
def test_incomplete_auth_operations_are_rejected(operation: dict[str, Any]) -> None:
    with pytest.raises(OperationError, match=r"is required|must be"):
        Authenticator(ring(), lambda: float(NOW)).verify_operation(operation)


def test_code_may_lower_the_role_of_the_secret_but_not_raise_it() -> None:
    for level, role in (("view", Role.VIEW), ("admin", Role.OPERATE), ("user", Role.OPERATE)):
        admission = Authenticator(ring(), lambda: float(NOW)).verify_operation(signed(level=level))
        assert admission is not None
        assert admission.access.role is role
        assert admission.access.rules is DEFAULT_RULES[role]


def test_connection_is_closed_when_its_code_expires() -> None:
    wire = Wire(authenticator=Authenticator(ring(), lambda: float(NOW)))
    assert wire.ask(signed(end=NOW + 10)) == []
    wire.wait(9_999)
    assert wire.received() == []
    wire.wait(1)
    assert wire.received() == [CloseFrame(1008, "auth: expired")]


def test_used_codes_are_discarded_after_they_expire() -> None:
    now = [float(NOW)]
    authenticator = Authenticator(ring(), lambda: now[0])
    for number in range(1024):
        assert authenticator.verify_operation(signed(rand=str(number))) is not None
    assert authenticator.verify_operation(signed(rand="more")) is None
    now[0] += 10 * SECOND / 1e9
    assert authenticator.verify_operation(signed(t=NOW + 10, rand="more")) is not None


@pytest.mark.parametrize(
    ("target", "header", "token"),
    [
        ("/", None, None),
        ("/?token=abc", None, "abc"),
        ("/x?a=b&token=a%2Bb%3D", None, "a+b="),
        ("/?token=", None, ""),
        ("/", "Bearer abc", "abc"),
        ("/", "bearer  abc ", "abc"),
        ("/?token=url", "Bearer header", "header"),
        ("/?token=url", "Basic x", "url"),
        ("/?tokens=x", "Bearer", ""),
    ],
)
def test_token_is_read_from_header_or_url(
    target: str, header: str | None, token: str | None
) -> None:
    assert token_in(target, header) == token
