"""Operate a robot from here: look at it in rerun, drive it from the keyboard, give it a hint."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import ssl
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from localization.display.rerun_sink import Sink
from localization.maps.map_files import load_cloud
from localization.types import Pose, Twist
from teleop.interfaces import registry
from teleop.operator.display import Display
from teleop.operator.keyboard import HELP, Keyboard, raw_terminal, read_keys
from teleop.operator.operator_client import OperatorClient
from teleop.operator.threaded_display import ThreadedDisplay
from teleop.rosbridge.client.client import Client
from teleop.rosbridge.client.reconnecting_connection import ConnectionState
from teleop.rosbridge.errors import ServiceCallError

_PERIOD: Final = 0.05
"""Between Joys while a key is held [s]: twice as often as ROS# sends them."""

_STOP: Final = Twist.planar(0.0, 0.0)

_ORDERS: Final[Mapping[str, str]] = {
    "estop": "/teleop/estop",
    "reset": "/teleop/estop_reset",
    "take_over": "/teleop/take_over",
}


@dataclass(frozen=True, slots=True)
class OperateConfig:
    """Which robot, and what to do with what it tells."""

    url: str
    map: Path
    """This side's copy of the robot's map."""
    record: Path | None = None
    viewer: bool = False
    hint: tuple[float, float, float] | None = None
    """x, y [m], heading [degrees]."""
    duration: float | None = None
    """[s]."""
    token: Path | None = None
    """File with the token that the robot lets us in by."""
    ca: Path | None = None
    """Certificate to trust, if it is not one that this machine trusts (PEM)."""

    def client(self) -> Client:
        """Return the client that brings the token.

        Raises:
            ValueError: if token or certificate cannot be read.
        """
        token = None
        if self.token is not None:
            token = self.token.read_text(encoding="utf-8").strip()
            if not token.isascii() or not token.isprintable() or not token:
                raise ValueError(f"{self.token} must hold a token, in one line of ASCII")
        tls = None
        if self.ca is not None:
            if not self.ca.is_file():
                raise ValueError(f"there is no certificate {self.ca}")
            try:
                tls = ssl.create_default_context(cafile=str(self.ca))
            except ssl.SSLError:
                raise ValueError(f"{self.ca} holds no certificate (PEM)") from None
        return Client(self.url, registry=registry(), token=token, tls=tls)


async def run_operator(config: OperateConfig, *, say: Callable[[str], None]) -> None:
    """Build a station and operate it until it is told to end.

    Raises:
        CloudError: if the map cannot be read.
        ClientError: if there is no rosbridge server at the address.
        ValueError: if the viewer is wanted where there is no screen.
    """
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if config.viewer and sys.platform == "linux" and not screen:
        raise ValueError("there is no screen for rerun's viewer: use --no-viewer --record FILE.rrd")
    cloud = load_cloud(config.map)
    display = None
    if config.record is not None or config.viewer:
        sink = Sink(file=config.record, spawn=config.viewer)
        display = ThreadedDisplay(Display(cloud, sink=sink), blocking=False)
    client = config.client()
    stop = asyncio.Event()
    teller = StatusPrinter(say)
    operator = OperatorClient(client, cloud, display, tell=teller.hear)

    def link(state: ConnectionState) -> None:
        connected = state is ConnectionState.CONNECTED
        text = config.url if connected else client.closed_reason
        if not stop.is_set():
            say(f"{state.value}: {text}")
        if display is not None:
            display.link(connected=connected, text=text, stamp=operator.now)

    loop = asyncio.get_running_loop()
    if config.duration is not None:
        loop.call_later(config.duration, stop.set)
    hint = None
    if config.hint is not None:
        x, y, heading = config.hint
        hint = Pose.planar(x, y, float(np.deg2rad(heading)))
    try:
        clock = lambda: int(loop.time() * 1e9)  # noqa: E731
        await operate(operator, clock=clock, say=say, link=link, hint=hint, stop=stop)
    finally:
        await client.close()
        if display is not None:
            display.close()


