"""A drive with a hint as an animated picture."""

from __future__ import annotations

import asyncio
import base64
import io
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from PIL import Image
from playwright.async_api import Page

from tests.teleop.console.hands import hold_until, key, place_on_screen, press, says
from tests.teleop.console.paced_robot import PacedRobot
from tools.console_pictures.studio import Studio

VIEWPORT: Final = {"width": 1040, "height": 600}
WIDTH: Final = 720
"""Width of the animation [pixels]."""
PERIOD: Final = 0.23
"""Time between its pictures [s]."""
LONGEST: Final = 0.3
"""Longest that one picture is shown [s]: a machine that was too busy to draw is not waited for."""
LENGTH: Final = 20.0
"""Longest animation [s]; what took longer without a graphics card is shown faster."""
SIZE: Final = 1_200_000
"""Largest file [bytes]."""
QUALITIES: Final = (60, 50, 40, 35, 30, 20, 10)

HAND: Final = """
(() => {
  const hand = document.body.appendChild(document.createElement('div'));
  Object.assign(hand.style, { position: 'fixed', zIndex: 99, width: '22px', height: '22px', margin: '-11px',
    borderRadius: '50%', border: '3px solid #d9480f', background: 'rgb(217 72 15 / 25%)', pointerEvents: 'none' });
  const follow = ({ clientX, clientY, buttons }) => {
    hand.style.left = `${clientX}px`;
    hand.style.top = `${clientY}px`;
    hand.style.background = `rgb(217 72 15 / ${buttons ? 75 : 25}%)`;
  };
  for (const kind of ['pointermove', 'pointerdown', 'pointerup']) addEventListener(kind, follow, true);
})();
"""
"""Shows where the mouse is, which is not in a picture of the page."""


@dataclass
class Film:
    """What a page looked like, and when."""

    frames: list[tuple[float, bytes]] = field(default_factory=list)
    """Times [s] and pictures as JPEG, in ascending order."""

    def pictures(self) -> list[tuple[Image.Image, float]]:
        """Return pictures with how long each is shown [s], a period apart at least."""
        kept: list[tuple[float, bytes]] = []
        for time, frame in self.frames:
            if not kept or time - kept[-1][0] >= PERIOD:
                kept.append((time, frame))
        ends = [*(time for time, _ in kept[1:]), kept[-1][0] + LONGEST]
        return [
            (_scaled(frame), min(end - time, LONGEST))
            for (time, frame), end in zip(kept, ends, strict=True)
        ]


def _scaled(frame: bytes) -> Image.Image:
    with Image.open(io.BytesIO(frame)) as picture:
        height = round(picture.height * WIDTH / picture.width)
        return picture.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)


@asynccontextmanager
async def filmed(page: Page) -> AsyncIterator[Film]:
    """Film a page as long as the context lasts."""
    film = Film()
    session = await page.context.new_cdp_session(page)
    tasks: set[asyncio.Task[Any]] = set()

    def frame(event: dict[str, Any]) -> None:
        film.frames.append((event["metadata"]["timestamp"], base64.b64decode(event["data"])))
        answer = {"sessionId": event["sessionId"]}
        task = asyncio.create_task(session.send("Page.screencastFrameAck", answer))
        tasks.add(task)
        task.add_done_callback(tasks.discard)

    session.on("Page.screencastFrame", frame)
    await session.send("Page.startScreencast", {"format": "jpeg", "quality": 92})
    yield film
    await session.send("Page.stopScreencast")


def write(film: Film, path: Path) -> str:
    """Write an animated WebP, as good as fits into the size, and return its figures in words."""
    pictures = film.pictures()
    first, *rest = [picture for picture, _ in pictures]
    faster = max(sum(time for _, time in pictures) / LENGTH, 1.0)
    shown = [round(1000 * time / faster) for _, time in pictures]
    for quality in QUALITIES:
        file = io.BytesIO()
        first.save(
            file,
            "WEBP",
            save_all=True,
            append_images=rest,
            duration=shown,
            loop=0,
            quality=quality,
            method=6,
        )
        if len(file.getvalue()) <= SIZE:
            break
    path.write_bytes(file.getvalue())
    said = f"{path}: {len(pictures)} pictures, {sum(shown) / 1000:.1f} s, quality {quality}"
    said += f", {faster:.1f} times as fast"
    return f"{said}, {path.stat().st_size / 1e6:.2f} MB"


async def film_of_a_drive(studio: Studio) -> Film:
    """Film a robot that is driven, carried off, shown where it is, and driven on."""
    async with (
        studio.robot() as robot,
        studio.placed(robot, viewport=VIEWPORT) as page,
    ):
        await page.locator(".page-canvas canvas").click(position={"x": 300, "y": 120})
        await press(page, "Close")
        await page.evaluate(HAND)
        async with filmed(page) as film:
            await _drive(page, robot)
            robot.carry(16.0, 3.2, 0.9)
            await says(page, "In doubt where it is")
            await asyncio.sleep(1.5)
            await _hint(page, robot)
            await says(page, "Accepted")
            await asyncio.sleep(1.0)
            await _drive(page, robot)
            return film


async def _drive(page: Page, robot: PacedRobot) -> None:
    hold = key(page, "ArrowUp")
    await hold_until(page, hold, lambda: robot.speed > 0.2, "that the robot drives")
    await asyncio.sleep(1.5)
    await page.keyboard.down("ArrowRight")
    await asyncio.sleep(0.8)
    await page.keyboard.up("ArrowRight")
    await asyncio.sleep(1.2)
    await hold(False)
    await asyncio.sleep(0.5)


async def _hint(page: Page, robot: PacedRobot) -> None:
    await press(page, "Show where it is")
    await asyncio.sleep(1.2)
    truth = robot.simulation.truth().map_from_base
    x, y = (float(v) for v in truth.position[:2])
    start = await place_on_screen(page, x + 0.1, y - 0.1)
    away = await place_on_screen(page, x + 2.0, y + 1.0)
    end = await place_on_screen(page, x + 1.4, y + 1.6)
    await page.mouse.move(*start, steps=3)
    await page.mouse.down()
    for place in (away, end):
        for share in range(1, 5):
            at = [
                a + (b - a) * share / 4
                for a, b in zip(start if place is away else away, place, strict=True)
            ]
            await page.mouse.move(at[0], at[1])
            await asyncio.sleep(0.1)
    await page.mouse.up()
    await says(page, "fits", within=".panel-preview")
    await asyncio.sleep(1.2)
    await page.get_by_role("button", name="It is here").hover()
    await press(page, "It is here")
