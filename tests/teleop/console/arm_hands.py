"""A person's hands and eyes on the arm's part of the page."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.async_api import Page

from robot_sim import World
from robot_sim.worlds.loading import parse_world
from robot_sim.worlds.world import WorldOptions
from tests.teleop.support import PATIENCE, ROOT

PANEL = ".panel-arm"
REASON = ".arm-reason"
MOVE = ".arm-move"
_TIP = re.compile(r"Tip: ([\d.]+) cm (ahead|behind), ([\d.]+) cm (left|right), (-?[\d.]+) cm above")


def office_with_parcel(ahead: float, left: float) -> World:
    """Return the office, and a robot with an arm before which a small box lies on the floor.

    Args:
        ahead: Way from the arm's base to the middle of the box [m].
        left: The same to the left.
    """
    plan = (ROOT / "scenes/office/world.toml").read_text(encoding="utf-8")
    # The robot looks along -x; the arm's base is 0.29 m ahead of its middle.
    place = f"[{24.2 - 0.29 - ahead}, {3.0 - left}]"
    parcel = f'\n[[parcel]]\nname = "parcel"\nat = {place}\n'
    return parse_world(plan + parcel, name="office", options=WorldOptions(arm="s2"))


async def tip(page: Page) -> np.ndarray:
    """Return where the page says that the tip is, ahead, left and above the floor [m]."""
    words = await page.locator(".arm-tip").inner_text()
    found = _TIP.search(words)
    assert found is not None, words
    x, y, z = (float(found[k]) / 100.0 for k in (1, 3, 5))
    return np.array([x if found[2] == "ahead" else -x, y if found[4] == "left" else -y, z])


async def choose_arm(page: Page) -> None:
    """Have keys and handles move the arm."""
    await page.locator(".arm-tip").wait_for()
    await page.get_by_role("button", name="the arm", exact=True).click()


async def go(page: Page, button: str, title: str = "") -> None:
    """Ask for a planned move, and hold the button that confirms it until the arm is there.

    Args:
        page: The page.
        button: Name of the button that asks for it.
        title: Name of the move that must end, if it is not the first one.

    On a loaded machine the page may have let go, or the robot given the move up: then a person presses again.
    """
    status = page.locator(MOVE)
    await page.get_by_role("button", name=button, exact=True).click()
    held = False
    try:
        async with asyncio.timeout(PATIENCE):
            while f"{title}: the arm is there".removeprefix(": ") not in (
                said := await status.inner_text()
            ):
                if "not reached" in said:
                    await page.mouse.up()
                    await page.get_by_role("button", name=button, exact=True).click()
                    held = False
                elif "hold the button" in said:
                    if held:
                        await page.mouse.up()
                    await page.get_by_role("button", name="Hold to move").hover()
                    await page.mouse.down()
                    held = True
                await asyncio.sleep(0.5)
    except TimeoutError:
        pytest.fail(f"{button}: waited in vain; the page says:\n{said}")
    finally:
        await page.mouse.up()


async def hold_key_until(
    page: Page, key: str, true: Callable[[np.ndarray], bool], what: str
) -> None:
    """Hold a key until the tip is where it should be, as the page says; press it again if the page lets go."""
    await page.keyboard.down(key)
    try:
        async with asyncio.timeout(PATIENCE):
            while not true(await tip(page)):
                await asyncio.sleep(0.02)
                if "Stopped:" in await page.locator(REASON).inner_text():
                    await page.keyboard.up(key)
                    await asyncio.sleep(0.3)
                    await page.keyboard.down(key)
                    await asyncio.sleep(0.3)
    except TimeoutError:
        said = await page.locator(PANEL).inner_text()
        pytest.fail(f"waited in vain: {what}; the page says:\n{said}")
    finally:
        await page.keyboard.up(key)


async def bring(page: Page, axis: int, to: float, *, plus: str, minus: str) -> None:
    """Bring the tip to a place along an axis by two keys, within 4 mm.

    As a person does, it lets go the earlier the farther the arm went on after the last time: a loaded
    machine shows late where the tip is.
    """
    early = 0.003
    away = to - (await tip(page))[axis]
    for _ in range(16):
        if abs(away) <= 0.004:
            return
        sign = 1.0 if away > 0.0 else -1.0

        def there(at: np.ndarray, sign: float = sign, early: float = early) -> bool:
            return bool(sign * (to - at[axis]) <= early)

        await hold_key_until(page, plus if away > 0.0 else minus, there, f"to {to}")
        beyond = sign * ((await standing(page))[axis] - to)
        early = max(0.003, min(early, abs(away)) + beyond)
        away = to - (await tip(page))[axis]
    pytest.fail(f"not there: {await tip(page)}, axis {axis} to {to}")


async def standing(page: Page) -> np.ndarray:
    """Wait until the tip stands, as the page says; return where it does."""
    seen = [await tip(page)]
    async with asyncio.timeout(PATIENCE):
        while len(seen) < 4 or not all(np.allclose(one, seen[-1], atol=5e-4) for one in seen[-4:]):
            await asyncio.sleep(0.15)
            seen.append(await tip(page))
    return seen[-1]


async def drag_handle(page: Page, at: np.ndarray, along: np.ndarray, pixels: float) -> None:
    """Drag one of the arrows at the gripper.

    Args:
        page: The page.
        at: Where the tip is, from the arm's base and above the floor (3,) [m].
        along: The arrow's direction (3,).
        pixels: How far.
    """
    centre, ahead = [await _on_screen(page, place) for place in (at, at + 0.03 * along)]
    direction = (ahead - centre) / np.linalg.norm(ahead - centre)
    start = centre + 50.0 * direction
    await page.mouse.move(*map(float, start))
    await asyncio.sleep(0.2)  # the handle lights up
    await page.mouse.down()
    for share in np.linspace(0.1, 1.0, 10):
        await page.mouse.move(*map(float, start + share * pixels * direction))
        await asyncio.sleep(0.05)


async def drag_until_it_follows(page: Page, along: np.ndarray, pixels: float) -> None:
    """Drag an arrow until the arm has followed it and stands; again where a loaded machine made the page let go."""
    async with asyncio.timeout(PATIENCE):
        while True:
            before = await tip(page)
            await drag_handle(page, before, along, pixels)
            for _ in range(50):
                await asyncio.sleep(0.1)
                if np.linalg.norm(await tip(page) - before) > 0.005:
                    await standing(page)
                    await page.mouse.up()
                    return
                if "Stopped:" in await page.locator(REASON).inner_text():
                    break
            await page.mouse.up()
            await standing(page)


async def _on_screen(page: Page, place: np.ndarray) -> np.ndarray:
    x, y, z = (float(value) for value in place + (0.29, 0.0, 0.0))
    found = await page.evaluate(
        "([x, y, z]) => window.farsteerFigures().screenPoint(x, y, z)", [x, y, z]
    )
    return np.array([found["x"], found["y"]])
