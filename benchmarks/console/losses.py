"""Losing it at full speed: one trial of one way to lose the console page's grip on the robot.

Each happens to the real page in a real browser, as the browser itself reports it, save two: Chromium without a window
hides no tab, and has no gamepads, so a tab's visibility and the gamepad are synthetic.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from random import Random
from typing import Final

from playwright.async_api import Browser, CDPSession, Page

from tests.teleop.console.conftest import FLAGS, chromium
from tests.teleop.console.hands import hold_until, key, pad, plug
from tests.teleop.console.paced_robot import TICK, PacedRobot
from tests.teleop.support import PATIENCE

LIMIT: Final = 0.5 + TICK
"""Time from the last command to the zero that the watchdog allows [s]."""
START: Final = (24.2, 3.0, 3.14159)
"""Where each trial begins in the office: x, y [m], heading [rad]."""
FULL: Final = 0.6
"""Speed from which on the robot drives at full speed [m/s]; turbo asks for 0.7 m/s."""
WATCHED: Final = 1.0
"""Time for which the robot has to stand when everything is back [s]."""
LONGEST: Final = 5.0
"""Time after which a robot that drives on counts as not stopped at all [s]."""

HIDE: Final = """hidden => {
  Object.defineProperty(document, 'visibilityState', { configurable: true, value: hidden ? 'hidden' : 'visible' });
  document.dispatchEvent(new Event('visibilitychange'));
}"""


@dataclass(frozen=True, slots=True)
class Loss:
    """What became of one trial."""

    kind: str
    """How the grip was lost."""
    stopped_after_s: float
    """Simulated time from the last command that was taken before the stop to the zero command [s]; infinite if
    none came."""
    drove_on: bool
    """Whether the robot moved again without a new press when everything was back."""
    said: str
    """What the page says of it; of a page that is gone, what another one says of the robot."""


@dataclass(frozen=True, slots=True)
class _Grip:
    """A hand on a page."""

    page: Page
    robot: PacedRobot
    hold: Callable[[bool], Awaitable[object]]
    chance: Random
    devtools: CDPSession


async def trial(page: Page, robot: PacedRobot, kind: str, chance: Random) -> Loss:
    """Drive at full speed, lose the grip at a random moment, and be back.

    Args:
        page: The page, with the synthetic gamepad of the tests' hands, connected.
        robot: Its robot.
        kind: One of ``KINDS``.
        chance: Chooses the moment, the length, and the input where any will do.
    """
    async with AsyncExitStack() as stack:
        driver = await stack.enter_async_context(_driver(page, robot, kind))
        await _free(driver)
        robot.carry(*START)
        robot.place()
        devtools = await driver.context.new_cdp_session(driver)
        hold, let_go = await _input(driver, devtools, kind, chance)
        stack.push_async_callback(let_go)
        grip = _Grip(driver, robot, hold, chance, devtools)
        await driver.keyboard.press("3")  # turbo

        def fast() -> bool:
            return robot.speed > FULL and robot.ticks[-1].moves

        await hold_until(driver, hold, fast, "that it drives at full speed")
        await _simulated(robot, chance.uniform(0.0, 0.4))
        async with _LOSSES[kind](grip):
            stopped = await _stopped(robot)
            said = await page.locator(".driving-panel").inner_text() if driver.is_closed() else ""
        begun = len(robot.ticks)
        if not said:
            await driver.locator(".driving-status").get_by_text("Stopped:").wait_for()
            said = await driver.locator(".driving-status").inner_text()
        await _still_held(grip)
        await _simulated(robot, WATCHED)
        drove_on = any(tick.moves for tick in robot.ticks[begun:])
    return Loss(kind, stopped, drove_on, " ".join(said.split()))


@asynccontextmanager
async def _driver(page: Page, robot: PacedRobot, kind: str) -> AsyncIterator[Page]:
    """Yield the page that is to lose its grip: another one if it will not be back."""
    if kind == "killed":
        assert page.context.browser is not None
        kind_of_browser = page.context.browser.browser_type
        browser = await kind_of_browser.launch(executable_path=chromium(), args=[*FLAGS])
        own = await browser.new_page(viewport={"width": 1120, "height": 600})
    elif kind == "closed":
        own = await page.context.new_page()
    else:
        yield page
        return
    own.set_default_timeout(PATIENCE * 1000)
    await own.goto(robot.page)
    try:
        yield own
    finally:
        if kind == "killed":
            with contextlib.suppress(Exception):
                await browser.close()


async def _free(page: Page) -> None:
    """Wait until the page can drive."""
    status = page.locator(".driving-status")
    ready = status.get_by_text("Ready").or_(status.get_by_text("Press again to drive."))
    await ready.first.wait_for()


async def _input(
    page: Page, devtools: CDPSession, kind: str, chance: Random
) -> tuple[Callable[[bool], Awaitable[object]], Callable[[], Awaitable[object]]]:
    """Return what drives or lets go, and what puts it away."""
    if kind == "touch lost":
        hold = await _finger(page, devtools)
        return hold, _nothing
    by_key = kind in ("key-up lost", "closed", "killed") or chance.random() < 0.5
    if by_key and kind != "gamepad unplugged":
        hold = key(page, "w")

        async def up() -> None:
            if not page.is_closed():
                await hold(False)

        return hold, up
    await plug(page)
    await pad(page, 0.0, deadman=False)

    async def push(held: bool) -> None:
        await pad(page, 0.0, deadman=held)
        await asyncio.sleep(0.1)
        await pad(page, 0.9 if held else 0.0, deadman=held)

    async def away() -> None:
        await push(False)
        await plug(page, False)

    return push, away


async def _nothing() -> None:
    pass


async def _finger(page: Page, devtools: CDPSession) -> Callable[[bool], Awaitable[object]]:
    """Return a finger on the stick on the screen."""
    box = await page.locator(".driving-stick").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + 0.8 * box["height"]

    async def hold(held: bool) -> None:
        if not held:
            await devtools.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
            return
        for kind, up in (("touchStart", 0.0), ("touchMove", 20.0), ("touchMove", 70.0)):
            points = [{"x": x, "y": y - up}]
            await devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    return hold


async def _stopped(robot: PacedRobot) -> float:
    """Wait until the command in force is zero; return the age of the last command before [s]."""
    begun = len(robot.ticks)
    while robot.ticks[-1].moves:
        if (len(robot.ticks) - begun) * TICK > LONGEST:
            return float("inf")
        await asyncio.sleep(TICK)
    last = max(at for at, tick in enumerate(robot.ticks) if tick.moves)
    await _simulated(robot, 0.3)
    return robot.ticks[last].age + TICK


async def _simulated(robot: PacedRobot, seconds: float) -> None:
    """Let simulated time pass."""
    end = len(robot.ticks) + seconds / TICK
    while len(robot.ticks) < end:  # noqa: ASYNC110 - the robot has no event for it
        await asyncio.sleep(TICK)


async def _still_held(grip: _Grip) -> None:
    """Repeat the keys that are still down, as a keyboard does."""
    if not grip.page.is_closed() and grip.hold.__qualname__.startswith("key"):
        for _ in range(5):
            await grip.hold(True)
            await asyncio.sleep(0.1)


@asynccontextmanager
async def _hidden(grip: _Grip) -> AsyncIterator[None]:
    """Another tab is in front."""
    await grip.page.evaluate(HIDE, True)
    yield
    await grip.page.evaluate(HIDE, False)


@asynccontextmanager
async def _blurred(grip: _Grip) -> AsyncIterator[None]:
    """Another window has the focus."""
    other = await grip.page.context.new_page()
    await grip.devtools.send("Emulation.setFocusEmulationEnabled", {"enabled": False})
    await other.bring_to_front()
    yield
    await other.close()
    await grip.page.bring_to_front()
    await grip.devtools.send("Emulation.setFocusEmulationEnabled", {"enabled": True})


@asynccontextmanager
async def _touch_lost(grip: _Grip) -> AsyncIterator[None]:
    """The system takes the touch away."""
    await grip.devtools.send("Input.dispatchTouchEvent", {"type": "touchCancel", "touchPoints": []})
    yield


@asynccontextmanager
async def _key_up_lost(grip: _Grip) -> AsyncIterator[None]:
    """A menu or a shortcut takes the keys, and the page does not see them go up."""
    if grip.chance.random() < 0.5:
        await grip.page.get_by_role("heading").first.click(button="right")
    else:
        await grip.page.keyboard.press("Control")
    yield


@asynccontextmanager
async def _unplugged(grip: _Grip) -> AsyncIterator[None]:
    """The gamepad is pulled out with its stick pushed, and plugged in again."""
    await plug(grip.page, False)
    yield
    await plug(grip.page)


@asynccontextmanager
async def _asleep(grip: _Grip) -> AsyncIterator[None]:
    """The computer sleeps: the page's processes get no time, and notice nothing of it."""
    processes = await _processes(grip.page.context.browser)
    pages = [process for kind, process in processes if kind == "renderer"]
    for process in pages:
        os.kill(process, signal.SIGSTOP)
    try:
        yield
        await asyncio.sleep(grip.chance.uniform(0.2, 1.5))
    finally:
        for process in pages:
            os.kill(process, signal.SIGCONT)


