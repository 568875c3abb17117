"""Names that clients give themselves: ``/teleop/introduce`` and ``/teleop/clients``, and where the names appear."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from teleop.robot.clients.name_services import clean_name
from tests.teleop.robot.served_robots import DRIVER, VIEWER, Serving, audited, signed_in
from tests.teleop.support import Peer, Robots, arm, in_a_loop, peer


async def introduce(client: Peer, name: str) -> dict[str, Any]:
    answer: dict[str, Any]
    good, answer = await client.ask("/teleop/introduce", name=name)
    assert good
    return answer


@in_a_loop
async def test_driver_and_who_asks_are_known_by_the_names_they_gave(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as anna, peer(rig.server.url) as other:
        await anna.subscribe("/teleop/state")
        assert (await introduce(anna, "Anna"))["name"] == "Anna"
        assert (await introduce(other, "anna"))["name"] == "anna 2"
        await arm(anna)
        await other.ask("/teleop/ask")
        await anna.step(5)
        state = anna.last("/teleop/state")
        assert (state["controller"], state["asking_name"]) == ("Anna", "anna 2")
        there = (await other.ask("/teleop/clients"))[1]
        assert set(there["names"]) == {"Anna", "anna 2"}
        assert (await other.ask("/teleop/session"))[1]["name"] == "anna 2"


@in_a_loop
async def test_driver_who_takes_a_name_has_to_take_the_robot_anew(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.subscribe("/teleop/state")
        await arm(client)
        await client.joy(1.0)
        await client.step(5)
        await introduce(client, "Anna")
        await client.step(5)
        assert client.last("/teleop/state")["controller"] == ""
        refused = await introduce(client, "Berta")
        assert not refused["success"]
        assert refused["name"] == "Anna"


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("  Zoë   O'Neil-2 ", "Zoë O'Neil-2"),
        ("<b>eve</b>\n\u202e(10.0.0.6:51234)", "beveb10.0.0.651234"),
        ("n" * 5000, "n" * 24),
        ("(\u0000)", ""),
    ],
)
def test_name_keeps_letters_and_digits_and_nothing_that_could_fake_a_line(
    given: str, kept: str
) -> None:
    assert clean_name(given) == kept


@in_a_loop
async def test_names_that_look_like_the_robots_own_are_refused(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        for name in ("Client 7 10.0.0.6", "\u0000"):
            assert not (await introduce(client, name))["success"]
        assert (await introduce(client, "clientele"))["success"]


@pytest.mark.slow
@in_a_loop
async def test_audit_has_number_address_and_name_from_then_on(
    serving: Serving, tmp_path: Path
) -> None:
    async with signed_in(serving, tmp_path, DRIVER, VIEWER) as (_, (driver, viewer)):
        await driver.call("/teleop/introduce", {"name": "Anna"})
        await viewer.call("/teleop/introduce", {"name": "Guest"})
        await driver.call("/teleop/take_over")
        there = await viewer.call("/teleop/clients")
        assert sorted(zip(there["names"], there["roles"], there["tokens"], strict=True)) == [
            ("Anna", "operate", "driver"),
            ("Guest", "view", "viewer"),
        ]
    lines = audited(tmp_path)
    taken = next(line for line in lines if line["what"] == "take-over")
    assert taken["client"].startswith("client 1 (127.0.0.1:")
    assert (taken["name"], taken["holder"]) == ("Anna", "driver")
    assert "named" in [line["what"] for line in lines]
