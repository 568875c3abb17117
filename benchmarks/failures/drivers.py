"""Drivers in processes of their own: ``python -m benchmarks.failures.drivers KIND URL FORWARD TURN THEN AFTER``.

Each holds the deadman with a neutral stick for half a second, then pushes it, 20 times a second, and prints ``driving``
once. THEN is what becomes of it AFTER so many seconds of pushing: ``nothing``, or another of ``TALK``, when it prints
``failed``.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Callable
from itertools import count
from typing import Any, Final

from websockets.sync.client import connect

from localization.types import Twist
from teleop.joystick import write_joy

PERIOD: Final = 0.05
"""Time between two positions of the stick [s]."""
NEUTRAL: Final = 10
"""Positions of a neutral stick before the first push; the robot arms by them."""
TALK: Final = ("nan", "garbage", "clock", "silence")
"""What a driver may send instead: axes that are no numbers, frames that are no JSON, stamps an hour off, nothing."""
HOUR: Final = 3600


def joy(number: int, forward: float, turn: float, then: str, failed: bool) -> dict[str, Any]:
    """Return the ``sensor_msgs/Joy`` number so and so, as it is before or after the failure."""
    pushed = number >= NEUTRAL
    request = Twist.planar(forward, turn) if pushed else Twist.planar(0.0, 0.0)
    axes, buttons = write_joy(request)
    now = time.time() + (HOUR if failed and then == "clock" else 0)
    stamp = {"sec": int(now), "nanosec": int(now % 1 * 1e9)}
    values: list[Any] = [*axes]
    if failed and then == "nan":
        values[:2] = ["NaN", None] if number % 2 else [1e400, "inf"]
    return {
        "header": {"stamp": stamp, "frame_id": "stick"},
        "axes": values,
        "buttons": list(buttons),
    }


def push(
    publish: Callable[[dict[str, Any]], None],
    garbage: Callable[[int], None],
    forward: float,
    turn: float,
    then: str,
    after: float,
) -> None:
    """Send positions of the stick until the end of the process."""
    begun = 0.0
    failed = False
    for number in count():
        due = time.monotonic() + PERIOD
        if number == NEUTRAL:
            begun = time.monotonic()
            _say("driving")
        if begun and not failed and then in TALK and time.monotonic() - begun > after:
            failed = True
            _say("failed")
        if not failed or then in ("nan", "clock"):
            publish(joy(number, forward, turn, then, failed))
        elif then == "garbage":
            garbage(number)
        time.sleep(max(0.0, due - time.monotonic()))


def _say(word: str) -> None:
    print(f"{word} {time.time():.6f}", flush=True)


def with_websockets(url: str, *words: Any) -> None:
    """Drive by plain frames."""
    with connect(url, compression=None, max_size=None, proxy=None) as connection:

        def publish(message: dict[str, Any]) -> None:
            connection.send(json.dumps({"op": "publish", "topic": "/joy", "msg": message}))

        def garbage(number: int) -> None:
            frames = ("{", "[[[", '{"op":"publish","topic":"/joy","msg":7}', b"\xff\x00" * 400)
            connection.send(frames[number % len(frames)])

        push(publish, garbage, *words)


def with_roslibpy(url: str, *words: Any) -> None:
    """Drive by the published client library for Python."""
    import roslibpy

    ros = roslibpy.Ros(url)
    ros.run()
    topic = roslibpy.Topic(ros, "/joy", "sensor_msgs/msg/Joy")

    def garbage(number: int) -> None:
        topic.publish(roslibpy.Message({"axes": "garbage", "buttons": number}))

    push(lambda message: topic.publish(roslibpy.Message(message)), garbage, *words)


def with_page(url: str, *words: Any) -> None:
    """Drive by the console page in Chromium, with the key W."""
    asyncio.run(_page(url.replace("ws", "http", 1)))


async def _page(address: str) -> None:
    from benchmarks.console.browser import page_at

    async with page_at(address) as page:
        status = page.locator(".driving-status")
        await status.get_by_text("Ready").first.wait_for()
        await page.keyboard.down("w")
        await asyncio.sleep(0.3)
        _say("driving")
        await asyncio.Event().wait()


KINDS: Final = {
    "websockets": with_websockets,
    "roslibpy": with_roslibpy,
    "page": with_page,
}
"""Drivers in Python; that with roslib for JavaScript is ``roslib_driver.mjs``."""


if __name__ == "__main__":
    kind, url, forward, turn, then, after = sys.argv[1:]
    KINDS[kind](url, float(forward), float(turn), then, float(after))
