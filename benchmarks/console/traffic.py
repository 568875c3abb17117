"""What driving for a while takes: bytes on the link, and memory of the page."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager
from math import inf
from typing import Any

import numpy as np
from playwright.async_api import CDPSession, Page
from scipy.stats import linregress, t

from benchmarks.common.figures import Figure
from benchmarks.console.browser import page_at
from benchmarks.console.robot import serving
from benchmarks.wire.shaped_link import shaped_link

SETTLE = 8.0
"""Until map and latched messages have come [s]."""
SECONDS = 40.0
"""Of driving, for the bandwidth."""
PICTURES = {
    "default picture": (4000.0, ""),
    "lean": (256.0, "localStorage.setItem('farsteer.lean', 'true')"),
}
"""Most that each may take [kbit/s], and the script that sets it."""
HEAP, GROWTH = 300.0, 0.3
"""Most memory of script and buffers [MB]; growth that counts as none [MB/min], 10 MB in half an hour."""
EACH, AT_HOME = 20.0, 2.0
"""How often memory is looked at [s], and until caches and rings are full [min]."""
LEG = 2.5
"""Time for which is driven ahead, then back [s]."""


def bandwidth() -> Iterator[Figure]:
    """Yield what the page receives and sends while it drives, with the whole picture and with the lean one."""
    for name, (most, script) in PICTURES.items():
        down, up = asyncio.run(_bandwidth(script))
        yield Figure(name, "while driving", "to the page", down, "kbit/s", 1, most=most)
        yield Figure(name, "while driving", "from the page", up, "kbit/s", 1)


async def _bandwidth(script: str) -> tuple[float, float]:
    async with (
        serving() as robot,
        shaped_link(robot.port, inf) as link,
        page_at(f"http://127.0.0.1:{link.port}/", *([script] if script else [])) as page,
        driving(page),
    ):
        await asyncio.sleep(SETTLE)
        clock = asyncio.get_running_loop().time
        begun, down, up = clock(), link.down, link.up
        await asyncio.sleep(SECONDS)
        seconds = clock() - begun
        return (8e-3 * (link.down - down) / seconds, 8e-3 * (link.up - up) / seconds)


def memory(minutes: int = 5) -> Iterator[Figure]:
    """Yield the page's memory after so many minutes of driving, and by how much it grows."""
    held = asyncio.run(_memory(minutes))
    case, n = f"{minutes} min of driving", len(held)
    growth, off = slope(held)
    yield Figure(case, "script and buffers", "at the end", held[-1], "MB", n, most=HEAP)
    yield Figure(case, "script and buffers", "most", max(held), "MB", n)
    low, high = growth - off, growth + off
    yield Figure(
        case, "script and buffers", "growth", growth, "MB/min", n, low=low, high=high, most=GROWTH
    )


def slope(held: Sequence[float]) -> tuple[float, float]:
    """Return by how much memory grows by the line of least squares, and half its 95 % interval [MB/min]."""
    minutes = np.arange(len(held)) * EACH / 60.0
    line = linregress(minutes, held)
    return float(line.slope), float(t.ppf(0.975, len(held) - 2) * line.stderr)


async def _memory(minutes: int) -> list[float]:
    """Return what is held, looked at again and again once the page has been at home for a while [MB]."""
    held = list[float]()
    async with serving() as robot, page_at(robot.page) as page, driving(page):
        session = await page.context.new_cdp_session(page)
        await asyncio.sleep(60.0 * AT_HOME)
        for _ in range(round(60.0 * (minutes - AT_HOME) / EACH) + 1):
            held.append(await _held(session))
            await asyncio.sleep(EACH)
    return held


async def _held(session: CDPSession) -> float:
    """Collect garbage, and return what script and its buffers hold [MB]."""
    await session.send("HeapProfiler.collectGarbage")
    return megabytes(await session.send("Runtime.getHeapUsage"))


def megabytes(usage: Mapping[str, Any]) -> float:
    """Return the heap, the objects of the browser that script holds, and array buffers together [MB]."""
    names = ("usedSize", "embedderHeapUsedSize", "backingStorageSize")
    return sum(float(usage[name]) for name in names) / 1e6


@asynccontextmanager
async def driving(page: Page) -> AsyncIterator[None]:
    """Drive to and fro by keys meanwhile."""
    task = asyncio.create_task(_drive(page))
    try:
        yield
        if task.done():
            task.result()
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def _drive(page: Page) -> None:
    await page.locator(".page-canvas canvas").focus()
    while True:
        for key in ("ArrowUp", "ArrowDown"):
            await page.keyboard.down(key)
            await asyncio.sleep(LEG)
            await page.keyboard.up(key)
            await asyncio.sleep(0.3)
