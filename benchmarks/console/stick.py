"""From the stick on the screen to the wheels' command, for one page and beside seven further clients."""

from __future__ import annotations

import asyncio
import json
import random
import tempfile
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import numpy as np
from playwright.async_api import Page, WebSocket
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from benchmarks.common.figures import Figure, share
from benchmarks.console.browser import chromium, context_of, seen, soon
from benchmarks.console.robot import Served, serving

PRESSES = 100
CLIENTS = 8
"""All clients of the robot, the page among them; one of the others reads nothing."""
GOAL = 0.060
"""Longest time from the pointer to the wheels' command at p95, with the building drawn by the processor [s]."""
PRESSED, MOST_VAIN = 2.0, 10
"""Time after which a press has come to nothing [s], and how many of them may."""
SIMILAR = 0.020
"""What further clients may add to it [s]: a tick, which is the resolution."""
MOVES = """
window.pointerMoves = [];
for (const kind of ['pointerrawupdate', 'pointermove']) {
  addEventListener(kind, event => {
    for (const one of event.getCoalescedEvents?.() ?? [event]) {
      window.pointerMoves.push(performance.timeOrigin + one.timeStamp);
    }
  }, true);
}
"""
"""Notes when the pointer was moved [ms, Unix time], by the events' own stamps."""


def stick() -> Iterator[Figure]:
    """Yield the time from a pointer's move to the first tick whose wheel command moves."""
    found, vain, _ = asyncio.run(_stick(0))
    yield from _figures("the page alone", found, vain, GOAL)


def clients() -> Iterator[Figure]:
    """Yield the same beside seven further clients with the page's subscriptions, and the difference."""
    alone, few, _ = asyncio.run(_stick(0))
    among, vain, alive = asyncio.run(_stick(CLIENTS - 1))
    case = f"{CLIENTS} clients with the page's subscriptions, one stalled"
    yield from _figures("the page alone, just before", alone, few, None)
    yield from _figures(case, among, vain, GOAL)
    more = 1e3 * float(np.percentile(among, 95) - np.percentile(alone, 95))
    yield Figure(case, "stick", "p95 more than alone", more, "ms", len(among), most=1e3 * SIMILAR)
    yield share(case, "further clients", "still served at the end", alive, CLIENTS - 2)


def _figures(case: str, times: Sequence[float], vain: int, goal: float | None) -> Iterator[Figure]:
    for share_of in (50, 95):
        most = None if goal is None or share_of == 50 else 1e3 * goal
        value = 1e3 * float(np.percentile(times, share_of))
        yield Figure(case, "stick", f"p{share_of}", value, "ms", len(times), most=most)
    yield Figure(case, "stick", "longest", 1e3 * max(times), "ms", len(times))
    yield Figure(case, "stick", "presses that came to nothing", vain, "", len(times) + vain)


async def _stick(others: int) -> tuple[list[float], int, int]:
    """Return the times of all presses [s], how many came to nothing, and how many other clients were served to the end.

    Of the others one reads nothing; it does not count.
    """
    subscriptions: list[str] = []

    def opened(socket: WebSocket) -> None:
        socket.on("framesent", lambda frame: _note(frame, subscriptions))

    with tempfile.TemporaryDirectory() as folder:
        async with serving(edges=Path(folder) / "edges") as robot, chromium() as browser:
            page = await (await context_of(browser, MOVES)).new_page()
            page.on("websocket", opened)
            await page.goto(robot.page, wait_until="commit")
            await seen(page)
            await asyncio.sleep(3.0)
            async with _others(robot, subscriptions, others) as alive:
                times, vain = await _presses(page, robot)
                return times, vain, sum(not one.done() for one in alive)


def _note(frame: str | bytes, subscriptions: list[str]) -> None:
    if isinstance(frame, str) and json.loads(frame).get("op") == "subscribe":
        subscriptions.append(frame)


async def _presses(page: Page, robot: Served) -> tuple[list[float], int]:
    """Put the pointer on the stick, and move it, now ahead, now back; return the times [s] and what came to nothing."""
    chance = random.Random(0)
    box = await page.locator(".driving-stick").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    times, vain = list[float](), 0
    while len(times) < PRESSES:
        way = 0.4 * box["height"] * (1 if len(times) % 2 else -1)
        await page.mouse.move(x, y)
        await page.mouse.down()
        await asyncio.sleep(0.3 + 0.1 * chance.random())  # the deadman is held, at neutral
        await page.evaluate("window.pointerMoves.length = 0")
        before = len(robot.edges())
        await page.mouse.move(x, y + way)
        try:
            await soon(lambda at=before: len(robot.edges()) > at, PRESSED)  # type: ignore[misc]
            moved = await page.evaluate("window.pointerMoves[0]")
            times.append(robot.edges()[before][0] - moved / 1e3)
        except TimeoutError:
            # A page that had no time for half a second asks for another press.
            vain += 1
            if vain > MOST_VAIN:
                said = await page.locator("body").inner_text()
                raise SystemExit(f"the robot does not drive; the page says:\n{said}") from None
        await asyncio.sleep(0.1)
        await page.mouse.up()
        await soon(lambda: not (robot.edges() or [(0.0, False)])[-1][1])
        await asyncio.sleep(0.3)
    return times, vain


@asynccontextmanager
async def _others(
    robot: Served, subscriptions: Sequence[str], count: int
) -> AsyncIterator[list[asyncio.Task[None]]]:
    """Connect further clients, of which the first reads nothing and the others all."""
    async with AsyncExitStack() as stack:
        reading = list[asyncio.Task[None]]()
        for number in range(count):
            address = f"ws://127.0.0.1:{robot.port}/"
            options = {"compression": None, "max_size": None, "proxy": None, "close_timeout": 0.2}
            client = await stack.enter_async_context(connect(address, **options))  # type: ignore[arg-type]
            for subscription in subscriptions:
                await client.send(subscription)
            if number == 0:
                client.transport.pause_reading()
            else:
                reading.append(asyncio.create_task(_read(client)))
        try:
            yield reading
        finally:
            for task in reading:
                task.cancel()


async def _read(client: ClientConnection) -> None:
    try:
        async for _ in client:
            pass
    except WebSocketException:
        return
