"""The page in front of robots of others, which nothing guards, and of servers that are no robots."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager

import pytest
from playwright.async_api import Page
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from tests.teleop.console.conftest import VIEWPORT, Pages
from tests.teleop.console.hands import hold_until, key, press, says, seen, until
from tests.teleop.console.plain_robots import (
    PlainRobot,
    answering,
    console_for,
    library_robot,
    moves,
    suite_robot,
)
from tests.teleop.support import in_a_loop

pytestmark = [pytest.mark.process, pytest.mark.slow]


@pytest.mark.long
@pytest.mark.parametrize("serve", [library_robot, suite_robot], ids=["library", "rosbridge_suite"])
@in_a_loop
async def test_page_shows_what_there_is_and_drives_only_after_a_confirmation(
    serve: Callable[[], AbstractAsyncContextManager[PlainRobot]], page_of: Pages
) -> None:
    async with serve() as robot:
        with console_for(robot.url) as address:
            async with page_of(address, viewport=VIEWPORT) as visit:
                page = visit.page
                await says(page, "Nothing guards this robot")
                await says(page, "Nothing there guards the robot")
                await seen(page)
                await _streams(page)
                await page.keyboard.down("w")
                await asyncio.sleep(0.5)
                await page.keyboard.up("w")
                assert robot.received == [], "it drives before the person has confirmed it"
                await press(page, "Drive by /cmd_vel all the same")
                await says(page, "Ready. Nothing there guards the robot")
                await _drive_and_stop(page, robot)
                assert visit.violations == []
                assert visit.errors == []


async def _streams(page: Page) -> None:
    """See that all that the robot sends has arrived."""
    for topic in ("/odom", "/scan", "/points", "/tf"):
        row = page.locator(".page-right tr", has_text=topic).filter(has_not_text="never")
        await row.first.wait_for(state="attached")


async def _drive_and_stop(page: Page, robot: PlainRobot) -> None:
    """Drive, and see the zero that ends each drive: by letting go, by the stop, and by leaving."""
    await hold_until(page, key(page, "w"), lambda: robot.moving, "that it drives")
    assert robot.received[-1]["linear"]["x"] > 0.0
    assert not moves(robot.received[0])
    await page.keyboard.up("w")
    await _zero(robot)
    await hold_until(page, key(page, "w"), lambda: robot.moving, "that it drives again")
    await page.keyboard.press("Escape")
    await _zero(robot)
    await page.keyboard.up("w")
    await says(page, "This robot has no e-stop of its own")
    await press(page, "Drive by /cmd_vel all the same")
    await hold_until(page, key(page, "w"), lambda: robot.moving, "that it drives a third time")
    await page.goto("about:blank")
    await _zero(robot)


async def _zero(robot: PlainRobot) -> None:
    """Wait for the zero, and see that nothing follows it."""
    await until(lambda: not robot.moving, "that it stops")
    count = len(robot.received)
    await asyncio.sleep(0.5)
    assert not any(moves(twist) for twist in robot.received[count:])


async def _echo(connection: ServerConnection) -> None:
    try:
        async for frame in connection:
            await connection.send(frame)
    except ConnectionClosed:
        pass


@in_a_loop
async def test_server_that_is_no_rosbridge_is_named_in_one_sentence(page_of: Pages) -> None:
    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readline()
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello")
        writer.close()

    plain = await asyncio.start_server(refuse, "127.0.0.1", 0)
    async with plain, answering(_echo) as echo:
        for robot in (f"ws://127.0.0.1:{plain.sockets[0].getsockname()[1]}", echo):
            with console_for(robot) as address:
                async with page_of(address, viewport=VIEWPORT) as visit:
                    await says(visit.page, f"What answers at {robot} is not a rosbridge")
                    await says(
                        visit.page, "farsteer console ws://HOST:PORT", within=".page-notices"
                    )
                    notices = visit.page.locator(".page-notices p")
                    assert await notices.count() == 1
