"""A terminal emulator: the other end of a pseudo terminal, which answers questions as terminals do."""

from __future__ import annotations

import os
import pty
import select
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from teleop.operator.terminal.terminal import ASK_ALIVE, ASK_KITTY

KITTY = {ASK_KITTY: b"\x1b[?0u\x1b[?62c", ASK_ALIVE: b"\x1b[0n"}
"""Answers of a terminal with the kitty keyboard protocol."""
XTERM = {ASK_KITTY: b"\x1b[?62;22c", ASK_ALIVE: b"\x1b[0n"}
"""Answers of a terminal without."""
_PATIENCE = 60.0


class Emulator:
    """The other end of a pseudo terminal: answers questions as terminals do."""

    def __init__(self, answers: dict[bytes, bytes]) -> None:
        self.answers = answers
        self.end, self.slave = pty.openpty()
        self.seen = b""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._stop_read, self._stop_write = os.pipe()
        self._news = threading.Condition()
        self._thread.start()

    def _run(self) -> None:
        asked = 0
        while True:
            ready, _, _ = select.select([self.end, self._stop_read], [], [])
            if self._stop_read in ready:
                return
            try:
                data = os.read(self.end, 4096)
            except OSError:
                return
            with self._news:
                self.seen += data
                self._news.notify_all()
            for question, answer in self.answers.items():
                while (at := self.seen.find(question, asked)) >= 0:
                    asked = at + len(question)
                    os.write(self.end, answer)

    def wait_for(self, data: bytes) -> None:
        """Wait until the terminal was sent something."""
        with self._news:
            assert self._news.wait_for(lambda: data in self.seen, _PATIENCE), self.seen

    def type(self, data: bytes) -> None:
        """Press keys."""
        os.write(self.end, data)

    def close(self) -> None:
        os.write(self._stop_write, b"x")
        self._thread.join()
        for descriptor in (self.end, self.slave, self._stop_read, self._stop_write):
            os.close(descriptor)


@contextmanager
def emulator(answers: dict[bytes, bytes]) -> Iterator[Emulator]:
    terminal = Emulator(answers)
    try:
        yield terminal
    finally:
        terminal.close()
