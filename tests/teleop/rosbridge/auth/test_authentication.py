"""Tokens and certificates on real sockets."""

from __future__ import annotations

import asyncio
import datetime
import ipaddress
import json
import logging
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from teleop.rosbridge import (
    Authenticator,
    Client,
    Keepalive,
    Protocol,
    Role,
    Server,
    serve_rosapi,
    tls_context,
)
from teleop.rosbridge.auth.credentials import Credential, Credentials, token_digest
from teleop.rosbridge.errors import ClientError, ServerError, ServiceCallError
from teleop.rosbridge.limits import ClientLimits
from tests.teleop.rosbridge.auth.test_permissions import TOKENS, credentials
from tests.teleop.rosbridge.server.test_http_pages import fetch
from tests.teleop.rosbridge.server.test_server import in_a_loop, until
from tests.teleop.rosbridge.support import REGISTRY, client_ids

VIEW, OPERATE = TOKENS[Role.VIEW], TOKENS[Role.OPERATE]
GUESS = "what-somebody-guessed"


@asynccontextmanager
async def guarded(
    anonymous: Role | None = None, limits: ClientLimits | None = None, **options: Any
) -> AsyncIterator[Server]:
    gate = Authenticator(credentials(anonymous), lambda: 1e9)
    protocol = Protocol(REGISTRY, limits=limits or ClientLimits.unhurried(), authenticator=gate)
    serve_rosapi(protocol)
    async with Server(protocol, port=0, **options) as server:
        server.pages.add_file("/map.ply", b"a map")
        yield server


async def role(connection: ClientConnection) -> str:
    """Return the status that the server sends for a publication."""
    await connection.send('{"op":"advertise","topic":"/x","type":"std_msgs/String","id":"a"}')
    await connection.send('{"op":"call_service","service":"/rosapi/topics","id":"b"}')
    return str(json.loads(await connection.recv()).get("msg", "may publish"))


@in_a_loop
async def test_tokens_are_accepted_in_url_header_and_operation() -> None:
    async with guarded() as server:
        quoted = VIEW.replace(" ", "%20")
        async with connect(f"{server.url}/?token={quoted}", proxy=None) as by_url:
            assert "role view may not publish" in await role(by_url)
        header = {"Authorization": f"Bearer {OPERATE}"}
        async with connect(server.url, additional_headers=header, proxy=None) as by_header:
            assert await role(by_header) == "may publish"
        async with connect(server.url, proxy=None) as by_operation:
            assert "authentication with a token is required" in await role(by_operation)
            await by_operation.recv()  # the rejection of the call
            await by_operation.send(json.dumps({"op": "auth", "token": OPERATE}))
            assert await role(by_operation) == "may publish"
        async with Client(server.url, token=OPERATE) as client:
            assert await client.call("/rosapi/topics")
            with pytest.raises(ServiceCallError, match="operate may not call /rosapi/set_param"):
                await client.call("/rosapi/set_param", {"name": "/a", "value": "1"})


@in_a_loop
async def test_a_token_of_any_letters_is_taken_as_utf_8_from_the_header() -> None:
    token = "Łukasz' geheimer Schlüssel"
    async with guarded() as server:
        access = credentials().keys[0].access
        server.protocol.update_credentials(Credentials((Credential(access, token_digest(token)),)))
        header = f"Bearer {token}".encode().decode("iso-8859-1")  # http.client encodes it so
        assert (await fetch(server, "/map.ply", authorization=header))[0] == 200


@in_a_loop
async def test_wrong_tokens_are_rejected_in_the_handshake() -> None:
    async with guarded() as server:
        for url, header in (
            (f"{server.url}/?token={GUESS}", {}),
            (f"{server.url}/?token=", {}),
            (server.url, {"Authorization": f"Bearer {GUESS}"}),
        ):
            with pytest.raises(InvalidStatus) as refused:
                await connect(url, additional_headers=header, proxy=None)
            assert refused.value.response.status_code == 401
        with pytest.raises(ClientError, match="does not accept this client's token"):
            await Client(server.url, token=GUESS).connect()
        assert len(server.protocol.connections) == 0
        with pytest.raises(ClientError, match="this client: authentication with a token is "):
            await Client(server.url).connect()


