"""A robot's wire with other content: each message passes a function that may put anything in its place."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from random import Random
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

HOSTILE: Final = (
    '<img src=x onerror="window.hacked=1"><script>window.hacked=1</script>'
    '"><svg onload=hacked=1>{{7*7}}\u202e\x00'
)
"""Text that does harm if it is taken for anything but text."""
NAMES: Final = frozenset(
    (
        "name",
        "names",
        "reason",
        "message",
        "controller",
        "asking_name",
        "level",
        "role",
        "label",
        "msg",
    )
)
"""Fields with words for people."""


@dataclass
class Rewriting:
    """A proxy, and what the page sent through it."""

    rewrite: Callable[[Any], Any]
    """Returns what takes the place of a message or of a service's answer."""
    url: str = ""
    commands: list[dict[str, Any]] = field(default_factory=list)
    """What the page published on /joy and /cmd_vel."""
    frames: list[str] = field(default_factory=list)
    """Frames to be sent to the page as they are, once each."""

    @property
    def moved(self) -> bool:
        """Whether the page has sent any motion."""
        return any(any(command.get("axes", ())) or "linear" in command for command in self.commands)

    async def to_robot(self, page: ServerConnection, robot: ClientConnection) -> None:
        """Pass on what the page says, asking for JSON only."""
        async for frame in page:
            operation = json.loads(frame)
            operation.pop("compression", None)
            if operation["op"] == "publish" and operation["topic"] in ("/joy", "/cmd_vel"):
                self.commands.append(operation["msg"])
            await robot.send(json.dumps(operation))

    async def to_page(self, page: ServerConnection, robot: ClientConnection) -> None:
        """Pass on what the robot says, rewritten."""
        async for frame in robot:
            operation = json.loads(frame)
            for part in ("msg", "values"):
                if part in operation:
                    operation[part] = self.rewrite(operation[part])
            await page.send(json.dumps(operation))
            while self.frames:
                await page.send(self.frames.pop())


@asynccontextmanager
async def rewriting(robot_url: str, rewrite: Callable[[Any], Any]) -> AsyncIterator[Rewriting]:
    """Serve a robot's wire anew."""
    proxy = Rewriting(rewrite)

    async def handle(page: ServerConnection) -> None:
        async with connect(robot_url, compression=None, max_size=None, proxy=None) as robot:
            both = {
                asyncio.create_task(proxy.to_robot(page, robot)),
                asyncio.create_task(proxy.to_page(page, robot)),
            }
            _done, rest = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            for task in rest:
                task.cancel()
            for outcome in await asyncio.gather(*both, return_exceptions=True):
                if isinstance(outcome, Exception) and not isinstance(outcome, ConnectionClosed):
                    raise outcome

    async with serve(handle, "127.0.0.1", 0, compression=None, max_size=None) as server:
        proxy.url = f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}"
        yield proxy


def with_hostile_names(value: Any, key: str = "") -> Any:
    """Put hostile text at the end of all words that are for people."""
    if isinstance(value, dict):
        return {name: with_hostile_names(part, name) for name, part in value.items()}
    if isinstance(value, list):
        return [with_hostile_names(part, key) for part in value]
    return value + HOSTILE if isinstance(value, str) and key in NAMES else value


def spoilt(value: Any, chance: Random) -> Any:
    """Put something of another kind into a random place of a message, or take the place away."""
    if isinstance(value, dict) and value and chance.random() < 0.9:
        name = chance.choice(list(value))
        rest = {other: part for other, part in value.items() if other != name}
        return rest if chance.random() < 0.1 else value | {name: spoilt(value[name], chance)}
    if isinstance(value, list) and value and chance.random() < 0.7:
        at = chance.randrange(len(value))
        return [*value[:at], spoilt(value[at], chance), *value[at + 1 :]]
    return chance.choice(
        [
            *(None, True, -1, 0, 1e308, 10**30, float("nan"), float("-inf"), "", "text", HOSTILE),
            *([], {}, [None] * 3, {"x": "1"}, "A" * 300_000, [0] * 100_000),
        ]
    )