class StatusPrinter:
    """Tells what changes: health with its reasons, verdicts, who drives."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._told: dict[str, str] = {}

    def hear(self, topic: str, message: Mapping[str, Any]) -> None:
        """Take in a message of any topic."""
        match topic:
            case "/localization/status":
                reasons = "; ".join(message["reasons"])
                self._tell("health", message["health"], f" ({reasons})" if reasons else "")
            case "/teleop/state":
                self._tell("control", message["state"], f" ({message['reason']})")
            case "/localization/hint_verdict":
                self._say(f"hint {message['verdict']}: {message['reason']}")

    def _tell(self, what: str, now: str, more: str) -> None:
        if self._told.get(what) != now:
            self._told[what] = now
            self._say(f"{what}: {now}{more}")


async def operate(
    operator: OperatorClient,
    *,
    clock: Callable[[], int],
    say: Callable[[str], None],
    link: Callable[[ConnectionState], None] = lambda state: None,
    hint: Pose | None = None,
    stop: asyncio.Event | None = None,
) -> None:
    """Run until ``q``, Ctrl-C or ``stop``; the connection comes back by itself when it is lost.

    Args:
        operator: The operator's client, not yet connected.
        clock: a clock that never goes back [ns].
        say: gets a line to show now and then.
        link: told what becomes of the connection once there is one.
        hint: where to tell the robot that it is, once connected.
        stop: ends it.

    Raises:
        ClientError: if the first connection fails.
    """
    stop = stop or asyncio.Event()
    loop = asyncio.get_running_loop()
    with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
        loop.add_signal_handler(signal.SIGINT, stop.set)
    begun = asyncio.Event()

    def told(level: str, text: str) -> None:
        # What a server that turns out not to be ours says before that is known tells nobody anything.
        if begun.is_set():
            say(f"{level}: {text}")

    operator.client.on_status(told)
    await operator.client.connect()
    begun.set()
    operator.client.on_connection(link)
    link(ConnectionState.CONNECTED)
    await operator.start()
    if hint is not None:
        await operator.hint(hint, np.zeros((6, 6)))
    keyboard = Keyboard()
    with raw_terminal() as terminal:
        if terminal is not None:
            say(HELP)
            loop.add_reader(terminal, _take_keys, terminal, keyboard, operator, clock, say, stop)
        try:
            await _drive(operator, keyboard, clock, say, stop)
        finally:
            if terminal is not None:
                loop.remove_reader(terminal)


async def _drive(
    operator: OperatorClient,
    keyboard: Keyboard,
    clock: Callable[[], int],
    say: Callable[[str], None],
    stop: asyncio.Event,
) -> None:
    was_held, complained = False, False
    while not stop.is_set():
        twist, held = keyboard.twist(clock())
        # The robot wants to see a neutral stick first, so the first message of a stroke is one. Another
        # tells of its end; after that there is nothing to say.
        if (held or was_held) and operator.client.connected:
            await operator.drive(twist if was_held else _STOP, enabled=held)
        was_held = held
        if operator.map_complaint and not complained:
            complained = True
            say(operator.map_complaint)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(stop.wait(), _PERIOD)


def _take_keys(
    terminal: int,
    keyboard: Keyboard,
    operator: OperatorClient,
    clock: Callable[[], int],
    say: Callable[[str], None],
    stop: asyncio.Event,
) -> None:
    for key in read_keys(terminal):
        order = keyboard.press(key, clock())
        if order == "quit":
            stop.set()
        elif order is not None:
            task = asyncio.get_running_loop().create_task(_order(operator, _ORDERS[order], say))
            _TASKS.add(task)
            task.add_done_callback(_TASKS.discard)


_TASKS: set[asyncio.Task[None]] = set()
"""Orders under way; asyncio itself keeps only weak references."""


async def _order(operator: OperatorClient, service: str, say: Callable[[str], None]) -> None:
    try:
        answer: Mapping[str, Any] = await operator.client.call(service, {}, timeout=2.0)
        say(f"{service}: {answer['message']}")
    except ServiceCallError as error:
        say(f"{service}: {error}")