@pytest.mark.slow
@in_a_loop
async def test_clients_without_auth_are_disconnected_after_the_timeout() -> None:
    async with (
        guarded(keepalive=Keepalive(auth_timeout=1.0)) as server,
        connect(server.url, proxy=None) as silent,
        connect(server.url, proxy=None) as known,
    ):
        await known.send(json.dumps({"op": "auth", "token": VIEW}))
        with pytest.raises(ConnectionClosed):
            await silent.recv()
        assert (silent.close_code, silent.close_reason) == (1008, "no auth within 1 s")
        assert "may not publish" in await role(known)


@in_a_loop
async def test_unauthenticated_clients_cannot_block_those_with_tokens() -> None:
    async with guarded(limits=ClientLimits(clients=10)) as server:
        addresses = [(f"127.0.0.{number}", 0) for number in range(2, 10)]
        strangers = [await connect(server.url, proxy=None, local_addr=one) for one in addresses]
        with pytest.raises(InvalidStatus) as refused:
            await connect(server.url, proxy=None, local_addr=addresses[0])
        assert refused.value.response.status_code == 503
        async with Client(server.url, token=VIEW) as client:
            assert await client.call("/rosapi/topics")
        await asyncio.gather(*(stranger.close() for stranger in strangers))


@in_a_loop
async def test_files_require_a_token_and_health_and_public_ones_do_not() -> None:
    async with guarded() as server:
        server.pages.add_file("/", b"a page", public=True)
        for path, token, expected in (
            ("/healthz", "", 200),
            ("/version", "", 200),
            ("/", "", 200),
            ("/?x=1", "", 200),
            ("/map.ply", "", 401),
            ("/nothing", "", 401),
            ("/map.ply", GUESS, 401),
            ("/healthz", GUESS, 401),
            ("/", GUESS, 401),
            ("/map.ply", VIEW, 200),
        ):
            given = {"authorization": f"Bearer {token}"} if token else {}
            status, headers, _ = await fetch(server, path, **given)
            assert (status, headers.get("www-authenticate") == "Bearer") == (
                expected,
                expected == 401,
            ), (path, token)


