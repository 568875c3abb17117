"""From the address to the robot in its map, over a link of 20 Mbit/s, at first and with the map kept."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.common.figures import Figure
from benchmarks.console.browser import chromium, context_of, seen
from benchmarks.console.robot import office_map, serving
from benchmarks.wire.shaped_link import shaped_link

RATE = 20e6
"""Of the link, each way [bit/s]."""
POINTS = 200_000
"""Of the map."""
VISITS = 5


def opening() -> Iterator[Figure]:
    """Yield how long it takes from the address to the robot: at first, and with the map kept."""
    with tempfile.TemporaryDirectory() as folder:
        first, again, megabytes = asyncio.run(_visits(Path(folder)))
    case = f"office filled up to {POINTS // 1000}k points, {RATE / 1e6:.0f} Mbit/s"
    for words, times, goal in (
        ("address opened to robot seen", first, 5.0),
        ("again, with the map kept", again, 2.0),
    ):
        n = len(times)
        yield Figure(case, words, "median", float(np.median(times)), "s", n, most=goal)
        yield Figure(case, words, "longest", max(times), "s", n)
    yield Figure(case, "address opened to robot seen", "received until then", megabytes, "MB")


async def _visits(folder: Path) -> tuple[list[float], list[float], float]:
    """Return the times of first visits and of those with the map kept [s], and what a first one receives [MB]."""
    first, again, received = list[float](), list[float](), list[float]()
    async with (
        serving("--map", str(office_map(folder, POINTS))) as robot,
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
            await asyncio.sleep(2.0)  # the map is kept after it has been shown
            await page.reload(wait_until="commit")
            again.append(await seen(page))
            await context.close()
            await asyncio.sleep(1.0)
    return first, again, float(np.median(received))
