"""From the address to the robot in its map, over a link of 20 Mbit/s, at first and with the page kept."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import numpy as np

from benchmarks.common.figures import Figure
from benchmarks.console.browser import chromium, context_of, seen
from benchmarks.console.robot import serving
from benchmarks.wire.shaped_link import shaped_link

RATE = 20e6
"""Of the link, each way [bit/s]."""
VISITS = 5


def opening() -> Iterator[Figure]:
    """Yield how long it takes from the address to the robot: at first, and with the page kept."""
    first, again, megabytes = asyncio.run(_visits())
    case = f"office, {RATE / 1e6:.0f} Mbit/s"
    for words, times, goal in (
        ("address opened to robot and building seen", first, 3.0),
        ("again, with the page kept", again, 1.5),
    ):
        n = len(times)
        yield Figure(case, words, "median", float(np.median(times)), "s", n, most=goal)
        yield Figure(case, words, "longest", max(times), "s", n)
    yield Figure(
        case, "address opened to robot and building seen", "received until then", megabytes, "MB"
    )


async def _visits() -> tuple[list[float], list[float], float]:
    """Return the times of first visits and of those with the page kept [s], and what a first one receives [MB]."""
    first, again, received = list[float](), list[float](), list[float]()
    async with (
        serving() as robot,
        shaped_link(robot.port, RATE) as link,
        chromium() as browser,
    ):
        for _ in range(VISITS):
            before = link.down
            context = await context_of(browser)  # with nothing kept
            page = await context.new_page()
            await page.goto(f"http://127.0.0.1:{link.port}/", wait_until="commit")
            first.append(await seen(page))
            received.append((link.down - before) / 1e6)
            await asyncio.sleep(2.0)
            await page.reload(wait_until="commit")
            again.append(await seen(page))
            await context.close()
            await asyncio.sleep(1.0)
    return first, again, float(np.median(received))
