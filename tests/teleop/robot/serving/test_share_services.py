"""Sharing a robot of ``--lan``: links, tokens of devices, their list and their end."""

from __future__ import annotations

import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from teleop.robot.serving.lan_access import LanAccess, lan_access
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge import Client
from teleop.rosbridge.errors import RosbridgeError, ServiceCallError
from tests.teleop.robot.served_robots import ADMIN, Serving, audited, tokens
from tests.teleop.support import in_a_loop

DRIVE = {"role": "operate", "seconds": 600.0, "name": ""}
WATCH = {"role": "view", "seconds": 600.0, "name": "for the class"}


@dataclass
class Shared:
    """A robot of ``--lan``, and what its terminal shows."""

    url: str
    access: LanAccess
    audit: Path

    def client(self, token: str) -> Client:
        tls = ssl.create_default_context(cafile=str(self.access.certificate))
        return Client(self.url, registry=registry(), token=token, tls=tls)

    async def device(self, link: str, name: str) -> str:
        """Open a link as a device; return the token that it is given."""
        async with self.client(link.partition("#token=")[2] or link) as client:
            assert (await client.call("/teleop/session"))["link"]
            answer = await client.call("/teleop/own_token", {"device": name})
            assert answer["success"], answer["message"]
            return str(answer["token"])

    async def admits(self, token: str) -> bool:
        try:
            async with self.client(token) as client:
                return not (await client.call("/teleop/session"))["link"]
        except RosbridgeError:
            return False


@asynccontextmanager
async def shared(serving: Serving, folder: Path) -> AsyncIterator[Shared]:
    audit = folder / "audit.jsonl"
    config, access = lan_access(ServeConfig(lan=True, audit=audit), folder / "lan")
    async with serving(config) as server:
        yield Shared(f"wss://127.0.0.1:{server.port}", access, audit)


@pytest.mark.slow
@in_a_loop
async def test_each_device_of_a_link_has_its_own_token_and_is_shut_out_alone(
    serving: Serving, tmp_path: Path
) -> None:
    async with shared(serving, tmp_path) as robot:
        phone = await robot.device(robot.access.link, "Anna's phone")
        tablet = await robot.device(robot.access.link, "Anna's phone")
        async with robot.client(phone) as anna, robot.client(tablet) as other:
            listed = await anna.call("/teleop/tokens")
            assert listed["names"] == [
                "lan",
                "link of the terminal",
                "Anna's phone",
                "Anna's phone 2",
            ]
            assert not (await anna.call("/teleop/own_token", {"device": "x"}))["success"]
            own = await anna.call("/teleop/revoke_token", {"name": "Anna's phone"})
            assert not own["success"]
            admin = await anna.call("/teleop/revoke_token", {"name": "lan"})
            assert "lan has role admin, and you have operate" in admin["message"]
            assert (await anna.call("/teleop/revoke_token", {"name": "Anna's phone 2"}))["success"]
            with pytest.raises(RosbridgeError):
                await other.call("/teleop/session")
            assert [await robot.admits(token) for token in (phone, tablet)] == [True, False]
    lines = audited(tmp_path)
    told = [(line["what"], line.get("holder"), line.get("token")) for line in lines]
    assert ("own token", "link of the terminal", "Anna's phone 2") in told
    assert ("revoke", "Anna's phone", "Anna's phone 2") in told
    assert phone not in robot.audit.read_text()


@pytest.mark.slow
@in_a_loop
async def test_link_to_watch_has_an_end_and_its_devices_only_watch(
    serving: Serving, tmp_path: Path
) -> None:
    async with shared(serving, tmp_path) as robot:
        phone = await robot.device(robot.access.link, "Anna")
        async with robot.client(phone) as anna:
            link = await anna.call("/teleop/share", WATCH)
            assert link["link"].startswith("https://")
            assert link["qr"].startswith("data:image/svg+xml")
            guest = await robot.device(link["link"], "Guest")
            listed = await anna.call("/teleop/tokens")
            ends = dict(zip(listed["names"], listed["seconds"], strict=True))
            assert ends["Anna"] == -1.0
            assert 0.0 < ends["Guest"] <= ends["for the class"] <= 600.0
            async with robot.client(guest) as viewer:
                session = await viewer.call("/teleop/session")
                assert (session["role"], session["may_share"]) == ("view", False)
                for service in ("/teleop/share", "/teleop/tokens", "/teleop/revoke_token"):
                    with pytest.raises(ServiceCallError, match="role view may not call"):
                        await viewer.call(service, WATCH if service == "/teleop/share" else {})
                # An operator releases what a viewer has pressed, who could not itself.
                assert (await viewer.call("/teleop/estop"))["success"]
                assert (await anna.call("/teleop/estop_reset"))["success"]
                # Without the link those who came by it stay.
                await anna.call("/teleop/revoke_token", {"name": "for the class"})
                assert (await viewer.call("/teleop/session"))["role"] == "view"
            assert not await robot.admits(link["link"].partition("#token=")[2])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"role": "admin"}, "role must be view or operate, got 'admin'"),
        ({"seconds": 0.5}, "seconds must be from 1 to"),
        ({"seconds": 1e9}, "seconds must be from 1 to"),
    ],
)
@in_a_loop
async def test_link_that_cannot_be_is_refused_by_name(
    serving: Serving, tmp_path: Path, change: dict[str, object], words: str
) -> None:
    async with shared(serving, tmp_path) as robot, robot.client(robot.access.link) as client:
        answer = await client.call("/teleop/share", {**DRIVE, **change})
        assert not answer["success"]
        assert words in answer["message"]
        assert not answer["link"]


@in_a_loop
async def test_robot_with_a_file_of_its_owner_or_without_tokens_does_not_offer_to_share(
    serving: Serving, tmp_path: Path
) -> None:
    async with (
        serving(ServeConfig(tokens=tokens(tmp_path))) as server,
        Client(server.url, token=ADMIN) as client,
    ):
        assert not (await client.call("/teleop/session"))["may_share"]
        with pytest.raises(ServiceCallError, match="/teleop/share"):
            await client.call("/teleop/share", {})
