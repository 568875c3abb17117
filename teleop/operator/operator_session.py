"""A session of the operator: connects, drives from the keyboard, and sends the services' requests."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from localization.types import Pose, Twist
from teleop.operator.keyboard import HELP, Keyboard, raw_terminal, read_keys
from teleop.operator.operator_client import OperatorClient
from teleop.rosbridge.client.reconnecting_connection import ConnectionState
from teleop.rosbridge.errors import ServiceCallError

_PERIOD: Final = 0.05
"""Period of Joy messages while a key is held [s]: twice the rate of ROS#."""

_STANDSTILL: Final = Twist.planar(0.0, 0.0)

_SERVICES: Final[Mapping[str, str]] = {
    "estop": "/teleop/estop",
    "reset": "/teleop/estop_reset",
    "take_over": "/teleop/take_over",
    "find": "/localization/relocalize",
}
"""Services by the action of a key."""


class OperatorSession:
    """Owns the keyboard; runs until ``q``, Ctrl-C or ``end``."""

    def __init__(
        self,
        operator: OperatorClient,
        *,
        clock: Callable[[], int],
        say: Callable[[str], None],
    ) -> None:
        """Prepare a session.

        Args:
            operator: The operator's client, not yet connected.
            clock: Returns the reading of a clock that never goes back [ns].
            say: Prints a line for the user.
        """
        self._operator, self._clock, self._say = operator, clock, say
        self._keyboard = Keyboard()
        self._stop = asyncio.Event()
        # References to running calls; asyncio itself keeps only weak ones.
        self._calls: set[asyncio.Task[None]] = set()

    @property
    def ended(self) -> bool:
        """Whether the session has been ended, by the user or by ``end``."""
        return self._stop.is_set()

    def end(self) -> None:
        """End the session soon."""
        self._stop.set()

    async def run(
        self,
        *,
        connection_changed: Callable[[ConnectionState], None] = lambda state: None,
        hint: Pose | None = None,
        find: bool = False,
    ) -> None:
        """Connect and drive; a lost connection is re-established.

        Args:
            connection_changed: Called with each state of the connection, once it was established.
            hint: Pose to send as a hint, once connected.
            find: Whether to have the robot search the whole map, once connected.

        Raises:
            ClientError: If the first connection fails.
        """
        loop, client = asyncio.get_running_loop(), self._operator.client
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):
            loop.add_signal_handler(signal.SIGINT, self._stop.set)
        connected = asyncio.Event()

        def status(level: str, text: str) -> None:
            # Before the server is known to be a rosbridge server, its statuses mean nothing.
            if connected.is_set():
                self._say(f"{level}: {text}")

        client.on_status(status)
        await client.connect()
        connected.set()
        client.on_connection(connection_changed)
        connection_changed(ConnectionState.CONNECTED)
        await self._operator.start()
        if hint is not None:
            await self._operator.hint(hint, np.zeros((6, 6)))
        if find:
            await self._call(_SERVICES["find"])
        with raw_terminal() as terminal:
            if terminal is not None:
                self._say(HELP)
                loop.add_reader(terminal, self._take_keys, terminal)
            try:
                await self._drive()
            finally:
                if terminal is not None:
                    loop.remove_reader(terminal)

    async def _drive(self) -> None:
        """Send Joy messages while keys are held."""
        operator = self._operator
        was_held, warned = False, False
        while not self._stop.is_set():
            twist, held = self._keyboard.twist(self._clock())
            # The robot requires a neutral stick first, so each stroke begins with one. One more message
            # releases the deadman; after that none is needed.
            if (held or was_held) and operator.client.connected:
                await operator.drive(twist if was_held else _STANDSTILL, enabled=held)
            was_held = held
            if operator.map_mismatch and not warned:
                warned = True
                self._say(operator.map_mismatch)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._stop.wait(), _PERIOD)

    def _take_keys(self, terminal: int) -> None:
        for key in read_keys(terminal):
            action = self._keyboard.press(key, self._clock())
            if action == "quit":
                self.end()
            elif action is not None:
                loop = asyncio.get_running_loop()
                call = loop.create_task(self._call(_SERVICES[action]))
                self._calls.add(call)
                call.add_done_callback(self._calls.discard)

    async def _call(self, service: str) -> None:
        try:
            answer: Mapping[str, Any] = await self._operator.client.call(service, {}, timeout=2.0)
            self._say(f"{service}: {answer['message']}")
        except ServiceCallError as error:
            self._say(f"{service}: {error}")
