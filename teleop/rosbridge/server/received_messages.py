"""Messages of a client that wait to be processed, with the time at which each arrived."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Final

from websockets.frames import CONT, TEXT, Frame

from teleop.rosbridge.server.dated_loop import arrival_now

_HIGH: Final = 16
"""Number of waiting messages above which reading is paused."""

_LOW: Final = 4
"""Number of waiting messages at which reading goes on."""

_HIGH_BYTES: Final = 1_000_000
"""Size of the waiting messages above which reading is paused [bytes]."""

_READ_BYTES: Final = 262_144
"""What asyncio reads at most at once [bytes]; a shorter read has emptied the kernel's buffer."""


class ReceivedMessages:
    """Joins frames to messages, dates them, and pauses reading while many wait."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self._loop = asyncio.get_running_loop()
        self._messages: deque[tuple[str | bytes, float, int]] = deque()
        self._begun = bytearray()
        self._text = False
        self._full = False
        self._paused: float | None = None
        self.waiting = 0
        """Size of the whole messages that wait [bytes]."""

        self.arrival = asyncio.Event()
        """Set when a message arrives."""

    @property
    def size(self) -> int:
        """Size of the messages that wait, those included of which the end is missing [bytes]."""
        return self.waiting + len(self._begun)

    @property
    def several(self) -> bool:
        """Whether more than one message waits."""
        return len(self._messages) > 1

    def date(self, size: int) -> float:
        """Return the earliest time at which bytes may have arrived that were just read [s].

        Args:
            size: Number of the bytes.
        """
        arrived = arrival_now()
        if self._paused is not None:
            # What waited in the kernel came at any time since reading was paused.
            arrived = min(arrived, self._paused)
            if size < _READ_BYTES and not self._full:
                self._paused = None
        return arrived

    def put(self, frame: Frame, arrived: float) -> None:
        """Add a data frame.

        Raises:
            UnicodeDecodeError: If it ends a text that is not UTF-8.
        """
        if frame.opcode is not CONT:
            self._text = frame.opcode is TEXT
        if not frame.fin:
            self._begun += frame.data
            return
        whole = bytes(self._begun + frame.data if self._begun else frame.data)
        self._begun.clear()
        self._messages.append((whole.decode() if self._text else whole, arrived, len(whole)))
        self.waiting += len(whole)
        self.arrival.set()
        if not self._full and (len(self._messages) > _HIGH or self.waiting > _HIGH_BYTES):
            self._full = True
            self.pause()

    def take(self) -> tuple[str | bytes, float] | None:
        """Return the next message and its earliest possible arrival [s]; None if there is none."""
        if not self._messages:
            self.arrival.clear()
            return None
        message, arrived, size = self._messages.popleft()
        self.waiting -= size
        if self._full and len(self._messages) <= _LOW:
            self._full = False
            self._transport.resume_reading()
        return message, arrived

    def pause(self) -> None:
        """Stop reading, and remember since when."""
        self._paused = self._loop.time() if self._paused is None else self._paused
        self._transport.pause_reading()
