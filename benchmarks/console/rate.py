"""Pictures a second while driving, drawn by the processor, beside the bare library with the same triangles.

The robot runs on the same machine, in both. The page's frames are counted where the library begins one: it clears. Where it
is slow it draws fewer pixels while something moves; the bare library draws all.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any, cast

from playwright.async_api import Browser, Page, Route

from benchmarks.common.figures import OURS, Figure
from benchmarks.console.browser import chromium, context_of, seen
from benchmarks.console.bundles import bundled
from benchmarks.console.robot import Served, serving
from benchmarks.console.traffic import driving
from robot_sim import load_world

VIEWPORT = {"width": 1280, "height": 800}
"""Of the page [CSS pixels]."""
SETTLE, WATCH = 6.0, 20.0
"""Until the picture is at rest, and for how long frames are counted [s]."""
LEAST, SHARE = 20.0, 60.0
"""Least frames a second, and least share of what the bare library draws [%]."""
COUNTED = """
window.framesDrawn = 0;
{
  const { prototype } = WebGL2RenderingContext;
  const { clear } = prototype;
  prototype.clear = function (mask) {
    window.framesDrawn += mask & this.COLOR_BUFFER_BIT && this.getParameter(this.FRAMEBUFFER_BINDING) === null ? 1 : 0;
    clear.call(this, mask);
  };
}
"""


def rate() -> Iterator[Figure]:
    """Yield the frames a second of the page while it drives, of the bare library, and their ratio."""
    ours, bare, pixels = asyncio.run(_rates())
    case = f"{VIEWPORT['width']} x {VIEWPORT['height']}, no graphics card, driving"
    n = round(ours * WATCH)
    yield Figure(case, OURS, "frames a second", ours, "1/s", n, least=LEAST)
    yield Figure(case, OURS, "pixels drawn along each side", 100.0 * pixels, "%", n)
    yield Figure(
        case, "bare three.js, same surfaces", "frames a second", bare, "1/s", round(bare * WATCH)
    )
    yield Figure(case, OURS, "of the bare library's", 100.0 * ours / bare, "%", n, least=SHARE)


async def _rates() -> tuple[float, float, float]:
    async with serving() as robot, chromium() as browser:
        page = await _page(browser)
        await page.goto(robot.page, wait_until="commit")
        await seen(page)
        canvas = page.locator(".page-canvas canvas")
        box = await canvas.bounding_box()
        assert box is not None
        async with driving(page):
            ours = await _frames(page)
            pixels = await canvas.evaluate("canvas => canvas.width / canvas.clientWidth")
        await page.close()
        return ours, await _bare(browser, robot, box["width"], box["height"]), float(pixels)


async def _bare(browser: Browser, robot: Served, width: float, height: float) -> float:
    """Return the frames a second of the bare library in a canvas of the same size."""
    page, script = await _page(browser), bundled("rate_bare.ts")

    async def answer(route: Route) -> None:
        if route.request.url.endswith(".js"):
            await route.fulfill(body=script, content_type="text/javascript")
        else:
            html = "<!doctype html><meta charset=utf-8><body><script type=module src=/bare.js></script>"
            await route.fulfill(body=html, content_type="text/html")

    await page.route("**/bare.*", answer)
    x, y = load_world("office").spawn.position[:2]
    await page.goto(f"{robot.page}bare.html#{width:.0f},{height:.0f},{x},{y}", wait_until="commit")
    await seen(page)
    return await _frames(page)


async def _page(browser: Browser) -> Page:
    page = await (await context_of(browser, COUNTED)).new_page()
    await page.set_viewport_size(cast(Any, VIEWPORT))
    return page


async def _frames(page: Page) -> float:
    """Return the frames a second, counted for a while after a time to settle."""
    await asyncio.sleep(SETTLE)
    counts = list[tuple[int, float]]()
    for wait in (WATCH, 0.0):
        drawn, now = await page.evaluate("[window.framesDrawn, performance.now()]")
        counts.append((int(drawn), float(now) / 1e3))
        await asyncio.sleep(wait)
    (first, begun), (last, ended) = counts
    return (last - first) / (ended - begun)
