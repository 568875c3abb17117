"""Losing a headset at full speed: one trial of one way in which the person may be gone, or the hand."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from functools import partial
from random import Random
from typing import Final

from playwright.async_api import Page

from benchmarks.console.losses import HIDE, LONGEST, START, WATCHED
from tests.teleop.console.hands import hold_until
from tests.teleop.console.headset_hands import FRAME, enter, figures, grip, worn
from tests.teleop.console.paced_robot import TICK, PacedRobot


@dataclass(frozen=True, slots=True)
class HeadsetLoss:
    """What became of one trial."""

    kind: str
    """How the person or the hand was lost."""
    stopped_after_s: float
    """Simulated time from the last command that was taken to the zero command [s]; infinite if none came."""
    drove_on: bool
    """Whether the robot moved again while the grip was still held, after everything was back."""
    back_after_s: float
    """Time from when everything was back until the page shows frames and takes letting go and pressing again [s]."""
    said: str
    """What the page says of it."""


async def trial(page: Page, robot: PacedRobot, kind: str, chance: Random) -> HeadsetLoss:
    """Drive at full speed in a headset, lose it, have it back, and drive again.

    Args:
        page: The page, with the tests' headset.
        robot: Its robot.
        kind: One of ``KINDS``.
        chance: Chooses the moment.
    """
    if await figures(page) is None:
        await enter(page)
    robot.carry(*START)
    robot.place()
    hold, fast = grip(page), partial(_fast, robot)
    await hold_until(page, hold, fast, "that it drives at full speed")
    await _simulated(robot, chance.uniform(0.0, 0.4))
    async with _LOSSES[kind](page, robot):
        stopped = await _stopped(robot)
        await page.locator(".driving-status").get_by_text("Stopped:").wait_for()
        said = await page.locator(".driving-status").inner_text()
    begun = len(robot.ticks)
    back_after = float(await page.evaluate(BACK)) / 1000.0
    await _simulated(robot, WATCHED)
    drove_on = any(tick.moves for tick in robot.ticks[begun:])
    await hold(False)
    await asyncio.sleep(2 * FRAME)
    await hold_until(page, hold, fast, f"that it drives again after {kind}")
    await hold(False)
    return HeadsetLoss(kind, stopped, drove_on, back_after, " ".join(said.split()))


BACK: Final = """async () => {
  const [begun, frame] = [performance.now(), () => new Promise((done) => { setTimeout(done, 5); })];
  if (!farsteerFigures().headset) document.querySelector('[aria-label="Enter VR"]').click();
  while (!farsteerFigures().headset) await frame();
  const { count } = window.worn;
  while (window.worn.count < count + 2) await frame();
  while (!document.querySelector('.driving-status').textContent.includes('Stopped:')) await frame();
  return performance.now() - begun;
}"""
"""Goes in again where the session is over; by the page's clock, for presses sent by Playwright wait for the processor that draws."""


def _fast(robot: PacedRobot) -> bool:
    return robot.speed > SLOWED and robot.ticks[-1].moves


SLOWED: Final = 0.4
"""Speed from which on it drives in the gear that a page begins with [m/s]; that asks for 0.5 m/s."""


async def _stopped(robot: PacedRobot) -> float:
    """Wait until the command in force is zero; return the age of the last command before [s]."""
    begun = len(robot.ticks)
    while robot.ticks[-1].moves:
        if (len(robot.ticks) - begun) * TICK > LONGEST:
            return float("inf")
        await asyncio.sleep(TICK)
    last = max(at for at, tick in enumerate(robot.ticks) if tick.moves)
    return robot.ticks[last].age + TICK


async def _simulated(robot: PacedRobot, seconds: float) -> None:
    """Let simulated time pass."""
    end = len(robot.ticks) + seconds / TICK
    while len(robot.ticks) < end:  # noqa: ASYNC110 - the robot has no event for it
        await asyncio.sleep(TICK)


@asynccontextmanager
async def _visibility(state: str, page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The headset is taken off, or its own menu is in front."""
    set_to = "state => window.worn.device.updateVisibilityState(state)"
    await page.evaluate(set_to, state)
    yield
    await page.evaluate(set_to, "visible")


@asynccontextmanager
async def _frames(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The headset sleeps: no frame comes, and no event reports it."""
    await worn(page, "frames", False)
    yield
    await worn(page, "frames", True)


@asynccontextmanager
async def _hidden(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The page is hidden."""
    await page.evaluate(HIDE, True)
    yield
    await page.evaluate(HIDE, False)


@asynccontextmanager
async def _ended(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The headset ends the session."""
    await page.evaluate("window.worn.device.activeSession.end()")
    yield


@asynccontextmanager
async def _unconnected(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The controller is gone."""
    await page.evaluate("window.worn.device.controllers.right.connected = false; 0")
    yield
    await page.evaluate("window.worn.device.controllers.right.connected = true; 0")


@asynccontextmanager
async def _lies(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The controller lies on the table, and its reported pose is invalid."""
    await worn(page, "lie", "right", True)
    yield
    await worn(page, "lie", "right", False)


@asynccontextmanager
async def _recentred(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The person recentres the view."""
    await page.evaluate("window.worn.device.recenter()")
    yield


@asynccontextmanager
async def _reset(page: Page, _robot: PacedRobot) -> AsyncIterator[None]:
    """The room's origin moves, and the headset does not know how far."""
    await worn(page, "reset", None)
    yield


@asynccontextmanager
async def _dropped(page: Page, robot: PacedRobot) -> AsyncIterator[None]:
    """The socket drops, as some headsets' browsers do."""
    robot.proxy.drop()
    yield


_LOSSES: Final[dict[str, Callable[[Page, PacedRobot], AbstractAsyncContextManager[None]]]] = {
    "headset off": partial(_visibility, "hidden"),
    "menu in front": partial(_visibility, "visible-blurred"),
    "no frames": _frames,
    "page hidden": _hidden,
    "session ended": _ended,
    "controller gone": _unconnected,
    "controller on the table": _lies,
    "recentred": _recentred,
    "origin moved unknown": _reset,
    "socket dropped": _dropped,
}
KINDS: Final = tuple(_LOSSES)
"""The ways to lose it."""
EXPECTED: Final = {
    "headset off": "taken off",
    "menu in front": "its own menu",
    "no frames": "taken off",
    "page hidden": "hidden",
    "session ended": "left the page",
    "controller gone": "controller is not seen",
    "controller on the table": "controller is not seen",
    "recentred": "origin",
    "origin moved unknown": "origin",
    "socket dropped": "Stopped: the connection",
}
"""What the page says of each."""
