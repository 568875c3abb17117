"""A board at a serial port: found, lost and found again; the newest line goes out, and all answers come in."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from serial import Serial, SerialException

from teleop.bridges.servos.servo_lines import Answer, LineReader

Say = Callable[[str], object]
"""Takes a line for the user."""

_SEARCH: Final = 1.0
"""Time between two attempts to open the port [s]."""
_PAUSE: Final = 0.01
"""Shortest time between two lines [s]: they fill less than half of the line at 115200 baud, whatever comes in."""
_MOST: Final = 4096


class SerialBoard:
    """The port of a board. Owns the open port, and the line that is to be sent next."""

    def __init__(self, port: Path, baud: int, take: Callable[[Answer], object], say: Say) -> None:
        """Begin without a port.

        Args:
            port: The port's device.
            baud: Its bits per second.
            take: Called with each answer of the board.
            say: Called with a line when the board is found or lost.
        """
        self.unreadable = 0
        """Lines from the board that were cut or garbled."""
        self.is_open = False
        """Whether the port is open."""
        self._path = port
        self._baud = baud
        self._take = take
        self._say = say
        self._newest: bytes | None = None
        self._fresh = asyncio.Event()

    def send(self, line: bytes) -> None:
        """Have a line sent, in the place of one that has not gone yet."""
        self._newest = line
        self._fresh.set()

    async def run(self) -> None:
        """Look for the board, and serve it while it is there, without end."""
        said = ""
        while True:
            try:
                # Two programs that write to one board would tear its lines apart.
                port = Serial(
                    str(self._path), self._baud, timeout=0, write_timeout=0, exclusive=True
                )
            except (OSError, ValueError) as error:
                if (why := _why(error)) != said:
                    self._say(f"no board at {self._path}: {why}; looking for it each second")
                said = why
                await asyncio.sleep(_SEARCH)
                continue
            self._say(f"{self._path} is open")
            said = ""
            self.is_open = True
            try:
                await self._serve(port)
            except OSError as error:
                self._say(f"lost the board at {self._path}: {_why(error)}")
            finally:
                self.is_open = False
                with contextlib.suppress(OSError):
                    port.close()
            await asyncio.sleep(_SEARCH)

    async def _serve(self, port: Serial) -> None:
        """Send and receive until the port fails.

        Raises:
            OSError: If the board is unplugged.
        """
        loop = asyncio.get_running_loop()
        failed: asyncio.Future[None] = loop.create_future()
        reader = LineReader()

        def readable() -> None:
            try:
                # Not by the library, whose calls wait where none should: its write spins while a board takes nothing.
                if not (data := os.read(port.fileno(), _MOST)):
                    raise OSError(errno.EIO, "end of file")
            except BlockingIOError:
                return
            except OSError as error:
                loop.remove_reader(port.fileno())
                if not failed.done():
                    failed.set_exception(error)
                return
            answers = reader.take(data)
            self.unreadable += reader.unreadable
            reader.unreadable = 0
            for answer in answers:
                self._take(answer)

        port.reset_input_buffer()  # what nobody has read is old
        loop.add_reader(port.fileno(), readable)
        writing = asyncio.ensure_future(self._write(port))
        try:
            await asyncio.wait([failed, writing], return_when=asyncio.FIRST_COMPLETED)
            (failed if failed.done() else writing).result()
        finally:
            loop.remove_reader(port.fileno())
            writing.cancel()
            with contextlib.suppress(asyncio.CancelledError, OSError):
                await writing
            failed.cancel()

    async def _write(self, port: Serial) -> None:
        while True:
            await self._fresh.wait()
            self._fresh.clear()
            line, self._newest = self._newest or b"", None
            while (
                line
            ):  # a line that has begun is ended, or the board would refuse it and the next one
                with contextlib.suppress(BlockingIOError):
                    line = line[os.write(port.fileno(), line) :]
                await asyncio.sleep(_PAUSE)


def _why(error: Exception) -> str:
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return "there is no such device"
    if number == errno.EACCES:
        return "no permission; add yourself to its group (on Debian dialout)"
    if isinstance(error, SerialException) and "exclusively lock" in str(error):
        return "another program has it open"
    if isinstance(error, SerialException) and "Inappropriate ioctl" in str(error):
        return "it is no serial port"
    if number == errno.EIO:
        return "it was unplugged"
    return getattr(error, "strerror", None) or str(error)
