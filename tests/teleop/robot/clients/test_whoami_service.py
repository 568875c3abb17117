"""The service ``/teleop/session``, with and without tokens."""

from __future__ import annotations

from pathlib import Path

import pytest

from teleop.robot.serving.serve_config import ServeConfig
from teleop.rosbridge import Client
from tests.teleop.robot.served_robots import ADMIN, DRIVER, VIEWER, Serving, signed_in, tokens
from tests.teleop.support import Robots, arm, in_a_loop, peer

RIGHTS = ("may_drive", "may_stop", "may_reset", "may_hint", "may_search", "may_take_over")
SESSION = "/teleop/session"


@in_a_loop
async def test_client_without_tokens_learns_its_number_name_and_all_rights(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as first, peer(rig.server.url) as client:
        await client.subscribe("/teleop/state")
        good, session = await client.ask(SESSION)
        assert good
        assert (session["role"], session["tokens"]) == ("admin", False)
        assert all(session[right] for right in RIGHTS)
        other = (await first.ask(SESSION))[1]
        assert {session["client"], other["client"]} == {1, 2}
        assert session["name"] != other["name"]
        await arm(client)
        await client.step(5)
        assert client.last("/teleop/state")["controller"] == session["name"]


@in_a_loop
async def test_rights_in_a_session_are_those_of_the_token(serving: Serving, tmp_path: Path) -> None:
    async with signed_in(serving, tmp_path, VIEWER, DRIVER, ADMIN) as (_, clients):
        found = [await client.call(SESSION) for client in clients]
    assert [session["role"] for session in found] == ["view", "operate", "admin"]
    assert all(session["tokens"] for session in found)
    assert [right for right in RIGHTS if found[0][right]] == ["may_stop"]
    assert all(session[right] for session in found[1:] for right in RIGHTS)


@pytest.mark.parametrize(
    ("rules", "rights"),
    [
        (
            'publish = ["/cmd_vel"]\ncall = ["*", "!/teleop/estop*"]',
            ["may_drive", "may_search", "may_take_over"],
        ),
        ('publish = ["/joy"]\ncall = ["/teleop/session"]', ["may_drive"]),
        ('publish = ["/turtle_control"]\ncall = ["/teleop/session"]', ["may_drive"]),
        ('publish = []\ncall = ["/move", "/teleop/session"]', ["may_drive"]),
        ('publish = ["/initialpose"]\ncall = ["/teleop/session"]', ["may_hint"]),
    ],
)
@in_a_loop
async def test_rights_in_a_session_follow_the_rules_of_the_token_file(
    serving: Serving, tmp_path: Path, rules: str, rights: list[str]
) -> None:
    path = tokens(tmp_path)
    path.write_text(path.read_text() + f"[roles.operate]\n{rules}\n")
    async with (
        serving(ServeConfig(tokens=path)) as server,
        Client(server.url, token=DRIVER) as driver,
    ):
        session = await driver.call(SESSION)
    assert [right for right in RIGHTS if session[right]] == rights
