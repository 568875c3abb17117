"""The terminal's mode on a real pseudo terminal: what it is asked, and that it is restored."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from teleop.operator.controls.key_events import Key, KeyEvent
from teleop.operator.terminal.terminal import (
    REPORT_RELEASES,
    RESTORE_KEYS,
    Terminal,
    terminal_on,
)
from tests.teleop.operator.emulator import KITTY, XTERM, Emulator, emulator

ROOT = Path(__file__).parents[4]


def _read(terminal: Terminal) -> list[object]:
    assert select.select([terminal.keys], [], [], 20.0)[0]
    return list(terminal.read())


def test_terminal_with_the_kitty_protocol_reports_releases_and_is_restored() -> None:
    with emulator(KITTY) as emulated:
        before = termios.tcgetattr(emulated.slave)
        with terminal_on(emulated.slave, emulated.slave) as terminal:
            assert terminal.reports_releases
            emulated.wait_for(REPORT_RELEASES)
            emulated.type(b"w\x1b[119;1:3u")
            assert _read(terminal) == [Key("w"), Key("w", KeyEvent.RELEASE)]
            assert not termios.tcgetattr(emulated.slave)[3] & termios.ECHO
        emulated.wait_for(RESTORE_KEYS)
        assert termios.tcgetattr(emulated.slave) == before


def test_terminal_without_it_does_not_get_the_request_to_report_releases() -> None:
    with emulator(XTERM) as emulated:
        with terminal_on(emulated.slave, emulated.slave) as terminal:
            assert not terminal.reports_releases
            terminal.enter_screen()
        emulated.wait_for(b"\x1b[?1049l")
        emulated.wait_for(b"\x1b[?1004l")
        assert REPORT_RELEASES not in emulated.seen
        assert RESTORE_KEYS not in emulated.seen


def test_terminal_that_answers_nothing_is_used_without() -> None:
    with emulator({}) as emulated, terminal_on(emulated.slave, emulated.slave) as terminal:
        assert not terminal.reports_releases


def _crash(emulated: Emulator) -> None:
    with terminal_on(emulated.slave, emulated.slave) as terminal:
        terminal.enter_screen()
        raise RuntimeError("crash")


def test_terminal_is_restored_when_an_exception_ends_the_session() -> None:
    with emulator(KITTY) as emulated:
        before = termios.tcgetattr(emulated.slave)
        with pytest.raises(RuntimeError, match="crash"):
            _crash(emulated)
        emulated.wait_for(RESTORE_KEYS)
        emulated.wait_for(b"\x1b[?1049l")
        assert termios.tcgetattr(emulated.slave) == before


_CRASH = """
import os, sys, signal
from teleop.operator.terminal.terminal import key_terminal
context = key_terminal()
terminal = context.__enter__()
terminal.enter_screen()
os.write(2, b"ready\\n")
{end}
"""


@pytest.mark.process
@pytest.mark.parametrize("end", ["sys.exit(3)", "raise RuntimeError('crash')"])
def test_terminal_is_restored_when_the_interpreter_ends(end: str) -> None:
    with emulator(KITTY) as emulated:
        before = termios.tcgetattr(emulated.slave)
        process = subprocess.Popen(
            [sys.executable, "-c", _CRASH.format(end=end)],
            stdin=emulated.slave,
            stdout=emulated.slave,
            stderr=subprocess.PIPE,
            cwd=ROOT,
        )
        _, err = process.communicate(timeout=60)
        assert b"ready" in err
        emulated.wait_for(RESTORE_KEYS)
        assert termios.tcgetattr(emulated.slave) == before


def test_terminal_that_is_gone_ends_the_keys() -> None:
    with emulator(XTERM) as emulated, terminal_on(emulated.slave, emulated.slave) as terminal:
        read_end, write_end = os.pipe()
        os.close(write_end)
        gone = Terminal(read_end, terminal.out, False, terminal.decoder)
        with pytest.raises(EOFError):
            gone.read()
        os.close(read_end)
