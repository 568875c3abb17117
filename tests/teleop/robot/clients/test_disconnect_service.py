"""``/teleop/disconnect_client`` over the socket: who may call it, for whom, and what that leaves."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect

from teleop.robot.serving.serve_config import ServeConfig
from teleop.rosbridge import Client
from teleop.rosbridge.errors import ServiceCallError
from tests.teleop.robot.served_robots import (
    ADMIN,
    DRIVER,
    OTHER,
    VIEWER,
    Serving,
    audited,
    signed_in,
    tokens,
)
from tests.teleop.support import Robots, in_a_loop, peer

SERVICE = "/teleop/disconnect_client"


async def number(client: Client) -> int:
    answer: int = (await client.call("/teleop/session"))["client"]
    return answer


async def last_words(connection: ClientConnection) -> str:
    await connection.wait_closed()
    assert connection.close_code == 1008
    return str(connection.close_reason)


@pytest.mark.slow
@in_a_loop
async def test_viewer_who_presses_for_fun_is_barred_with_a_reason_and_stands_in_the_audit(
    serving: Serving, tmp_path: Path
) -> None:
    path = tokens(tmp_path)
    path.write_text('anonymous = "view"\n' + path.read_text())
    config = ServeConfig(tokens=path, audit=tmp_path / "audit.jsonl")
    async with (
        serving(config) as server,
        Client(server.url, token=DRIVER) as driver,
        connect(server.url, proxy=None) as viewer,
    ):
        await viewer.send('{"op":"call_service","service":"/teleop/session","id":"s"}')
        session = json.loads(await viewer.recv())["values"]
        for _ in range(5):
            await viewer.send('{"op":"call_service","service":"/teleop/estop"}')
        for _ in range(5):
            assert json.loads(await viewer.recv())["result"] is True
        request = {"client": session["client"], "seconds": 600.0, "reason": "presses\nfor fun"}
        answer = await driver.call(SERVICE, request)
        assert answer["success"] is True
        assert answer["message"] == f"{session['name']} disconnected and barred for 600 s"
        words = "barred for another 600 s: presses for fun (driver)"
        assert await last_words(viewer) == words
        async with connect(server.url, proxy=None) as again:
            call = {"op": "call_service", "service": "/teleop/estop", "id": 1}
            await again.send(json.dumps(call))
            assert json.loads(await again.recv())["msg"] == f"call_service: {words}"
            await again.send(json.dumps({"op": "auth", "token": OTHER}))
            await again.send(json.dumps(call))
            assert json.loads(await again.recv())["result"] is True, "never the e-stop itself"
        async with Client(server.url, token=VIEWER) as other:
            assert (await other.call("/teleop/estop"))["success"] is True
    (line,) = [line for line in audited(tmp_path) if line["what"] == "disconnect"]
    assert (line["holder"], line["whom"], line["seconds"]) == ("driver", session["name"], 600.0)
    assert line["reason"] == "presses for fun"


@pytest.mark.slow
@in_a_loop
async def test_operators_bar_neither_themselves_nor_admins_and_viewers_bar_nobody(
    serving: Serving, tmp_path: Path
) -> None:
    bearers = (DRIVER, DRIVER, ADMIN, VIEWER)
    async with signed_in(serving, tmp_path, *bearers) as (_, (driver, twin, admin, viewer)):
        for target, seconds, why in (
            (await number(driver), 0.0, "that is you"),
            (await number(twin), 60.0, "has your own token"),
            (await number(admin), 60.0, "has role admin, and you have operate"),
            (99, 60.0, "there is no client 99"),
            (await number(viewer), -1.0, "seconds must be from 0 to 86400, got -1"),
        ):
            answer = await driver.call(SERVICE, {"client": target, "seconds": seconds})
            assert answer["success"] is False
            assert why in answer["message"]
        with pytest.raises(ServiceCallError, match="role view may not call"):
            await viewer.call(SERVICE, {"client": await number(driver), "seconds": 60.0})
        answer = await driver.call(SERVICE, {"client": await number(twin)})
        assert answer["success"] is True, (
            "without a bar, a second window of one's own can be closed"
        )


@in_a_loop
async def test_without_tokens_nobody_bars_the_own_address(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as first, peer(rig.server.url) as second:
        target = (await second.ask("/teleop/session"))[1]["client"]
        _, values = await first.ask(SERVICE, client=target, seconds=60.0)
        assert "has your own address" in values["message"]
        _, values = await first.ask(SERVICE, client=target)
        assert values["success"] is True
