"""Script time of the page's frames, over a server that sends what a robot sends while it drives."""

from __future__ import annotations

import asyncio
import json
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from playwright.async_api import Page

from benchmarks.common.figures import Figure
from benchmarks.console.browser import chromium, context_of, seen
from benchmarks.console.publisher import publishing
from benchmarks.console.robot import office_map

MAPS = {200_000: 4.0, 1_000_000: 8.0}
"""Longest script time at p95 [ms] by the number of points in the map."""
SETTLE = 8.0
"""Until the ring of old sweeps is full, and what is compiled is compiled [s]."""
WATCH = 25.0


def frames() -> Iterator[Figure]:
    """Yield the script time of a frame with a small and a large map."""
    for points, goal in MAPS.items():
        with tempfile.TemporaryDirectory() as folder:
            wall, processor = asyncio.run(_watch(office_map(Path(folder), points)))
        case = f"{points // 1000}k map, 1.1k live at 10 Hz, 8k kept"
        for words, times in (("time in script", wall), ("processor time of script", processor)):
            if len(times):
                p50, p95 = np.percentile(times, [50, 95])
                yield Figure(case, words, "p50", float(p50), "ms", len(times))
                yield Figure(case, words, "p95", float(p95), "ms", len(times), most=goal)


async def _watch(map_file: Path) -> tuple[list[float], list[float]]:
    """Return times of frames by the page's clock and by its thread's processor time [ms]."""
    async with publishing(map_file) as address, chromium() as browser:
        page = await (await context_of(browser)).new_page()
        await page.goto(address, wait_until="commit")
        await seen(page)
        await asyncio.sleep(SETTLE)
        before = len(await _frame_times(page))
        await browser.start_tracing(page=page, categories=["devtools.timeline"])
        await asyncio.sleep(WATCH)
        trace = json.loads(await browser.stop_tracing())
        return (await _frame_times(page))[before:], script_times(trace)


async def _frame_times(page: Page) -> list[float]:
    found: list[float] = await page.evaluate("window.farsteerFigures().frameTimes")
    return found


def script_times(trace: Mapping[str, Any]) -> list[float]:
    """Return the processor time of each callback for a frame in a trace of Chromium's [ms]."""
    events = trace["traceEvents"]
    return [
        e["tdur"] / 1e3 for e in events if e.get("name") == "FireAnimationFrame" and "tdur" in e
    ]
