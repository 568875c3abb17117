"""Chromium for the figures of the console page, and what the page says of itself."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final, cast

from playwright.async_api import Browser, BrowserContext, Page, async_playwright

VIEWPORT: Final = {"width": 1120, "height": 600}
"""Of the page [CSS pixels]; small, for the processor draws it where there is no graphics card."""
PATIENCE: Final = 60.0
"""For anything that must come at all [s]."""
SEEN: Final = "farsteer: robot seen"
"""The page's mark of the first picture of a located robot in its map."""

_FLAGS: Final = ("--enable-unsafe-swiftshader", "--no-sandbox", "--disable-dev-shm-usage")


@asynccontextmanager
async def chromium() -> AsyncIterator[Browser]:
    """Start Chromium without a window."""
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        raise SystemExit("Chromium is not installed: tools/test-setup fetches it")
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=found, args=[*_FLAGS])
        try:
            yield browser
        finally:
            await browser.close()


async def context_of(browser: Browser, *scripts: str) -> BrowserContext:
    """Return a profile of its own, in which each page runs these scripts first."""
    context = await browser.new_context(viewport=cast(Any, VIEWPORT))
    context.set_default_timeout(1000 * PATIENCE)
    for script in scripts:
        await context.add_init_script(script)
    return context


@asynccontextmanager
async def page_at(address: str, *scripts: str) -> AsyncIterator[Page]:
    """Open an address in a browser of its own, and wait until the robot is seen."""
    async with chromium() as browser:
        page = await (await context_of(browser, *scripts)).new_page()
        await page.goto(address, wait_until="commit")
        await seen(page)
        yield page


async def seen(page: Page) -> float:
    """Wait until the robot has been drawn in its map; return when, since the navigation began [s]."""
    # The page's policy forbids what Playwright's own waiting for a condition would do.
    async with asyncio.timeout(PATIENCE):
        while True:
            marked = await page.evaluate(
                f"performance.getEntriesByName('{SEEN}').map(entry => entry.startTime)"
            )
            if marked:
                return float(marked[0]) / 1000.0
            await asyncio.sleep(0.05)


async def soon(true: Callable[[], bool], seconds: float = PATIENCE) -> None:
    """Wait until something has become true.

    Raises:
        TimeoutError: if it has not within so many seconds.
    """
    async with asyncio.timeout(seconds):
        while not true():  # noqa: ASYNC110 - what is waited for has no event
            await asyncio.sleep(0.01)
