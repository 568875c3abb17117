"""Token files that change while the server runs."""

from __future__ import annotations

import asyncio
import os
from datetime import UTC, datetime
from pathlib import Path

import pytest

from teleop.rosbridge import (
    Authenticator,
    Client,
    Credentials,
    Protocol,
    Role,
    Server,
    TokenFile,
    TokenWatch,
    TypeRegistry,
    serve_rosapi,
)
from teleop.rosbridge.errors import ClientError
from teleop.rosbridge.framing.outgoing_frames import CloseFrame
from tests.teleop.rosbridge.auth.test_authenticator import NOW, signed
from tests.teleop.rosbridge.server.test_server import in_a_loop, until
from tests.teleop.rosbridge.support import Wire, client_ids

ONE, TWO = "the-first-of-two-tokens", "the-second-of-two-tokens"


def text(*holders: tuple[str, str], role: str = "operate") -> str:
    return "".join(
        f'[tokens.{name}]\nrole = "{role}"\ntoken = "{token}"\n' for name, token in holders
    )


BOTH = text(("one", ONE), ("two", TWO))


def write(path: Path, content: str, mode: int = 0o600) -> None:
    """Replace the file by another, as editors do."""
    new = path.with_suffix(".new")
    new.touch()
    new.chmod(mode)
    new.write_text(content)
    new.replace(path)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "tokens.toml"
    write(path, BOTH)
    return path


def test_changed_file_is_reloaded_once_it_is_steady(path: Path) -> None:
    file = TokenFile(path, lambda: NOW)
    assert file.credentials.find(ONE) is not None
    assert (file.poll(), file.poll()) == (None, None)
    write(path, text(("two", TWO)))
    assert file.poll() is None  # it may still be written
    ring = file.poll()
    assert ring is not None
    assert (ring.find(ONE), file.credentials) == (None, ring)
    assert ring.find(TWO) is not None
    assert file.poll() is None
    write(path, BOTH)
    assert file.poll(immediately=True) is not None


@pytest.mark.parametrize("bad", ["[tokens", "", "gone", "open"])
def test_invalid_file_is_logged_once_and_ignored(
    path: Path, bad: str, caplog: pytest.LogCaptureFixture
) -> None:
    file = TokenFile(path, lambda: NOW)
    if bad == "gone":
        path.unlink()
    else:
        write(path, BOTH if bad == "open" else bad, 0o644 if bad == "open" else 0o600)
    assert [file.poll() for _ in range(5)] == [None] * 5
    assert file.credentials.find(ONE) is not None
    assert [record.message.partition("; ")[2] for record in caplog.records] == [
        "the previous tokens remain valid"
    ]
    assert ONE not in caplog.text
    write(path, BOTH + "# mended\n")
    assert [ring is not None for ring in (file.poll(), file.poll(), file.poll())] == [0, 1, 0]


def guarded(path: Path) -> tuple[Wire, list[int]]:
    """Return a protocol with a client for each token of a file."""
    authenticator = Authenticator(TokenFile(path, lambda: NOW).credentials, lambda: 1e9)
    wire = Wire(0, authenticator=authenticator)
    for token in (ONE, TWO):
        wire.clients.append(
            wire.protocol.connect(wire.now, access=authenticator.verify_token(token))
        )
    return wire, wire.clients


@pytest.mark.parametrize(
    ("content", "gone"),
    [
        (BOTH, []),
        (text(("uno", ONE), ("two", TWO)), [0]),
        (text(("two", TWO)), [0]),
        (text(("one", TWO)), [0, 1]),  # the same name with another token
        (text(("one", "another-token-instead"), ("two", TWO)), [0]),
        (text(("one", ONE), ("two", TWO), role="view"), [0, 1]),
        (BOTH + '[roles.operate]\npublish = ["/joy"]\n', [0, 1]),
        (BOTH + '[roles.view]\npublish = ["/joy"]\n', []),
        ('anonymous = "operate"\n', [0, 1]),
    ],
)
def test_clients_with_changed_access_are_disconnected(
    path: Path, content: str, gone: list[int]
) -> None:
    wire, clients = guarded(path)
    write(path, content)
    assert wire.protocol.update_credentials(TokenFile(path, lambda: NOW).credentials) == [
        clients[i] for i in gone
    ]
    for place in range(2):
        ends = [CloseFrame(1008, "your access has changed")] if place in gone else []
        assert wire.received(place) == ends


