"""A wire that carries scripts in its words, and anything in its fields: text stays text, and nothing moves."""

from __future__ import annotations

import asyncio
from pathlib import Path
from random import Random
from typing import Any

import pytest

from localization.maps.cloud import Cloud
from robot_sim import World
from tests.teleop.console.conftest import Pages
from tests.teleop.console.hands import hold_until, key, says
from tests.teleop.console.paced_robot import paced_robot
from tests.teleop.console.plain_robots import STANDARD, Message, Topics, console_for, suite_robot
from tests.teleop.console.rewriting_proxy import HOSTILE, rewriting, spoilt, with_hostile_names
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]

SIZE = {"width": 1120, "height": 600}
INJECTED = "document.querySelectorAll('img[src=x], svg[onload], body script').length"


@in_a_loop
async def test_scripts_in_names_and_reasons_stay_text(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path
) -> None:
    async with (
        paced_robot(office, office_cloud, cache) as robot,
        rewriting(f"ws://127.0.0.1:{robot.proxy.port}", with_hostile_names) as wire,
    ):
        with console_for(wire.url) as address:
            async with page_of(address, viewport=SIZE) as visit:
                page = visit.page
                await says(page, HOSTILE[:40], within=".page-bar")
                await page.keyboard.press("Escape")
                await says(page, "E-stop", within=".driving-status")
                await page.locator("summary", has_text="Session").first.click()
                await says(page, HOSTILE[:40], within=".page-right")
                await asyncio.sleep(1.0)
                assert await page.evaluate("window.hacked") is None
                assert await page.evaluate(INJECTED) == 0
                assert [v for v in visit.violations if "connect-src" not in v] == []


@pytest.mark.long
@in_a_loop
async def test_spoilt_fields_are_named_and_never_drive(
    page_of: Pages, office: World, office_cloud: Cloud, cache: Path
) -> None:
    chance = Random(14)

    def spoil(message: Any) -> Any:
        return spoilt(message, chance) if chance.random() < 0.3 else message

    async with (
        paced_robot(office, office_cloud, cache) as robot,
        rewriting(f"ws://127.0.0.1:{robot.proxy.port}", lambda message: message) as wire,
    ):
        with console_for(wire.url) as address:
            async with page_of(address, viewport=SIZE) as visit:
                page = visit.page
                await says(page, "Ready", within=".driving-status")
                wire.rewrite = spoil
                await asyncio.sleep(6.0)
                wire.frames += ["{", "[]", "null", '{"op":"publish"}', '{"op":7}', "A" * 100_000]
                await asyncio.sleep(1.0)
                assert not wire.moved, wire.commands
                assert not any(tick.moves for tick in robot.ticks)
                wire.rewrite = lambda message: message
                await says(page, " is not ", within=".page-right")
                await says(page, "cannot be read", within=".page-right")
                await says(page, "Ready", within=".driving-status")
                assert await page.locator(".page-failed").count() == 0
                # The wire carries no files: the map cannot be had.
                assert [e for e in visit.errors if "/map" not in e and "ERR_" not in e] == []
                await hold_until(page, key(page, "w"), lambda: robot.speed > 0.2, "that it drives")
                await page.keyboard.up("w")


@pytest.mark.long
@in_a_loop
async def test_spoilt_standard_messages_of_a_plain_robot_never_drive(page_of: Pages) -> None:
    chance = Random(15)

    def spoil(_topic: str, message: Message) -> object:
        return spoilt(_plain(message), chance) if chance.random() < 0.5 else message

    topics: Topics = STANDARD
    async with suite_robot(topics, rewrite=spoil) as robot:
        with console_for(robot.url) as address:
            async with page_of(address, viewport=SIZE) as visit:
                await says(visit.page, "Nothing guards this robot")
                await asyncio.sleep(4.0)
                assert robot.received == []
                await says(visit.page, " is not ", within=".page-right")
                assert await visit.page.locator(".page-failed").count() == 0
                assert visit.errors == []


def _plain(message: Message) -> Message:
    """Return a message without bytes, which JSON has not."""
    return {name: "AAAA" if isinstance(part, bytes) else part for name, part in message.items()}
