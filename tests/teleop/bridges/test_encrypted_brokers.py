"""Brokers behind TLS, and brokers that ask for a login: Tansu behind a link that ends TLS, since it offers none itself."""

from __future__ import annotations

import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from teleop.bridges.broker_check import why_unusable
from teleop.bridges.broker_options import BrokerOptions
from tests.teleop.bridges.kafka.support import bridge, until
from tests.teleop.bridges.rest.support import JSON, glasses as headset, proxy
from tests.teleop.bridges.support import Broker, Link, broker, free_port, robot
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.support import in_a_loop


@asynccontextmanager
async def encrypted(
    folder: Path, *, asks_client: bool = False
) -> AsyncIterator[tuple[Broker, BrokerOptions]]:
    """Run a broker whose clients must come by TLS; yield it with the options that reach it."""
    paths, port = certificate(folder, "broker"), free_port()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*paths)
    if asks_client:
        context.verify_mode = ssl.CERT_REQUIRED
        context.load_verify_locations(certificate(folder, "client")[0])
    with broker(folder, advertised=port) as tansu:
        async with Link(tansu.port, port, tls=context):
            yield tansu, BrokerOptions(tansu.address, tls=True, broker_ca=paths[0])


@in_a_loop
async def test_commands_pass_bridge_and_proxy_by_tls(topic: str, tmp_path: Path) -> None:
    async with (
        encrypted(tmp_path) as (_, options),
        robot() as steps,
        bridge(options, steps.server.url, topic, tmp_path) as running,
        proxy(options) as server,
        headset(server.url) as glasses,
    ):
        await running.reads()
        body = '{"records": [{"value": {"distance": 0.5, "movement": "up"}}]}'
        status, _, answer = await glasses.ask(
            f"POST /topics/{topic}", body, f"Content-Type: {JSON}"
        )
        assert (status, answer["offsets"][0]["offset"]) == (200, 0)
        await until(lambda: steps.ended == [0.5], running.task)


@in_a_loop
async def test_a_client_logs_in_by_its_certificate(topic: str, tmp_path: Path) -> None:
    async with encrypted(tmp_path, asks_client=True) as (_, options), robot() as steps:
        assert "--client-cert and --client-key" in str(await why_unusable(options))
        own = replace(
            options, client_cert=tmp_path / "client.crt", client_key=tmp_path / "client.key"
        )
        assert await why_unusable(own) is None
        async with bridge(own, steps.server.url, topic, tmp_path) as running:
            await running.reads()


@pytest.mark.slow
@in_a_loop
async def test_a_broker_that_is_not_reached_is_explained_in_a_line_with_what_would_help(
    topic: str, tmp_path: Path
) -> None:
    other = certificate(tmp_path, "other")[0]
    async with encrypted(tmp_path) as (tansu, right), robot() as steps:
        at = right.brokers
        named = replace(right, brokers=at.replace("127.0.0.1", "localhost"))
        plain = BrokerOptions(tansu.direct, tls=True)
        for options, words in (
            (replace(right, broker_ca=other), ("not trusted", "--broker-ca", f"not {other}")),
            (replace(right, broker_ca=None), ("not trusted", "--broker-ca")),
            (named, ("localhost", "as its certificate does")),
            (BrokerOptions(at), (f"{at} speaks TLS: add --tls",)),
            (plain, ("does not answer by TLS: leave --tls out",)),
            (BrokerOptions(f"127.0.0.1:{free_port()}"), ("refused",)),
        ):
            line = str(await why_unusable(options))
            assert all(part in line for part in words), line
            assert "\n" not in line
        async with bridge(BrokerOptions(at), steps.server.url, topic, tmp_path) as running:
            await running.says("no broker at")
            assert f"{at} speaks TLS: add --tls" in running.said[0]


@pytest.mark.slow
@pytest.mark.parametrize("mechanism", ["PLAIN", "SCRAM-SHA-256"])
@in_a_loop
async def test_a_login_that_is_refused_ends_nothing_and_is_said_in_a_line(
    topic: str, tmp_path: Path, mechanism: str
) -> None:
    password = tmp_path / "password"
    password.write_text("s3cret\n")
    with broker(tmp_path, logins=True) as tansu:
        options = BrokerOptions(
            tansu.address,
            sasl=mechanism,  # type: ignore[arg-type]
            sasl_user="robot",
            sasl_password_file=password,
        )
        async with (
            robot() as steps,
            bridge(options, steps.server.url, topic, tmp_path) as running,
        ):
            await running.says("no broker at")
            (line,) = running.said
            if mechanism != "PLAIN":  # which Tansu does not have: it closes the connection
                assert "refuses the login" in line
            assert "s3cret" not in line
            assert not running.task.done()
