"""``farsteer serve`` with tokens, encryption and an audit log, and the operator that brings a token."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import ssl
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from localization.maps.cloud import Cloud
from robot_sim import World
from robot_sim.errors import CameraError
from teleop.__main__ import main
from teleop.errors import SettingError
from teleop.operator.operate import client_for
from teleop.operator.operate_config import OperateConfig
from teleop.robot.audit.audit_file import AuditError
from teleop.robot.serve import serve
from teleop.robot.serving.address import Address
from teleop.robot.serving.greeting import greeting
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.serving.server_setup import ROLES, address_of
from teleop.rosbridge import Client, Role, Server
from teleop.rosbridge.errors import ServerError, ServiceCallError
from teleop.scene_clouds import scene_cloud_path
from tests.teleop.robot.served_robots import (
    ADMIN,
    DRIVER,
    OTHER,
    TOKENS,
    VIEWER,
    Serving,
    audited,
    signed_in,
    tokens,
)
from tests.teleop.rosbridge.auth.test_authentication import certificate
from tests.teleop.rosbridge.server.test_server import until
from tests.teleop.support import ROOT, in_a_loop


@in_a_loop
async def test_commands_are_audited_line_by_line_without_secrets(
    serving: Serving, tmp_path: Path
) -> None:
    async with signed_in(serving, tmp_path, DRIVER) as (server, (driver,)):
        await driver.advertise("/cmd_vel", "geometry_msgs/Twist")
        await driver.advertise("/initialpose", "geometry_msgs/PoseWithCovarianceStamped")
        for speed in (0.0, 0.5, 0.5, 0.5, 0.25):
            await driver.publish("/cmd_vel", {"linear": {"x": speed}})
            await driver.call("/sim/step", {"ticks": 2})
        hint = {"header": {"frame_id": "map"}, "pose": {"pose": {"position": {"x": 500.0}}}}
        hint["pose"]["pose"]["orientation"] = {"w": 1.0}  # type: ignore[index]
        await driver.publish("/initialpose", hint)
        await driver.call("/localization/relocalize")
        async with Client(server.url, token=VIEWER) as viewer:
            await viewer.call("/teleop/estop")
        await driver.publish("/cmd_vel", {"linear": {"x": 0.5}})
        await driver.call("/sim/step", {"ticks": 1})
    text = (tmp_path / "audit.jsonl").read_text()
    begin, *events = audited(tmp_path)
    assert (begin["what"], begin["scene"]) == ("begin", "office")
    assert [(line["what"], line.get("holder")) for line in events] == [
        ("connected", "driver"),
        *[("drive", "driver")] * 3,  # the same wish again is no news
        ("hint", "driver"),
        ("relocalize", "driver"),
        ("connected", "viewer"),
        ("e-stop", "viewer"),
        ("disconnected", "viewer"),
        ("drive", "driver"),
        ("hint answered", "driver"),
        ("disconnected", "driver"),
    ]
    drives = [line for line in events if line["what"] == "drive"]
    assert [line["forward"] for line in drives] == [0.0, 0.5, 0.25, 0.5]
    assert [line["stamp"] for line in drives[:3]] == [20_000_000, 60_000_000, 180_000_000]
    assert "is latched" in drives[3]["refused"]
    assert "refused" not in drives[0]
    (placed,) = (line for line in events if line["what"] == "hint")
    assert (placed["position"], placed["sigmas"]) == ([500.0, 0.0, 0.0], [0.0] * 6)
    (answered,) = (line for line in events if line["what"] == "hint answered")
    assert answered["verdict"] == "rejected"
    assert "map" in answered["reason"]
    assert all(line["client"].startswith("client ") for line in events)
    assert all("127.0.0.1:" in line["client"] and "+00:00" in line["time"] for line in events)
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
async def test_rejected_operations_are_audited(serving: Serving, tmp_path: Path) -> None:
    async with signed_in(serving, tmp_path) as (server, _):
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
    lines = audited(tmp_path)
    for holder, token in (("driver", DRIVER), ("viewer", VIEWER)):
        events = [line for line in lines if line["what"] == "refused" and line["holder"] == holder]
        tried = [(operation, why) for who, operation, why in ATTEMPTS if who == token]
        for line, (operation, why) in zip(events, tried, strict=False):
            assert line["op"] == operation["op"]
            assert line["name"] in operation.values()
            assert why in line["refused"]
        unread = events[len(tried) :]  # and nothing of the subscription
        assert [line["refused"][:9] for line in unread] == ["not JSON:"]
        assert "op" not in unread[0]


@in_a_loop
async def test_estop_is_reset_by_its_token_or_an_admin_only(
    serving: Serving, tmp_path: Path
) -> None:
    async with signed_in(serving, tmp_path, OTHER) as (server, (other,)):
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
    resets = [line for line in audited(tmp_path) if line["what"] == "e-stop reset"]
    assert ["refused" in line for line in resets] == [True, False, False, False]


@in_a_loop
async def test_removing_a_token_from_the_file_disconnects_its_client(
    serving: Serving, tmp_path: Path
) -> None:
    async with signed_in(serving, tmp_path, OTHER) as (server, (other,)):
        driver = Client(server.url, token=DRIVER, reconnect=False)
        await driver.connect()
        await driver.call("/teleop/take_over")
        (tmp_path / "tokens.toml").write_text(
            TOKENS.replace(DRIVER, "some-other-token-of-the-driver")
        )
        os.kill(os.getpid(), signal.SIGHUP)  # it would be seen within two seconds anyway
        await until(lambda: not driver.connected)
        await driver.close()
        await other.call("/sim/step", {"ticks": 1})
        assert other.connected
    lines = audited(tmp_path)
    (read,) = (line for line in lines if line["what"] == "tokens read again")
    (name,) = (
        line["client"]
        for line in lines
        if line["what"] == "disconnected" and line["holder"] == "driver"
    )
    assert read["disconnected"] == [name]


@in_a_loop
async def test_operator_authenticates_at_an_encrypted_robot(
    serving: Serving, office: World, office_cloud: Cloud, tmp_path: Path
) -> None:
    crt, key = certificate(tmp_path)
    secret = tmp_path / "token"
    secret.write_text(f"{DRIVER}\n")
    config = ServeConfig(tokens=tokens(tmp_path), tls_cert=crt, tls_key=key)
    async with serving(config) as server:
        operator = OperateConfig(server.url, scene_cloud_path("office"), token=secret, ca=crt)
        async with client_for(operator) as client:
            assert (await client.call("/teleop/estop"))["success"]
        text = greeting(server, office, office_cloud, scene_cloud_path("office"), config)
        assert server.url in text
        assert "warning" not in text
        assert DRIVER not in text


@pytest.mark.slow
@in_a_loop
async def test_report_of_the_link_trusts_the_certificate_that_it_is_given(
    serving: Serving, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    crt, key = certificate(tmp_path)
    async with serving(ServeConfig(tls_cert=crt, tls_key=key)) as server:
        words = ["link", "report", server.url, "--seconds", "1"]
        assert await asyncio.to_thread(main, words) == 2
        refused = "is not trusted: self-signed certificate; give the certificate of its issuer, as --ca FILE"
        assert refused in capsys.readouterr().err
        elsewhere = server.url.replace("127.0.0.1", "localhost")
        assert await asyncio.to_thread(main, [*words[:2], elsewhere, "--ca", str(crt)]) == 2
        assert "call it as its certificate does" in capsys.readouterr().err
        assert await asyncio.to_thread(main, [*words, "--ca", str(crt)]) == 0
    assert "commands " in capsys.readouterr().out


def test_invalid_token_or_certificate_is_rejected(tmp_path: Path) -> None:
    file = tmp_path / "file"
    base = OperateConfig("wss://127.0.0.1:1", file)
    file.write_text("a token", encoding="utf-16")  # as PowerShell's > writes it
    with pytest.raises(SettingError, match=r"cannot read the token of .*file: it is no text"):
        client_for(replace(base, token=file))
    with pytest.raises(SettingError, match="holds no certificate"):
        client_for(replace(base, ca=file))
    with pytest.raises(SettingError, match="needs both"):
        ServeConfig(tls_cert=file)


@pytest.mark.parametrize(
    ("host", "guarded", "encrypted", "warning"),
    [
        ("127.0.0.1", False, False, ""),
        ("::1", False, False, ""),
        ("0.0.0.0", False, False, "anybody who reaches this address can drive the robot"),
        ("0.0.0.0", False, True, "anybody who reaches this address can drive the robot"),
        ("0.0.0.0", True, False, "tokens can be read on their way"),
        ("0.0.0.0", True, True, ""),
    ],
)
def test_listening_beyond_loopback_prints_a_warning(
    host: str,
    guarded: bool,
    encrypted: bool,
    warning: str,
    office: World,
    office_cloud: Cloud,
    tmp_path: Path,
) -> None:
    from teleop.ros_types import registry
    from teleop.rosbridge import Authenticator, Protocol, read_credentials

    gate = (
        Authenticator(read_credentials(tokens(tmp_path), ROLES), lambda: 0.0) if guarded else None
    )
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER) if encrypted else None
    server = Server(Protocol(registry(), authenticator=gate), host, tls=tls)
    address, map_path = address_of(server), scene_cloud_path("office")
    text = greeting(address, office, office_cloud, map_path, ServeConfig())
    assert ("warning" in text) == bool(warning)
    assert warning in text


def test_greeting_fits_a_small_terminal_and_ends_with_the_address_of_the_page(
    office: World, office_cloud: Cloud
) -> None:
    address = Address(
        "ws://127.0.0.1:9090",
        "127.0.0.1",
        9090,
        False,
        False,
        True,
        True,
        "http://127.0.0.1:9090/streams",
    )
    config = ServeConfig(link=("delay=0.1",), max_age=0.0, slow_age=0.0)
    text = greeting(address, office, office_cloud, scene_cloud_path("office"), config)
    assert sum(1 + len(line) // 80 for line in text.splitlines()) <= 23
    assert "http://127.0.0.1:9090/ " in text.splitlines()[-1]


def test_documentation_lists_the_rules_of_each_role() -> None:
    page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    for act in ("subscribe", "publish", "call", "provide"):
        (row,) = re.findall(rf"^\| `{act}` \|(.*)\|$", page, re.MULTILINE)
        for cell, role in zip(row.split("|"), Role, strict=True):
            assert tuple(re.findall("`(.+?)`", cell)) == getattr(ROLES[role], act)


def test_view_role_may_only_latch_the_estop() -> None:
    rules = ROLES[Role.VIEW]
    assert rules.allow("call", "/teleop/estop")
    assert rules.allow("call", "/teleop/link")
    for service in (
        *("/teleop/estop_reset", "/teleop/take_over", "/teleop/give", "/sim/step"),
        *("/localization/preview_hint", "/localization/relocalize"),
    ):
        assert not rules.allow("call", service)
    for topic in ("/joy", "/unity/joy", "/cmd_vel", "/initialpose"):
        assert not rules.allow("publish", topic)


@pytest.mark.long
@pytest.mark.slow
@in_a_loop
async def test_unusable_settings_are_reported_before_listening(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    for config, why in (
        (ServeConfig(camera="kinetc"), "kinetc.*kinect"),
        (ServeConfig(camera="kinetc", lockstep=True), "kinetc.*kinect"),
        (ServeConfig(audit=Path("/dev/full")), "cannot write the audit log /dev/full: No space"),
        (ServeConfig(origins=("lab.example",)), "'lab.example' is not a valid origin"),
    ):
        with pytest.raises((ServerError, AuditError, CameraError), match=why):
            await serve(office, office_cloud, replace(config, port=0), cache=cache)
