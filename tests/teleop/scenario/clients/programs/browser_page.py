"""The console page of the robot under test, in a browser, with a synthetic gamepad that goes straight on."""

from __future__ import annotations

import asyncio
import os

from playwright.async_api import Error

from tests.teleop.console.conftest import _page_of as page_of
from tests.teleop.console.hands import GAMEPAD, hold_until, pad, plug, says


async def drive() -> None:
    view = {"width": 700, "height": 450}
    async with page_of(os.environ["FARSTEER_PAGE"], scripts=[GAMEPAD], viewport=view) as visit:
        page = visit.page
        await says(page, "Knows where it is")
        await plug(page)
        await pad(page, 0.0, deadman=False)
        await asyncio.sleep(0.2)

        async def hold(held: bool) -> None:
            await pad(page, 0.0, deadman=held)
            await asyncio.sleep(0.1)
            if held:
                await pad(page, 1.0)

        # It is at the run's end that it is ended; a person would see the robot arrive.
        await hold_until(page, hold, lambda: False, "the end of the run")


if __name__ == "__main__":
    try:
        asyncio.run(drive())
    except Error as error:
        print(error)
        raise SystemExit(1) from None
