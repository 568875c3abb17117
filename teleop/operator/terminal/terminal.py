"""The operator's terminal: single keys, reports of releases where it has them, and its state restored at the end."""

from __future__ import annotations

import atexit
import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Final

from teleop.operator.controls.key_events import Input, KeyDecoder, TerminalReport

ASK_KITTY: Final = b"\x1b[?u\x1b[c"
"""Asks for the kitty keyboard protocol, and for the attributes, which every terminal answers."""
REPORT_RELEASES: Final = b"\x1b[>3u"
"""Has the terminal report events unambiguously, with repeats and releases (flags 0b11)."""
RESTORE_KEYS: Final = b"\x1b[<u"
"""Takes that back."""
ASK_ALIVE: Final = b"\x1b[5n"
"""Asks for the terminal's status, which every terminal answers."""
_REPORT_FOCUS: Final = b"\x1b[?1004h"
_IGNORE_FOCUS: Final = b"\x1b[?1004l"
_ENTER_SCREEN: Final = b"\x1b[?1049h\x1b[?25l"
"""Goes to the alternate screen and hides the cursor."""
_LEAVE_SCREEN: Final = b"\x1b[?25h\x1b[?1049l"
_ANSWER: Final = 0.5
"""Time within which a terminal must answer what it can [s]; slow connections take a tenth."""


@dataclass(slots=True)
class Terminal:
    """A terminal in the mode for single keys."""

    keys: int
    """Descriptor that keys are read from."""
    out: int
    """Descriptor that is written to."""
    reports_releases: bool
    """Whether it reports releases."""
    decoder: KeyDecoder
    """Decodes what it sends."""
    on_screen: bool = False
    """Whether it shows the alternate screen."""

    def read(self) -> list[Input]:
        """Return the events that have come; raises EOFError if the terminal is gone."""
        try:
            data = os.read(self.keys, 4096)
        except BlockingIOError:
            return []
        except OSError:
            raise EOFError from None
        if not data:
            raise EOFError
        return self.decoder.feed(data)

    def write(self, data: bytes) -> None:
        """Write to the terminal; one that is gone is ignored."""
        with suppress(OSError):
            while data:
                data = data[os.write(self.out, data) :]

    def enter_screen(self) -> None:
        """Go to the alternate screen."""
        self.on_screen = True
        self.write(_ENTER_SCREEN)

    def leave_screen(self) -> None:
        """Bring back the screen that was there before."""
        if self.on_screen:
            self.on_screen = False
            self.write(_LEAVE_SCREEN)

    def ask_alive(self) -> None:
        """Ask for a sign of life; ``TerminalReport.ALIVE`` answers."""
        self.write(ASK_ALIVE)


@contextmanager
def key_terminal() -> Iterator[Terminal | None]:
    """Switch standard input to single keys; yield None if it or standard output is no terminal.

    The former mode is restored at the end, also after an exception and at the exit of the interpreter.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        yield None
        return
    with terminal_on(sys.stdin.fileno(), sys.stdout.fileno()) as terminal:
        yield terminal


@contextmanager
def terminal_on(keys: int, out: int) -> Iterator[Terminal]:
    """Switch a terminal, given by its descriptors, to single keys; see ``key_terminal``."""
    before = termios.tcgetattr(keys)
    terminal = Terminal(keys, out, reports_releases=False, decoder=KeyDecoder())
    restored = False

    def restore() -> None:
        nonlocal restored
        if restored:
            return
        restored = True
        terminal.leave_screen()
        terminal.write(_IGNORE_FOCUS + (RESTORE_KEYS if terminal.reports_releases else b""))
        with suppress(termios.error, OSError):
            # What was typed and not read must not reach the shell.
            termios.tcsetattr(keys, termios.TCSAFLUSH, before)

    atexit.register(restore)
    try:
        tty.setcbreak(keys)
        terminal.reports_releases = _has_kitty(terminal)
        terminal.write(_REPORT_FOCUS + (REPORT_RELEASES if terminal.reports_releases else b""))
        yield terminal
    finally:
        restore()
        atexit.unregister(restore)


def _has_kitty(terminal: Terminal) -> bool:
    """Return whether a terminal reports releases; keys typed meanwhile are dropped."""
    terminal.write(ASK_KITTY)
    found = False
    while select.select([terminal.keys], [], [], _ANSWER)[0]:
        try:
            reports = terminal.read()
        except EOFError:
            break
        found = found or TerminalReport.KITTY in reports
        if TerminalReport.ATTRIBUTES in reports:
            break
    return found
