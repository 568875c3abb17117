"""A display on a thread of its own, so that drawing never delays driving."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Semaphore
from typing import Any, Final, Protocol

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import Pose
from teleop.operator.robot_state.station_view import Pulse

_LOG: Final = logging.getLogger(__name__)


class DisplayProtocol(Protocol):
    """The methods of a display that a client of the robot calls."""

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message of a topic."""

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw the velocity that this operator requests."""

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator sends."""

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Draw that the connection was established or lost."""

    def close(self) -> None:
        """End the display."""


class LiveDisplayProtocol(DisplayProtocol, Protocol):
    """The methods of a display that a person watches."""

    def map(self, cloud: Cloud) -> None:
        """Draw a map."""

    def pulse(self, pulse: Pulse) -> None:
        """Draw what is stale, and the banner."""


class ThreadedDisplay:
    """Calls a display in another thread, in order.

    A blocking one waits when too many calls are pending, so that a recording is complete; the other drops
    calls instead, so that the operator is never held up.
    """

    def __init__(
        self, display: DisplayProtocol, *, blocking: bool, max_pending: int = 2000
    ) -> None:
        """Start the thread.

        Args:
            display: The display to call.
            blocking: Whether to wait, instead of dropping calls, when too many are pending.
            max_pending: Number of calls that may be pending.
        """
        self._display, self._blocking = display, blocking
        self._free = Semaphore(max_pending)
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="display")
        self.dropped = 0
        """Number of calls that were dropped because too many were pending."""

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message of a topic, soon."""
        self._submit(lambda: self._display.show(topic, message))

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw the velocity that this operator requests, soon."""
        self._submit(lambda: self._display.command(forward, turn, deadman, stamp))

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator sends, soon."""
        self._submit(lambda: self._display.hint(map_from_base, covariance, stamp))

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Draw that the connection was established or lost, soon."""
        self._submit(lambda: self._display.link(connected=connected, text=text, stamp=stamp))

    def close(self) -> None:
        """Draw what is pending, and end the display."""
        self._executor.shutdown()
        self._display.close()

    def _submit(self, call: Callable[[], None]) -> None:
        if not self._free.acquire(blocking=self._blocking):
            self.dropped += 1
            return
        self._executor.submit(call).add_done_callback(self._done)

    def _done(self, call: Future[None]) -> None:
        self._free.release()
        if (error := call.exception()) is not None:
            _LOG.error("the display failed: %r", error)


class UnhurriedDisplay(ThreadedDisplay):
    """The same for who must answer soon, and has time later: draws only what it is given time for.

    The thread of a display takes the interpreter from the thread that drives, as often as that waits for a socket.
    """

    def __init__(self, display: DisplayProtocol) -> None:
        """Start the thread; see ``ThreadedDisplay``, for which all calls between two of ``draw`` are one."""
        super().__init__(display, blocking=True, max_pending=200)
        self._held: list[Callable[[], None]] = []

    def draw(self) -> None:
        """Draw what was called for so far, soon."""
        held, self._held = self._held, []
        if held:
            super()._submit(lambda: _call_each(held))

    def close(self) -> None:
        """Draw what is pending, and end the display."""
        self.draw()
        super().close()

    def _submit(self, call: Callable[[], None]) -> None:
        self._held.append(call)


def _call_each(calls: Iterable[Callable[[], None]]) -> None:
    for call in calls:
        try:
            call()
        except Exception as error:
            _LOG.error("the display failed: %r", error)


class LiveThreadedDisplay(ThreadedDisplay):
    """The same for a display that a person watches: drops calls rather than hold up driving."""

    def __init__(self, display: LiveDisplayProtocol) -> None:
        """Start the thread; see ``ThreadedDisplay``."""
        super().__init__(display, blocking=False, max_pending=2000)
        self._live = display

    def map(self, cloud: Cloud) -> None:
        """Draw a map, soon."""
        self._submit(lambda: self._live.map(cloud))

    def pulse(self, pulse: Pulse) -> None:
        """Draw what is stale, and the banner, soon."""
        self._submit(lambda: self._live.pulse(pulse))
