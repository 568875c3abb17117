"""Tokens that are withdrawn while the server runs."""

from __future__ import annotations

import asyncio
import os
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
    """Write as an editor does: another file in the place of the first."""
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


def test_a_file_is_read_again_when_it_has_changed_and_then_stood_still(path: Path) -> None:
    file = TokenFile(path)
    assert file.credentials.find(ONE) is not None
    assert (file.poll(), file.poll()) == (None, None)
    write(path, text(("two", TWO)))
    assert file.poll() is None  # it may still be being written
    ring = file.poll()
    assert ring is not None
    assert (ring.find(ONE), file.credentials) == (None, ring)
    assert ring.find(TWO) is not None
    assert file.poll() is None
    write(path, BOTH)
    assert file.poll(immediately=True) is not None


@pytest.mark.parametrize("bad", ["[tokens", "", "gone", "open"])
def test_a_file_that_cannot_be_used_changes_nothing_and_is_complained_of_once(
    path: Path, bad: str, caplog: pytest.LogCaptureFixture
) -> None:
    file = TokenFile(path)
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
    """A protocol with a client by each token of a file, one by a secret, and one without anything."""
    authenticator = Authenticator(TokenFile(path).credentials, lambda: 1e9)
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
        (text(("one", TWO)), [0, 1]),  # the name is the same, the token is not
        (text(("one", "another-token-instead"), ("two", TWO)), [0]),
        (text(("one", ONE), ("two", TWO), role="view"), [0, 1]),
        (BOTH + '[roles.operate]\npublish = ["/joy"]\n', [0, 1]),
        (BOTH + '[roles.view]\npublish = ["/joy"]\n', []),
        ('anonymous = "operate"\n', [0, 1]),
    ],
)
def test_who_would_not_get_what_it_has_is_disconnected_and_the_others_stay(
    path: Path, content: str, gone: list[int]
) -> None:
    wire, clients = guarded(path)
    write(path, content)
    assert wire.protocol.update_credentials(TokenFile(path).credentials) == [
        clients[i] for i in gone
    ]
    for place in range(2):
        ends = [CloseFrame(1008, "your access has changed")] if place in gone else []
        assert wire.heard(place) == ends


def test_who_brought_nothing_stays_as_long_as_that_is_enough(path: Path) -> None:
    write(path, 'anonymous = "view"\n')
    authenticator = Authenticator(TokenFile(path).credentials, lambda: 1e9)
    wire = Wire(authenticator=authenticator)
    write(path, 'anonymous = "view"\n' + BOTH)
    assert wire.protocol.update_credentials(TokenFile(path).credentials) == []
    write(path, BOTH)
    assert wire.protocol.update_credentials(TokenFile(path).credentials) == wire.clients
    waiting = wire.protocol.connect(wire.now)  # who has not said who it is has time to
    assert wire.protocol.update_credentials(TokenFile(path).credentials) == []
    assert waiting in client_ids(wire.protocol)


def test_a_secret_is_withdrawn_like_a_token(path: Path) -> None:
    def secret(value: str) -> str:
        return f'[tokens.lab]\nrole = "admin"\nsecret = "{value}"\n'

    write(path, secret(ONE))
    authenticator = Authenticator(TokenFile(path).credentials, lambda: NOW)
    wire = Wire(2, authenticator=authenticator)
    for place, level in enumerate(("admin", "view")):
        wire.send(signed(ONE, level=level), place)
    assert [c.access.role for c in wire.protocol.connections if c.access] == [Role.ADMIN, Role.VIEW]
    assert wire.protocol.update_credentials(TokenFile(path).credentials) == []
    write(path, secret(TWO))
    assert wire.protocol.update_credentials(TokenFile(path).credentials) == wire.clients


def test_without_a_gate_there_is_nothing_to_renew() -> None:
    with pytest.raises(ValueError, match="without an authenticator"):
        Wire().protocol.update_credentials(Credentials())


@in_a_loop
async def test_a_connection_ends_when_its_token_is_taken_out_of_the_file(path: Path) -> None:
    file = TokenFile(path)
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


def test_a_watch_that_is_told_to_hurry_looks_at_once(path: Path) -> None:
    rings: list[Credentials] = []
    watch = TokenWatch(TokenFile(path), rings.append, interval=3600)
    write(path, text(("two", TWO)))
    watch.check_now()
    while not rings:
        os.sched_yield()
    watch.close()
    assert rings[0].find(ONE) is None
