"""A display on a thread of its own, so that drawing never holds up driving."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from localization.geometry import FloatArray
from localization.types import Pose


class DisplayProtocol(Protocol):
    """What a station needs of a display."""

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message."""

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw what this operator's stick asks for."""

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator gives."""

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Note that the connection came or went."""

    def close(self) -> None:
        """End it."""


class ThreadedDisplay:
    """Hands everything to a display in another thread, in order.

    A patient one waits when too much has piled up, so that a recording is complete; an impatient one
    leaves messages out instead, so that the operator's hands are never tied.
    """

    def __init__(self, display: DisplayProtocol, *, blocking: bool, most: int = 2000) -> None:
        """Start the thread; ``most`` things may pile up."""
        self._display, self._patient = display, blocking
        self._waiting: queue.Queue[Callable[[], None] | None] = queue.Queue(most)
        self.dropped = 0
        """How much an impatient one did not show."""
        self._thread = threading.Thread(target=self._work, name="display", daemon=True)
        self._thread.start()

    def show(self, topic: str, message: Mapping[str, Any]) -> None:
        """Draw a message, soon."""
        self._put(lambda: self._display.show(topic, message))

    def command(self, forward: float, turn: float, deadman: bool, stamp: int) -> None:
        """Draw what this operator's stick asks for, soon."""
        self._put(lambda: self._display.command(forward, turn, deadman, stamp))

    def hint(self, map_from_base: Pose, covariance: FloatArray, stamp: int) -> None:
        """Draw the hint that this operator gives, soon."""
        self._put(lambda: self._display.hint(map_from_base, covariance, stamp))

    def link(self, *, connected: bool, text: str, stamp: int) -> None:
        """Note that the connection came or went, soon."""
        self._put(lambda: self._display.link(connected=connected, text=text, stamp=stamp))

    def close(self) -> None:
        """Draw what is left, and end the display."""
        self._waiting.put(None)
        self._thread.join()
        self._display.close()

    def _put(self, work: Callable[[], None]) -> None:
        if self._patient:
            self._waiting.put(work)
            return
        try:
            self._waiting.put_nowait(work)
        except queue.Full:
            self.dropped += 1

    def _work(self) -> None:
        while (work := self._waiting.get()) is not None:
            work()
