"""Situations in which the console page is photographed, each with a robot of its own."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Mapping
from typing import Final

from playwright.async_api import Page, TimeoutError as PlaywrightTimeoutError

from teleop.scene_clouds import load_scene_cloud
from tests.teleop.console.hands import press, says
from tests.teleop.console.paced_robot import PacedRobot
from tools.console_pictures.handling import carry_off, drive, place_hint
from tools.console_pictures.plain_rosbridge import plain_page
from tools.console_pictures.studio import REST, Studio
from tools.console_pictures.touch_situations import (
    phone,
    phone_hint,
    phone_panels,
    phone_upright,
    tablet,
)

CALM: Final = 15.0
"""Time to wait for a page without alarms [s]."""

Situation = Callable[[Studio, str], Awaitable[None]]
"""Makes a picture of the given name."""


async def driving(studio: Studio, name: str) -> None:
    """Driving by keys, seen from behind."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await _through_the_door(page, robot)
        await studio.shoot(page, name)


async def normal(studio: Studio, name: str) -> None:
    """A robot that has just been driven."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await _stand(page, robot)
        await studio.shoot(page, name)


async def night(studio: Studio, name: str) -> None:
    """The same at night."""
    async with studio.robot() as robot, studio.placed(robot, color_scheme="dark") as page:
        await _stand(page, robot)
        await studio.shoot(page, name)


async def _through_the_door(page: Page, robot: PacedRobot) -> None:
    await drive(page, robot, "ArrowUp", 5.0)
    await page.keyboard.down("ArrowRight")
    await asyncio.sleep(2.0)


async def _stand(page: Page, robot: PacedRobot) -> None:
    """Drive, and stand until the picture is complete again."""
    await _through_the_door(page, robot)
    await page.keyboard.up("ArrowRight")
    await page.keyboard.up("ArrowUp")
    await asyncio.sleep(REST)
    if "again" in await page.locator(".driving-status").inner_text():
        await page.keyboard.press(
            "ArrowUp"
        )  # the page was too busy to know whether the key was held
    await says(page, "Ready")
    await asyncio.sleep(4 * REST)
    # On a loaded machine the link stays bad, and the picture shows it.
    with contextlib.suppress(PlaywrightTimeoutError):
        alarms = page.locator(".panel-alarm-list")
        await alarms.wait_for(state="detached", timeout=CALM * 1000)


async def from_above(studio: Studio, name: str) -> None:
    """The view from above."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await page.keyboard.press("v")
        await drive(page, robot, "ArrowUp", 4.0)
        await studio.shoot(page, name)


async def first_person(studio: Studio, name: str) -> None:
    """The view with the robot's eyes."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await page.keyboard.press("v")
        await page.keyboard.press("v")
        await drive(page, robot, "ArrowUp", 3.0)
        await studio.shoot(page, name)


async def waiting(studio: Studio, name: str) -> None:
    """A robot that does not know where it is yet."""
    async with studio.robot() as robot, studio.page(robot.page) as page:
        await says(page, "Ready")
        await asyncio.sleep(5 * REST)
        await studio.shoot(page, name)


async def lost(studio: Studio, name: str) -> None:
    """A robot that was carried off."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await carry_off(page, robot)
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def hint_good(studio: Studio, name: str) -> None:
    """A hint that fits, before it is confirmed."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await carry_off(page, robot)
        await place_hint(page, robot, 0.15, 0.06)
        await studio.shoot(page, name)


async def hint_bad(studio: Studio, name: str) -> None:
    """A hint that does not fit."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await carry_off(page, robot)
        await place_hint(page, robot, -3.0, 1.2)
        await studio.shoot(page, name)


async def ambiguous(studio: Studio, name: str) -> None:
    """A search that finds several places alike."""
    async with studio.robot("corridor") as robot, studio.page(robot.page) as page:
        robot.carry(20.0, 4.0, 0.0)
        await says(page, "Ready")
        await page.keyboard.press("v")
        await asyncio.sleep(2 * REST)
        await press(page, "Find it in the whole map")
        await says(page, "places explain")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def refused(studio: Studio, name: str) -> None:
    """Commands that do not count: a key is still held from before the network failed."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await drive(page, robot, "ArrowUp", 1.0)
        robot.proxy.cut()
        await says(page, "Nothing received for")
        await asyncio.sleep(REST)
        robot.proxy.restore()
        await says(page, "again")
        await says(page, "Knows where it is")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def estop(studio: Studio, name: str) -> None:
    """The e-stop, latched, and the question before its release."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await drive(page, robot, "ArrowUp", 1.0)
        await page.keyboard.press("Escape")
        await page.keyboard.up("ArrowUp")
        await says(page, "E-stop, pressed by you")
        await press(page, "Release e-stop")
        await says(page, "Are people and things clear")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def stale(studio: Studio, name: str) -> None:
    """A network that is gone."""
    async with studio.robot() as robot, studio.placed(robot) as page:
        await drive(page, robot, "ArrowUp", 2.0)
        robot.proxy.cut()
        await says(page, "Nothing received for")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def two_operators(studio: Studio, name: str) -> None:
    """Another person asks for the robot that this one drives."""
    async with (
        studio.robot(tokens=True) as robot,
        studio.placed(robot, person="anna") as page,
        studio.page(robot.page, person="boris") as other,
    ):
        await says(other, "Knows where it is")
        await drive(page, robot, "ArrowUp", 0.5)
        await press(other, "Ask for the robot")
        await says(page, "asks for the robot")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def observer(studio: Studio, name: str) -> None:
    """Somebody who may only watch while another one drives."""
    async with (
        studio.robot(tokens=True) as robot,
        studio.placed(robot, person="anna") as driver,
        studio.page(robot.page, person="visitor") as page,
    ):
        await drive(driver, robot, "ArrowUp", 2.0)
        await says(page, "You may only watch")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def login(studio: Studio, name: str) -> None:
    """A robot that asks for a token."""
    async with studio.robot(tokens=True) as robot, studio.page(robot.page) as page:
        await says(page, "Log in")
        await asyncio.sleep(REST)
        await studio.shoot(page, name)


async def plain(studio: Studio, name: str) -> None:
    """A rosbridge of standard types that knows nothing of the page."""
    async with studio.robot() as robot:
        robot.place()
        cloud = load_scene_cloud("office")
        address = robot.page.replace("http", "ws").rstrip("/")
        async with plain_page(address, cloud) as url, studio.page(url) as page:
            await says(page, "Nothing guards this robot")
            await press(page, "Drive by /cmd_vel")
            await drive(page, robot, "ArrowUp", 3.0)
            await studio.shoot(page, name)


SITUATIONS: Final[Mapping[str, Situation]] = {
    name.replace("_", "-"): situation
    for name, situation in {
        "normal": normal,
        "driving": driving,
        "night": night,
        "from_above": from_above,
        "first_person": first_person,
        "waiting": waiting,
        "lost": lost,
        "hint_good": hint_good,
        "hint_bad": hint_bad,
        "ambiguous": ambiguous,
        "refused": refused,
        "estop": estop,
        "stale": stale,
        "two_operators": two_operators,
        "observer": observer,
        "login": login,
        "tablet": tablet,
        "phone": phone,
        "phone_upright": phone_upright,
        "phone_panels": phone_panels,
        "phone_hint": phone_hint,
        "plain": plain,
    }.items()
}
"""Situations by the names of their pictures."""