def test_anonymous_clients_stay_while_anonymous_access_is_allowed(path: Path) -> None:
    write(path, 'anonymous = "view"\n')
    authenticator = Authenticator(TokenFile(path, lambda: NOW).credentials, lambda: 1e9)
    wire = Wire(authenticator=authenticator)
    write(path, 'anonymous = "view"\n' + BOTH)
    assert wire.protocol.update_credentials(TokenFile(path, lambda: NOW).credentials) == []
    write(path, BOTH)
    assert (
        wire.protocol.update_credentials(TokenFile(path, lambda: NOW).credentials) == wire.clients
    )
    waiting = wire.protocol.connect(wire.now)  # it has time to authenticate
    assert wire.protocol.update_credentials(TokenFile(path, lambda: NOW).credentials) == []
    assert waiting in client_ids(wire.protocol)


def test_changed_secret_disconnects_its_clients(path: Path) -> None:
    def secret(value: str) -> str:
        return f'[tokens.lab]\nrole = "admin"\nsecret = "{value}"\n'

    write(path, secret(ONE))
    authenticator = Authenticator(TokenFile(path, lambda: NOW).credentials, lambda: NOW)
    wire = Wire(2, authenticator=authenticator)
    for place, level in enumerate(("admin", "view")):
        wire.send(signed(ONE, level=level), place)
    assert [c.access.role for c in wire.protocol.connections if c.access] == [Role.ADMIN, Role.VIEW]
    assert wire.protocol.update_credentials(TokenFile(path, lambda: NOW).credentials) == []
    write(path, secret(TWO))
    assert (
        wire.protocol.update_credentials(TokenFile(path, lambda: NOW).credentials) == wire.clients
    )


def test_credentials_cannot_be_updated_without_authenticator() -> None:
    with pytest.raises(ValueError, match="without an authenticator"):
        Wire().protocol.update_credentials(Credentials())


@in_a_loop
async def test_removing_a_token_from_the_file_disconnects_its_client(path: Path) -> None:
    file = TokenFile(path, lambda: NOW)
    protocol = Protocol(TypeRegistry(), authenticator=Authenticator(file.credentials, lambda: 1e9))
    serve_rosapi(protocol)
    loop = asyncio.get_running_loop()
    watch = TokenWatch(
        file,
        lambda ring: loop.call_soon_threadsafe(protocol.update_credentials, ring),
        interval=0.02,
    )
    try:
        async with Server(protocol, port=0) as server:
            one = Client(server.url, token=ONE, reconnect=False)
            await one.connect()
            async with Client(server.url, token=TWO) as two:
                write(path, text(("two", TWO)))
                await until(lambda: not one.connected)
                assert "your access has changed" in one.closed_reason
                assert await two.call("/rosapi/get_time")
                with pytest.raises(ClientError, match="does not accept this client's token"):
                    await Client(server.url, token=ONE).connect()
            await one.close()
    finally:
        watch.close()


def test_token_watch_can_check_immediately(path: Path) -> None:
    rings: list[Credentials] = []
    watch = TokenWatch(TokenFile(path, lambda: NOW), rings.append, interval=3600)
    write(path, text(("two", TWO)))
    watch.check_now()
    while not rings:
        os.sched_yield()
    watch.close()
    assert rings[0].find(ONE) is None


def test_token_ends_at_its_time_without_a_change_of_the_file(path: Path) -> None:
    write(path, BOTH + "until = 2026-11-24T12:00:00Z\n")
    now = end = datetime(2026, 11, 24, 12, tzinfo=UTC).timestamp()
    now -= 1.0
    file = TokenFile(path, lambda: now)
    assert file.credentials.find(TWO) is not None
    assert file.poll() is None
    now = end
    left = file.poll()
    assert left is not None
    assert (left.find(ONE) is not None, left.find(TWO)) == (True, None)
    assert file.poll() is None
    assert TokenFile(path, lambda: now).credentials.find(TWO) is None
