"""Opens the console page over a robot and photographs it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from playwright.async_api import Browser, Page

from robot_sim import load_world
from teleop.scene_clouds import load_scene_cloud
from tests.teleop.console.hands import GAMEPAD, says, seen
from tests.teleop.console.paced_robot import PacedRobot, paced_robot
from tests.teleop.support import PATIENCE

DESKTOP: Final[dict[str, Any]] = {"viewport": {"width": 1280, "height": 760}}
TABLET: Final[dict[str, Any]] = {"viewport": {"width": 820, "height": 1180}, "has_touch": True}
PHONE: Final[dict[str, Any]] = {
    "viewport": {"width": 844, "height": 390},
    "has_touch": True,
    "is_mobile": True,
    "device_scale_factor": 2,
}
UPRIGHT: Final[dict[str, Any]] = {**PHONE, "viewport": {"width": 390, "height": 844}}
REST: Final = 1.0
"""Time after which nothing on the page moves any more [s]."""

TOKEN: Final = "the-secret-token-of-"
TOKENS: Final = "".join(
    f'[tokens.{name}]\nrole = "{role}"\ntoken = "{TOKEN}{name}"\n'
    for name, role in (
        ("anna", "operate"),
        ("boris", "operate"),
        ("visitor", "view"),
        ("clock", "admin"),
    )
)


@dataclass(frozen=True)
class Studio:
    """A browser, and folders for what comes and goes."""

    browser: Browser
    cache: Path
    """Folder of prepared maps."""
    pictures: Path
    """Folder of the pictures."""

    @asynccontextmanager
    async def robot(
        self, scene: str = "office", *, tokens: bool = False
    ) -> AsyncIterator[PacedRobot]:
        """Serve a robot; with tokens, its people are anna, boris and a visitor."""
        file = None
        if tokens:
            file = self.cache / "tokens.toml"
            file.touch(mode=0o600)
            file.write_text(TOKENS)
        stepper = f"{TOKEN}clock" if tokens else ""
        world, cloud = load_world(scene), load_scene_cloud(scene)
        async with paced_robot(world, cloud, self.cache, tokens=file, stepper=stepper) as robot:
            yield robot

    @asynccontextmanager
    async def page(self, address: str, *, person: str = "", **context: Any) -> AsyncIterator[Page]:
        """Open a page, as somebody with a token if there are any."""
        opened = await self.browser.new_context(**{**DESKTOP, **context})
        opened.set_default_timeout(PATIENCE * 1000)
        try:
            page = await opened.new_page()
            await page.add_init_script(GAMEPAD)
            await page.goto(address + (f"#token={TOKEN}{person}" if person else ""))
            yield page
        finally:
            await opened.close()

    @asynccontextmanager
    async def placed(
        self, robot: PacedRobot, *, person: str = "", **context: Any
    ) -> AsyncIterator[Page]:
        """Open a page of a robot that knows where it is."""
        robot.place()
        async with self.page(robot.page, person=person, **context) as page:
            await says(page, "Knows where it is")
            await seen(page)
            await asyncio.sleep(REST)
            yield page

    async def shoot(self, page: Page, name: str) -> None:
        """Photograph a page."""
        await page.screenshot(path=self.pictures / f"{name}.png")
