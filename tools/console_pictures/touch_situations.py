"""Situations in which the console page is photographed on tablets and phones."""

from __future__ import annotations

import asyncio
from typing import Any

from tests.teleop.console.hands import press
from tools.console_pictures.handling import carry_off, place_hint
from tools.console_pictures.studio import PHONE, REST, TABLET, UPRIGHT, Studio


async def _touched(studio: Studio, name: str, device: dict[str, Any]) -> None:
    """Drive by a finger on the stick."""
    async with studio.robot() as robot, studio.placed(robot, **device) as page:
        box = await page.locator(".driving-stick").bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        session = await page.context.new_cdp_session(page)

        async def finger(kind: str, *points: tuple[float, float]) -> None:
            touches = [{"x": at[0], "y": at[1], "id": 1} for at in points]
            await session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

        await finger("touchStart", (x, y))
        for share in (0.1, 0.25, 0.4):
            await asyncio.sleep(0.2)
            await finger("touchMove", (x + 0.1 * box["width"], y - share * box["height"]))
        await asyncio.sleep(4.0)
        await studio.shoot(page, name)
        await finger("touchEnd")


async def tablet(studio: Studio, name: str) -> None:
    """A tablet held upright, driven by a finger."""
    await _touched(studio, name, TABLET)


async def phone(studio: Studio, name: str) -> None:
    """A phone held across, driven by a finger."""
    await _touched(studio, name, PHONE)


async def phone_upright(studio: Studio, name: str) -> None:
    """A phone held upright, driven by a finger."""
    await _touched(studio, name, UPRIGHT)


async def phone_panels(studio: Studio, name: str) -> None:
    """A phone whose robot is lost, with the panels opened."""
    async with studio.robot() as robot, studio.placed(robot, **PHONE) as page:
        await carry_off(page, robot)
        await press(page, "Panels")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def phone_hint(studio: Studio, name: str) -> None:
    """A hint on a phone."""
    async with studio.robot() as robot, studio.placed(robot, **PHONE) as page:
        await carry_off(page, robot)
        await place_hint(page, robot, 0.15, 0.06)
        await studio.shoot(page, name)
