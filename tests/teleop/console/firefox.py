"""Firefox without a window, driven by WebDriver BiDi over its own WebSocket; no other program is needed."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import re
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

import pytest
from websockets.asyncio.client import ClientConnection, connect

from tests.teleop.support import PATIENCE

PREFERENCES: Final = {
    # WebGL without a graphics card, in software.
    "webgl.force-enabled": True,
    "webgl.disable-fail-if-major-performance-caveat": True,
    "gfx.webrender.software": True,
    # Nothing of its own on the network, and no page of its own at the start.
    "app.normandy.enabled": False,
    "app.update.disabledForTesting": True,
    "browser.aboutwelcome.enabled": False,
    "browser.safebrowsing.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "services.settings.server": "data:,",
    "toolkit.telemetry.enabled": False,
}
KEYS: Final = {"ArrowUp": "\ue013", "Escape": "\ue00c"}
"""How WebDriver names keys that write no character."""


class Firefox:
    """One page in Firefox."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._numbers = itertools.count(1)
        self._context = ""

    async def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result; events are dropped."""
        number = next(self._numbers)
        await self._connection.send(
            json.dumps({"id": number, "method": method, "params": parameters})
        )
        async with asyncio.timeout(PATIENCE):
            while True:
                answer = json.loads(await self._connection.recv())
                if answer.get("id") == number:
                    assert answer["type"] == "success", answer
                    result: dict[str, Any] = answer["result"]
                    return result

    async def begin(self) -> None:
        """Begin the session, with the page that there is."""
        await self.send("session.new", capabilities={})
        tree = await self.send("browsingContext.getTree")
        self._context = tree["contexts"][0]["context"]
        await self.send(
            "browsingContext.setViewport",
            context=self._context,
            viewport={"width": 1120, "height": 600},
        )

    async def open(self, address: str) -> None:
        """Open an address."""
        await self.send(
            "browsingContext.navigate", context=self._context, url=address, wait="complete"
        )

    async def reload(self) -> None:
        """Load the page again."""
        await self.send("browsingContext.reload", context=self._context, wait="complete")

    async def evaluate(self, expression: str) -> Any:
        """Return a text, number or truth value that the page computes."""
        result = await self.send(
            "script.evaluate",
            expression=expression,
            target={"context": self._context},
            awaitPromise=True,
        )
        assert result["type"] == "success", result
        return result["result"].get("value")

    async def key(self, name: str, *, down: bool) -> None:
        """Press a key down, or let it go."""
        action = {"type": "keyDown" if down else "keyUp", "value": KEYS.get(name, name)}
        await self.send(
            "input.performActions",
            context=self._context,
            actions=[{"type": "key", "id": "keyboard", "actions": [action]}],
        )

    async def click(self, selector: str, text: str = "") -> None:
        """Click on the first element that a selector finds and that has a text."""
        place = await self.evaluate(
            f"""(() => {{
              const found = [...document.querySelectorAll({json.dumps(selector)})]
                .find(element => element.textContent.includes({json.dumps(text)}));
              const box = found.getBoundingClientRect();
              return `${{Math.round(box.x + box.width / 2)}} ${{Math.round(box.y + box.height / 2)}}`;
            }})()"""
        )
        x, y = map(int, place.split())
        actions = [
            {"type": "pointerMove", "x": x, "y": y},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerUp", "button": 0},
        ]
        await self.send(
            "input.performActions",
            context=self._context,
            actions=[{"type": "pointer", "id": "mouse", "actions": actions}],
        )

    async def until(self, expression: str) -> None:
        """Wait until something is true in the page."""
        try:
            async with asyncio.timeout(PATIENCE):
                # The page has no event for it.
                while not await self.evaluate(f"Boolean({expression})"):  # noqa: ASYNC110
                    await asyncio.sleep(0.1)
        except TimeoutError:
            said = await self.evaluate("document.body.innerText")
            pytest.fail(f"waited in vain: {expression}; the page says:\n{said}")

    async def says(self, text: str) -> None:
        """Wait until the page shows a text."""
        await self.until(f"document.body.innerText.includes({json.dumps(text)})")


@asynccontextmanager
async def firefox(profile: Path) -> AsyncIterator[Firefox]:
    """Start Firefox with a profile of its own.

    Args:
        profile: An empty folder for it.
    """
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        pytest.fail("Firefox is not installed: tools/test-setup fetches it")
    lines = (f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in PREFERENCES.items())
    (profile / "user.js").write_text("\n".join(lines), encoding="utf-8")
    process = await asyncio.create_subprocess_exec(
        *(program, "--headless", "--no-remote", "--profile", str(profile)),
        *("--remote-debugging-port", "0"),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        url = await _address(process)
        async with connect(
            f"{url}/session", compression=None, ping_interval=None, max_size=None, proxy=None
        ) as connection:
            browser = Firefox(connection)
            await browser.begin()
            yield browser
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        await process.communicate()


async def _address(process: asyncio.subprocess.Process) -> str:
    """Return where Firefox takes commands, which it writes at its start."""
    assert process.stderr is not None
    async with asyncio.timeout(PATIENCE):
        while line := await process.stderr.readline():
            if found := re.search(rb"WebDriver BiDi listening on (ws://\S+)", line):
                return found[1].decode()
    pytest.fail("Firefox has ended before it listened")
