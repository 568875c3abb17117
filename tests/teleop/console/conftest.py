"""The console page in Debian's Chromium, over a real robot."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple, Protocol, TypeAlias
from urllib.parse import urlsplit

import pytest
from playwright.async_api import Browser, ConsoleMessage, Page, Playwright, async_playwright

from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.robot.serving.address import Address
from teleop.robot.serving.serve_config import ServeConfig
from teleop.scene_clouds import scene_cloud_path
from tests.teleop.console.hands import seen
from tests.teleop.console.paced_robot import PacedRobot, paced_robot
from tests.teleop.support import PATIENCE, ROOT, real_time

FLAGS: Final = ("--enable-unsafe-swiftshader", "--no-sandbox", "--disable-dev-shm-usage")
"""WebGL without a graphics card; tests run as root, in containers with little shared memory."""
PLAIN_PICTURE: Final = """
try { localStorage.setItem('farsteer.shown', JSON.stringify({ oldSweeps: false, minimap: false }));
  localStorage.setItem('farsteer.guide-closed', 'true'); } catch {}
"""
"""A person who has been here before, and has switched off what takes time to draw without a graphics card."""
VIEWPORT: Final = {"width": 1120, "height": 600}
DEFAULT: Final = ServeConfig()


@pytest.fixture(scope="session")
def page_tools() -> None:
    """Fetch the page's test programs, axe-core and iwer among them, unless they are there."""
    command = (sys.executable, ROOT / "tools/build-console", "--fetch-node", "--dev")
    subprocess.run(command, check=True, capture_output=True)


@dataclass
class Visit:
    """A page in a browser, and what went on below it."""

    page: Page
    hosts: set[str] = field(default_factory=set)
    """Host and port of all requests, of WebSockets too."""
    paths: list[str] = field(default_factory=list)
    """Addresses of all requests, whole."""
    violations: list[str] = field(default_factory=list)
    """What the Content-Security-Policy has refused."""
    errors: list[str] = field(default_factory=list)
    """Exceptions, and lines of level error on the page's console."""


Pages: TypeAlias = Callable[..., AbstractAsyncContextManager[Visit]]


def chromium() -> str:
    """Return the path of Chromium; a test that needs it fails without it."""
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        pytest.fail("Chromium is not installed: tools/test-setup fetches it")
    return found


async def launched(playwright: Playwright) -> Browser:
    """Start a browser without a window."""
    return await playwright.chromium.launch(executable_path=chromium(), args=[*FLAGS])


@asynccontextmanager
async def _page_of(
    address: str,
    *,
    scripts: Sequence[str] = (),
    wait: str = "load",
    whole_picture: bool = False,
    **context: Any,
) -> AsyncIterator[Visit]:
    async with async_playwright() as playwright:
        browser = await launched(playwright)
        try:
            opened = await browser.new_context(**context)
            opened.set_default_timeout(PATIENCE * 1000)
            page = await opened.new_page()
            visit = Visit(page)
            await _watch(visit)
            if not whole_picture:
                await opened.add_init_script(PLAIN_PICTURE)
            for script in scripts:
                await page.add_init_script(script)
            await page.goto(address, wait_until=wait)  # type: ignore[arg-type]
            yield visit
        finally:
            await browser.close()


async def _watch(visit: Visit) -> None:
    """Note requests, violations and errors from the first one on."""

    def note(address: str) -> None:
        if not address.startswith(("data:", "blob:")):
            visit.paths.append(address)
            visit.hosts.add(urlsplit(address).netloc)

    def printed(message: ConsoleMessage) -> None:
        if message.type == "error":
            visit.errors.append(message.text)

    page = visit.page
    page.on("request", lambda request: note(request.url))
    page.on("websocket", lambda socket: note(socket.url))
    page.on("pageerror", lambda error: visit.errors.append(str(error)))
    page.on("console", printed)
    await page.expose_function("noteViolation", lambda text: visit.violations.append(text))
    await page.add_init_script(
        "addEventListener('securitypolicyviolation', event =>"
        " noteViolation(`${event.violatedDirective} ${event.blockedURI}`))"
    )


class Served(Protocol):
    """Serves robots in the office, with its map."""

    def __call__(
        self, config: ServeConfig = ..., *, lockstep: bool = True
    ) -> AbstractAsyncContextManager[Address]:
        """Serve a robot on a free port, in lockstep or in real time."""


@pytest.fixture
def served(office: World, office_cloud: Cloud, cache: Path) -> Served:
    """Return a function that serves a robot: ``async with served(config) as address``."""

    def serving(
        config: ServeConfig = DEFAULT, *, lockstep: bool = True
    ) -> AbstractAsyncContextManager[Address]:
        config = replace(config, port=0, lockstep=lockstep)
        map_file = scene_cloud_path("office")
        return real_time(office, office_cloud, cache, config, map_file=map_file)

    return serving


class Met(NamedTuple):
    """A robot that knows where it is, and somebody's page of it."""

    robot: PacedRobot
    page: Page
    visit: Visit


class Meets(Protocol):
    """Opens the page of a paced robot."""

    def __call__(
        self,
        world: World = ...,
        *,
        placed: bool = True,
        query: str = "",
        robot: Mapping[str, Any] = ...,
        **page: Any,
    ) -> AbstractAsyncContextManager[Met]:
        """Serve a robot and open its page.

        Args:
            world: The robot's world; the office by default.
            placed: Whether the robot is given its place, and waited for until it has been drawn there.
            query: What follows the page's address.
            robot: Further arguments of ``paced_robot``.
            page: Arguments of ``page_of``.
        """


@pytest.fixture
def meets(office: World, office_cloud: Cloud, cache: Path) -> Meets:
    """Return a function that serves a robot with its page: ``async with meets() as (robot, page, visit)``."""

    @asynccontextmanager
    async def meeting(
        world: World = office,
        *,
        placed: bool = True,
        query: str = "",
        robot: Mapping[str, Any] = MappingProxyType({}),
        **page: Any,
    ) -> AsyncIterator[Met]:
        async with (
            paced_robot(world, office_cloud, cache, **robot) as served,
            _page_of(f"{served.page}{query}", **{"viewport": VIEWPORT} | page) as visit,
        ):
            if placed:
                served.place()
                await seen(visit.page)
            yield Met(served, visit.page, visit)

    return meeting


def page_address(robot: Address) -> str:
    """Return the address of a robot's page on this machine."""
    return f"{'https' if robot.encrypted else 'http'}://127.0.0.1:{robot.port}/"


@pytest.fixture
def page_of() -> Pages:
    """Return a function that opens an address: ``async with page_of(address, scripts=...) as visit``.

    ``scripts`` run in the page before its own; further arguments are those of a browser context, such as
    ``viewport``, ``has_touch`` or ``ignore_https_errors``.
    """
    return _page_of
