"""A person's hands and eyes on the page, by the words that it shows."""

from __future__ import annotations

import asyncio
import inspect
import re
from collections.abc import Awaitable, Callable
from typing import Any, Final

import numpy as np
import pytest
from playwright.async_api import Page, TimeoutError as PlaywrightTimeout

from tests.teleop.support import PATIENCE

SEEN: Final = "performance.getEntriesByName('farsteer: robot seen').length"
"""Whether the robot has been drawn in its map."""

GAMEPAD: Final = """
(() => {
  const pad = { id: 'synthetic pad', index: 0, connected: true, mapping: 'standard', timestamp: 1,
    axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 })) };
  let plugged = false;
  navigator.getGamepads = () => (plugged ? [pad] : [null]);
  window.synthetic = {
    plug(there) {
      plugged = there;
      dispatchEvent(new Event(there ? 'gamepadconnected' : 'gamepaddisconnected'));
    },
    set(forward, turn, deadman) {
      pad.axes = [-turn, -forward, 0, 0];
      pad.buttons[4] = { pressed: deadman, touched: deadman, value: deadman ? 1 : 0 };
      pad.timestamp = performance.now();
    },
  };
  setInterval(() => { pad.timestamp = performance.now(); }, 10);
})();
"""
"""A gamepad with the standard mapping; up and left are negative there."""


async def says(page: Page, text: str | re.Pattern[str], *, within: str = "body") -> None:
    """Wait until the page shows a text."""
    words = page.locator(within).get_by_text(text).first
    try:
        await words.wait_for(state="visible", timeout=PATIENCE * 1000)
    except PlaywrightTimeout:
        said = await page.locator(within).first.inner_text()
        pytest.fail(f"waited in vain for {text!r}; the page says:\n{said}")


async def until(true: Callable[[], object], what: str) -> None:
    """Wait until something is true of robot or page, which have no events for it; ``true`` may be awaitable."""
    try:
        async with asyncio.timeout(PATIENCE):
            while not (await now if inspect.isawaitable(now := true()) else now):  # noqa: ASYNC110
                await asyncio.sleep(0.05)
    except TimeoutError:
        pytest.fail(f"waited in vain: {what}")


async def seen(page: Page) -> None:
    """Wait until the robot has been drawn in its map."""
    # The page's policy forbids what Playwright's own waiting for a condition would do.
    await until(lambda: page.evaluate(SEEN), "that the robot is drawn")


async def press(page: Page, name: str) -> None:
    """Press a button by its name."""
    await page.get_by_role("button", name=name, exact=False).first.click()


async def plug(page: Page, there: bool = True) -> None:
    """Plug the synthetic gamepad in, or out."""
    await page.evaluate("there => window.synthetic.plug(there)", there)


async def pad(page: Page, forward: float, turn: float = 0.0, *, deadman: bool = True) -> None:
    """Hold the synthetic gamepad like this."""
    await page.evaluate("([f, t, d]) => window.synthetic.set(f, t, d)", [forward, turn, deadman])


def key(page: Page, name: str) -> Callable[[bool], Awaitable[object]]:
    """Return a function that holds a key, or lets it go."""

    def hold(held: bool) -> Awaitable[object]:
        return page.keyboard.down(name) if held else page.keyboard.up(name)

    return hold


async def hold_until(
    page: Page,
    hold: Callable[[bool], Awaitable[object]],
    true: Callable[[], bool],
    what: str,
) -> None:
    """Hold what drives until something has become true; let go and press again when the page asks for that.

    It does where it was too busy to know whether the hand was still there, as on a loaded machine.
    """
    await hold(True)
    try:
        async with asyncio.timeout(PATIENCE):
            while not true():
                await asyncio.sleep(0.05)
                if "again" in await page.locator(".driving-status").inner_text():
                    await hold(False)
                    await asyncio.sleep(0.3)
                    await hold(True)
                    await asyncio.sleep(0.3)
    except TimeoutError:
        said = await page.locator("body").inner_text()
        pytest.fail(f"waited in vain: {what}; the page says:\n{said}")


async def let_go(page: Page, hold: Callable[[bool], Awaitable[object]]) -> None:
    """Let go of what drives, and wait until the page is ready for the next drive.

    Where it had been too busy to drive, it asks for the hand once more, as in ``hold_until``.
    """
    status = page.locator(".driving-status")
    await hold(False)
    said = ""
    try:
        async with asyncio.timeout(PATIENCE):
            while "Ready" not in (said := await status.inner_text()):
                if "again" in said:
                    await hold(True)
                    await asyncio.sleep(0.3)
                    await hold(False)
                await asyncio.sleep(0.3)
    except TimeoutError:
        pytest.fail(f"waited in vain for the page to be ready; it says:\n{said}")


async def place_on_screen(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a place of the map's floor [m] is in the window, in the view from above [CSS pixels]."""
    box = await page.locator(".page-canvas canvas").bounding_box()
    assert box is not None
    middle = np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])
    corners = [middle, middle + (60.0, 0.0), middle + (0.0, 60.0)]
    found: list[Any] = [
        await page.evaluate(
            "([x, y]) => window.farsteerFigures().floorPoint(x, y)", [*map(float, c)]
        )
        for c in corners
    ]
    places = [np.array([f["x"], f["y"]]) for f in found if f is not None]
    # Seen straight from above the floor is an affine picture.
    per_pixel = np.column_stack((places[1] - places[0], places[2] - places[0])) / 60.0
    away = np.linalg.solve(per_pixel, np.array([x, y]) - places[0])
    return float(middle[0] + away[0]), float(middle[1] + away[1])


async def _at_rest(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a place is in the window once the view has come to stand above the map."""
    seen: list[tuple[float, float] | None] = []
    async with asyncio.timeout(PATIENCE):
        while len(seen) < 3 or seen[-1] is None or len({*seen[-3:]}) > 1:
            try:
                there = await place_on_screen(page, x, y)
                seen.append((round(there[0]), round(there[1])))
            except (IndexError, np.linalg.LinAlgError):  # above the horizon, while the view turns
                seen.append(None)
            await asyncio.sleep(0.15)
    found = seen[-1]
    assert found is not None
    return found


async def drag_hint(page: Page, x: float, y: float, heading: float) -> None:
    """Press where the robot is [m] and drag to where it looks [rad], in the view from above."""
    start = await _at_rest(page, x, y)
    end = await place_on_screen(page, x + 1.5 * np.cos(heading), y + 1.5 * np.sin(heading))
    await page.mouse.move(*start)
    await page.mouse.down()
    for share in (0.3, 0.6, 1.0):
        await page.mouse.move(
            start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
        )
        await asyncio.sleep(0.05)
    await page.mouse.up()