@in_a_loop
async def test_tokens_are_neither_logged_nor_sent() -> None:
    records: list[str] = []

    class Ear(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            records.append(record.getMessage() + str(record.exc_info))

    ear, root = Ear(), logging.getLogger()
    root.addHandler(ear)
    level, root.level = root.level, logging.DEBUG
    try:
        async with guarded() as server:
            for token in (GUESS, OPERATE):
                client = Client(f"{server.url}/?token={token.replace(' ', '%20')}")
                try:
                    async with client:
                        assert token == OPERATE
                        records.append(str(client_ids(server.protocol)))
                        records.append(str(await client.call("/rosapi/nodes")))
                except ClientError as error:
                    records.append(str(error))
                records.append(client.url)
            async with connect(server.url, proxy=None) as stranger:
                await stranger.send(json.dumps({"op": "auth", "id": 1, "token": [OPERATE]}))
                records.append(str(await stranger.recv()))
                await stranger.send(json.dumps({"op": "auth", "token": GUESS}))
                await until(lambda: stranger.close_code is not None)
                records.append(stranger.close_reason or "")
    finally:
        root.removeHandler(ear)
        root.level = level
    said = "\n".join(records).replace("%20", " ")
    assert "a token is required" in said
    assert GUESS not in said
    assert OPERATE not in said


def certificate(folder: Path, name: str = "server") -> tuple[Path, Path]:
    """Write a self-signed certificate of this machine and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    whose = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "robot")])
    begin = datetime.datetime(2020, 1, 1, tzinfo=datetime.UTC)
    signed = (
        x509.CertificateBuilder()
        .subject_name(whose)
        .issuer_name(whose)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begin)
        .not_valid_after(begin + datetime.timedelta(days=40_000))
        .add_extension(
            x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), False
        )
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), True)
        .sign(key, hashes.SHA256())
    )
    paths = folder / f"{name}.crt", folder / f"{name}.key"
    paths[0].write_bytes(signed.public_bytes(serialization.Encoding.PEM))
    paths[1].touch(mode=0o600)
    paths[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return paths


@in_a_loop
async def test_tls_clients_connect_if_they_trust_the_certificate(tmp_path: Path) -> None:
    crt, key = certificate(tmp_path)
    trust = ssl.create_default_context(cafile=str(crt))
    async with guarded(tls=tls_context(crt, key)) as server:
        assert server.encrypted
        assert server.url.startswith("wss://")
        server.protocol.topics.advertise("/cloud", "sensor_msgs/CompressedImage")
        async with Client(server.url, token=VIEW, tls=trust) as client:
            received: asyncio.Queue[Any] = asyncio.Queue()
            await client.subscribe(
                "/cloud", "sensor_msgs/CompressedImage", received.put_nowait, compression="cbor"
            )
            await client.call("/rosapi/topics")
            server.protocol.topics.publish(
                "/cloud", {"data": bytes(range(256)) * 10_000}, server.now
            )
            assert bytes((await received.get())["data"]) == bytes(range(256)) * 10_000
        with pytest.raises(ClientError, match="is not trusted: self-signed certificate"):
            await Client(server.url, token=VIEW).connect()
        with pytest.raises(ClientError, match=r"is not a rosbridge server: .*; is it at wss://\?"):
            await Client(server.url.replace("wss:", "ws:"), token=VIEW).connect()
        async with guarded() as plain:
            with pytest.raises(ClientError, match=r"has no TLS in common .*; is it at ws://\?"):
                await Client(plain.url.replace("ws:", "wss:"), token=VIEW).connect()
        old = ssl.create_default_context(cafile=str(crt))
        with pytest.warns(DeprecationWarning, match="TLSv1_1"):
            old.minimum_version = old.maximum_version = ssl.TLSVersion.TLSv1_1
        with pytest.raises(ClientError, match="has no TLS in common with this client"):
            await Client(server.url, token=VIEW, tls=old).connect()
        async with Client(server.url, token=VIEW, tls=trust) as client:
            assert await client.call("/rosapi/topics")


def test_certificate_errors_are_one_line(tmp_path: Path) -> None:
    crt, key = certificate(tmp_path)
    _, other = certificate(tmp_path, "other")
    text = tmp_path / "text"
    text.write_text("no certificate")
    locked = tmp_path / "locked.key"
    locked.write_bytes(
        serialization.load_pem_private_key(key.read_bytes(), None).private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.BestAvailableEncryption(b"passphrase"),
        )
    )
    locked.chmod(0o600)
    text.chmod(0o600)
    for files, why in (
        ((crt, tmp_path / "none"), "cannot read the TLS key .*none: No such file"),
        ((tmp_path / "none", key), "cannot read the TLS certificate .*none: No such file"),
        ((crt, other), "do not match"),
        ((crt, text), "are not PEM files"),
        ((text, key), "are not PEM files"),
        ((crt, locked), "has a passphrase"),
    ):
        with pytest.raises(ServerError, match=why) as raised:
            tls_context(*files)
        assert "\n" not in str(raised.value)
    key.chmod(0o644)
    with pytest.raises(ServerError, match=r"accessible to others: chmod 600 server\.key"):
        tls_context(crt, key)


@pytest.mark.parametrize(
    "origin",
    ["lab.example", "https://lab.example/", "https://Lab.example", "https://", "*", "null", ""],
)
def test_invalid_origins_are_rejected(origin: str) -> None:
    with pytest.raises(ServerError, match=r"is not a valid origin such as https://lab\.example"):
        Server(Protocol(REGISTRY), origins=(origin,))
