"""``farsteer serve`` with tokens, encryption and an audit log, and the operator that brings a token."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.operator.operate import OperateConfig
from teleop.robot.audit_file import AuditError
from teleop.robot.serve import ROLES, ServeConfig, greeting, serve
from teleop.rosbridge import Client, Role, Server
from teleop.rosbridge.errors import ServerError, ServiceCallError
from teleop.scenario.run import cloud_path
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.rosbridge.server.test_server import until
from tests.teleop.support import ROOT, command, in_a_loop, soon

DRIVER, OTHER, ADMIN, VIEWER = (f"{name}-of-whom-nobody-knows" for name in "doav")
TOKENS = f"""
[tokens.driver]
role = "operate"
token = "{DRIVER}"
[tokens.other]
role = "operate"
token = "{OTHER}"
[tokens.boss]
role = "admin"
token = "{ADMIN}"
[tokens.viewer]
role = "view"
token = "{VIEWER}"
"""


def tokens(folder: Path) -> Path:
    path = folder / "tokens.toml"
    path.touch(mode=0o600)
    path.write_text(TOKENS)
    return path


@asynccontextmanager
async def served(
    world: World, cloud: Cloud, cache: Path, config: ServeConfig
) -> AsyncIterator[Server]:
    """A robot in lockstep."""
    ready: asyncio.Future[Server] = asyncio.get_running_loop().create_future()
    stop = asyncio.Event()
    config = replace(config, port=0, lockstep=True)
    serving = asyncio.create_task(
        serve(world, cloud, config, cache=cache, ready=ready.set_result, stop=stop)
    )
    try:
        yield await soon(ready)
    finally:
        stop.set()
        await serving


@in_a_loop
async def test_what_is_done_to_the_robot_is_told_line_by_line_without_secrets(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    path = tmp_path / "audit.jsonl"
    config = ServeConfig(tokens=tokens(tmp_path), audit=path)
    async with (
        served(office, office_cloud, cache, config) as server,
        Client(server.url, token=DRIVER) as driver,
    ):
        await driver.advertise("/cmd_vel", "geometry_msgs/Twist")
        await driver.advertise("/initialpose", "geometry_msgs/PoseWithCovarianceStamped")
        for speed in (0.0, 0.5, 0.5, 0.5, 0.25):
            await driver.publish("/cmd_vel", {"linear": {"x": speed}})
            await driver.call("/sim/step", {"ticks": 2})
        hint = {"header": {"frame_id": "map"}, "pose": {"pose": {"position": {"x": 500.0}}}}
        hint["pose"]["pose"]["orientation"] = {"w": 1.0}  # type: ignore[index]
        await driver.publish("/initialpose", hint)
        async with Client(server.url, token=VIEWER) as viewer:
            await viewer.call("/teleop/estop")
        await driver.publish("/cmd_vel", {"linear": {"x": 0.5}})
        await driver.call("/sim/step", {"ticks": 1})
    text = path.read_text()
    lines: list[dict[str, Any]] = [json.loads(line) for line in text.splitlines()]
    begin, *told = lines
    assert (begin["what"], begin["scene"]) == ("begin", "office")
    assert [(line["what"], line.get("holder")) for line in told] == [
        ("connected", "driver"),
        *[("drive", "driver")] * 3,  # the same wish again is no news
        ("hint", "driver"),
        ("connected", "viewer"),
        ("e-stop", "viewer"),
        ("disconnected", "viewer"),
        ("drive", "driver"),
        ("hint answered", "driver"),
        ("disconnected", "driver"),
    ]
    drives = [line for line in told if line["what"] == "drive"]
    assert [line["forward"] for line in drives] == [0.0, 0.5, 0.25, 0.5]
    assert [line["stamp"] for line in drives[:3]] == [20_000_000, 60_000_000, 180_000_000]
    assert "is latched" in drives[3]["refused"]
    assert "refused" not in drives[0]
    (placed,) = (line for line in told if line["what"] == "hint")
    assert (placed["position"], placed["sigmas"]) == ([500.0, 0.0, 0.0], [0.0] * 6)
    (answered,) = (line for line in told if line["what"] == "hint answered")
    assert answered["verdict"] == "rejected"
    assert "map" in answered["reason"]
    assert all(line["client"].startswith("client ") for line in told)
    assert all("127.0.0.1:" in line["client"] and "+00:00" in line["time"] for line in told)
    assert not any(token in text for token in (DRIVER, VIEWER))


PUBLISH: dict[str, Any] = {"op": "publish"}
POSE = {"position": {"x": 1.0}, "orientation": {"w": 1.0}}
ATTEMPTS: tuple[tuple[str, dict[str, Any], str], ...] = (
    (DRIVER, {**PUBLISH, "topic": "/joy", "msg": {"axes": [0.5]}}, "must have 2 entries"),
    (DRIVER, {**PUBLISH, "topic": "/joy", "msg": {"axes": "full"}}, "requires a float32[]"),
    (DRIVER, {**PUBLISH, "topic": "/cmd_vel", "msg": {"linear": {"x": "1"}}}, "requires a float64"),
    (
        DRIVER,
        {"op": "advertise", "topic": "/cmd_vel", "type": "std_msgs/String"},
        "already established with type geometry_msgs/Twist",
    ),
    (
        DRIVER,
        {
            **PUBLISH,
            "topic": "/initialpose",
            "msg": {"header": {"frame_id": "odom"}, "pose": {"pose": POSE}},
        },
        "frame_id must be 'map'",
    ),
    (DRIVER, {**PUBLISH, "topic": "/odom", "msg": {}}, "published by the server only"),
    (DRIVER, {"op": "call_service", "service": "/sim/step", "args": {"tick": 1}}, "field tick"),
    (DRIVER, {"op": "fly", "topic": "/joy"}, "Unknown operation: fly"),
    (VIEWER, {**PUBLISH, "topic": "/cmd_vel", "msg": {}}, "role view may not publish"),
    (VIEWER, {"op": "call_service", "service": "/teleop/take_over"}, "view may not call"),
    (VIEWER, {"op": "send_action_goal", "action": "/dock"}, "view may not call"),
)


@in_a_loop
async def test_what_somebody_tried_to_do_to_the_robot_and_could_not_is_told_as_well(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    path = tmp_path / "audit.jsonl"
    config = ServeConfig(tokens=tokens(tmp_path), audit=path)
    async with served(office, office_cloud, cache, config) as server:
        for token in (DRIVER, VIEWER):
            headers = {"Authorization": f"Bearer {token}"}
            async with connect(server.url, additional_headers=headers) as client:
                for who, operation, _ in ATTEMPTS:
                    if who == token:
                        await client.send(json.dumps(operation))
                await client.send('{"op":"subscribe","topic":"/nobody/knows"}')
                await client.send('{"op":"publish","topic":"/joy","msg":')
                await client.send('{"op":"call_service","service":"/rosapi/get_time","id":"end"}')
                while json.loads(await client.recv()).get("id") != "end":
                    pass
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    for holder, token in (("driver", DRIVER), ("viewer", VIEWER)):
        told = [line for line in lines if line["what"] == "refused" and line["holder"] == holder]
        tried = [(operation, why) for who, operation, why in ATTEMPTS if who == token]
        for line, (operation, why) in zip(told, tried, strict=False):
            assert line["op"] == operation["op"]
            assert line["name"] in operation.values()
            assert why in line["refused"]
        unread = told[len(tried) :]  # and nothing of the subscription
        assert [line["refused"][:9] for line in unread] == ["not JSON:"]
        assert "op" not in unread[0]


@in_a_loop
async def test_the_e_stop_of_another_is_reset_by_an_admin_only(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    path = tmp_path / "audit.jsonl"
    config = ServeConfig(tokens=tokens(tmp_path), audit=path)
    async with (
        served(office, office_cloud, cache, config) as server,
        Client(server.url, token=OTHER) as other,
    ):
        async with Client(server.url, token=DRIVER) as driver:
            await driver.call("/teleop/estop")
            await other.call("/teleop/estop")
            with pytest.raises(ServiceCallError, match="driver stopped the robot"):
                await other.call("/teleop/estop_reset")
        async with Client(server.url, token=DRIVER) as driver:  # the same hand, come back
            assert (await driver.call("/teleop/estop_reset"))["success"]
            await driver.call("/teleop/estop")
        async with Client(server.url, token=ADMIN) as boss:
            assert (await boss.call("/teleop/estop_reset"))["success"]
        assert (await other.call("/teleop/estop_reset"))["success"]
        await other.call("/teleop/estop")
        async with Client(server.url, token=VIEWER) as viewer:
            with pytest.raises(ServiceCallError, match="role view may not call"):
                await viewer.call("/teleop/estop_reset")
    resets = [line for line in path.read_text().splitlines() if '"e-stop reset"' in line]
    assert ["refused" in line for line in resets] == [True, False, False, False]


@in_a_loop
async def test_a_token_taken_out_of_the_file_ends_its_connection_and_the_robot_brakes(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    path, log = tokens(tmp_path), tmp_path / "audit.jsonl"
    config = ServeConfig(tokens=path, audit=log)
    async with (
        served(office, office_cloud, cache, config) as server,
        Client(server.url, token=OTHER) as other,
    ):
        driver = Client(server.url, token=DRIVER, reconnect=False)
        await driver.connect()
        await driver.call("/teleop/take_over")
        path.write_text(TOKENS.replace(DRIVER, "some-other-token-of-the-driver"))
        os.kill(os.getpid(), signal.SIGHUP)  # it would be seen within two seconds anyway
        await until(lambda: not driver.connected)
        await driver.close()
        await other.call("/sim/step", {"ticks": 1})
        assert other.connected
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    (read,) = (line for line in lines if line["what"] == "tokens read again")
    (name,) = (
        line["client"]
        for line in lines
        if line["what"] == "disconnected" and line["holder"] == "driver"
    )
    assert read["disconnected"] == [name]


@in_a_loop
async def test_the_operator_brings_its_token_to_an_encrypted_robot(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path
) -> None:
    crt, key = certificate(tmp_path)
    secret = tmp_path / "token"
    secret.write_text(f"{DRIVER}\n")
    config = ServeConfig(tokens=tokens(tmp_path), tls_cert=crt, tls_key=key)
    async with served(office, office_cloud, cache, config) as server:
        operator = OperateConfig(server.url, cloud_path("office"), token=secret, ca=crt)
        async with operator.client() as client:
            assert (await client.call("/teleop/estop"))["success"]
        said = greeting(server, office, office_cloud, cloud_path("office"))
        assert server.url in said
        assert "warning" not in said
        assert DRIVER not in said


def test_a_token_or_a_certificate_that_is_none_is_told(tmp_path: Path) -> None:
    file = tmp_path / "file"
    base = OperateConfig("wss://127.0.0.1:1", file)
    for content in ("", "two\nlines", "ümlaut"):
        file.write_text(content, encoding="utf-8")
        with pytest.raises(ValueError, match="must hold a token"):
            replace(base, token=file).client()
    with pytest.raises(ValueError, match="holds no certificate"):
        replace(base, ca=file).client()
    with pytest.raises(ValueError, match="there is no certificate"):
        replace(base, ca=tmp_path / "none").client()
    with pytest.raises(ValueError, match="needs both"):
        ServeConfig(tls_cert=file)


@pytest.mark.parametrize(
    ("host", "guarded", "encrypted", "warning"),
    [
        ("127.0.0.1", False, False, ""),
        ("::1", False, False, ""),
        ("0.0.0.0", False, False, "anybody who reaches this address can drive the robot"),
        ("0.0.0.0", False, True, "anybody who reaches this address can drive the robot"),
        ("0.0.0.0", True, False, "tokens can be overheard"),
        ("0.0.0.0", True, True, ""),
    ],
)
def test_who_listens_to_others_is_warned_of_what_they_can_do(
    host: str,
    guarded: bool,
    encrypted: bool,
    warning: str,
    office: World,
    office_cloud: Cloud,
    tmp_path: Path,
) -> None:
    from teleop.interfaces import registry
    from teleop.rosbridge import Authenticator, Protocol, read_credentials

    gate = (
        Authenticator(read_credentials(tokens(tmp_path), ROLES), lambda: 0.0) if guarded else None
    )
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER) if encrypted else None
    server = Server(Protocol(registry(), authenticator=gate), host, tls=tls)
    said = greeting(server, office, office_cloud, cloud_path("office"))
    assert ("warning" in said) == bool(warning)
    assert warning in said


def test_the_documentation_has_what_each_role_may_do() -> None:
    page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    for act in ("subscribe", "publish", "call", "provide"):
        (row,) = re.findall(rf"^\| `{act}` \|(.*)\|$", page, re.MULTILINE)
        for cell, role in zip(row.split("|"), Role, strict=True):
            assert tuple(re.findall("`(.+?)`", cell)) == getattr(ROLES[role], act)


def test_a_viewer_may_stop_the_robot_and_nothing_more() -> None:
    rules = ROLES[Role.VIEW]
    assert rules.allow("call", "/teleop/estop")
    for service in ("/teleop/estop_reset", "/teleop/take_over", "/sim/step"):
        assert not rules.allow("call", service)
    for topic in ("/joy", "/unity/joy", "/cmd_vel", "/initialpose"):
        assert not rules.allow("publish", topic)


@in_a_loop
async def test_what_keeps_it_from_serving_is_told_before_it_listens(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    for config, why in (
        (ServeConfig(audit=Path("/dev/full")), "cannot write the audit log /dev/full: No space"),
        (ServeConfig(origins=("lab.example",)), "'lab.example' is not a valid origin"),
    ):
        with pytest.raises((ServerError, AuditError), match=why):
            await serve(office, office_cloud, replace(config, port=0), cache=cache)


@in_a_loop
async def test_the_command_tells_in_a_line_why_it_does_not_serve(tmp_path: Path) -> None:
    path = tokens(tmp_path)
    path.chmod(0o644)
    status, _, said = await command("serve", "--port", "0", "--tokens", str(path))
    assert status == 2
    assert "is accessible to others: chmod 600 tokens.toml" in said
    assert "Traceback" not in said