@asynccontextmanager
async def _closed(grip: _Grip) -> AsyncIterator[None]:
    """The page is closed."""
    await grip.page.close()
    yield


@asynccontextmanager
async def _killed(grip: _Grip) -> AsyncIterator[None]:
    """The browser's processes are killed."""
    gone = asyncio.Event()
    grip.page.on("close", lambda _page: gone.set())
    for _kind, process in await _processes(grip.page.context.browser):
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    await gone.wait()
    yield


@asynccontextmanager
async def _network_gone(grip: _Grip) -> AsyncIterator[None]:
    """Nothing goes through any more, and no connection is closed."""
    grip.robot.proxy.cut()
    yield
    await asyncio.sleep(grip.chance.uniform(0.2, 1.5))
    grip.robot.proxy.restore()


async def _processes(browser: Browser | None) -> list[tuple[str, int]]:
    """Return kind and number of a browser's processes, the main one first."""
    assert browser is not None
    devtools = await browser.new_browser_cdp_session()
    found = await devtools.send("SystemInfo.getProcessInfo")
    return [(process["type"], process["id"]) for process in found["processInfo"]]


_LOSSES: Final[dict[str, Callable[[_Grip], AbstractAsyncContextManager[None]]]] = {
    "tab hidden": _hidden,
    "focus lost": _blurred,
    "touch lost": _touch_lost,
    "key-up lost": _key_up_lost,
    "gamepad unplugged": _unplugged,
    "asleep": _asleep,
    "closed": _closed,
    "network gone": _network_gone,
    "killed": _killed,
}
KINDS: Final = tuple(_LOSSES)
"""The ways to lose one's grip."""
EXPECTED: Final = {
    "tab hidden": "the tab was hidden",
    "focus lost": "another window took the keys",
    "touch lost": "the system took the touch away",
    "key-up lost": "a menu took the keys",
    "gamepad unplugged": "the gamepad was unplugged",
    "asleep": "the computer slept",
    "closed": "left",
    "network gone": "the robot said nothing for a second",
    "killed": "left",
}
"""What the page says of each."""
