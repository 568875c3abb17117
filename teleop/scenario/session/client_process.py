"""The client under test: a program of its own, ended with all that it started."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from teleop.errors import SettingError
from teleop.scenario.session import client_warden

MARK: Final = "FARSTEER_RUN"
"""Environment variable that all of its processes inherit; each run has its own value."""
GRACE: Final = 3.0
"""Time that a client has to end once it is asked to, before it is killed [s]."""
_ENDING: Final = 10.0
"""Time in which the warden must be done: the client's, that of killing, and some more [s]."""
_TAIL: Final = 20_000
"""End of the log in which its last lines are looked for [bytes]."""


class ClientProcess:
    """Owns the client's processes, from their start to their end; all methods return at once but ``close``."""

    def __init__(self, command: str, environment: Mapping[str, str], log: Path) -> None:
        """Start the client in a process group of its own.

        Args:
            command: Its command line, which a shell reads.
            environment: What it gets to know, besides the environment of this process.
            log: File for what it prints.

        Raises:
            SettingError: If the command is empty.
        """
        if not command.strip():
            raise SettingError(
                'client: the command is empty; give one, such as --client "npm test"'
            )
        self.log = log
        """What it has printed."""

        self.killed = False
        """Whether the scenario itself has killed it, or has made it hang."""

        self.status: int | None = None
        """Exit status of the command; None while it runs; negative if a signal ended it."""

        self.empty = False
        """Whether none of its processes is left, of those that left its group included."""

        self.left: int | None = None
        """Number of its processes that could not be ended; None until they have been."""

        mark = uuid.uuid4().hex
        self._mark = f"{MARK}={mark}".encode()
        with log.open("wb") as file:
            self._warden = subprocess.Popen(
                [sys.executable, "-I", "-S", client_warden.__file__, command],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=file,
                # Ctrl-C is for this process, which ends the client in order.
                start_new_session=True,
                env={**os.environ, **environment, MARK: mark},
            )
        assert self._warden.stdin is not None
        assert self._warden.stdout is not None
        self._ask, self._told = self._warden.stdin.fileno(), self._warden.stdout.fileno()
        os.set_blocking(self._told, False)
        self._text = b""

    def look(self) -> None:
        """Take note of what has become of it."""
        lost = False
        with contextlib.suppress(BlockingIOError):
            while read := os.read(self._told, 4096):
                self._text += read
            lost = True
        *lines, self._text = self._text.split(b"\n")
        for line in lines:
            word, _, number = line.partition(b" ")
            if word == b"status":
                self.status = int(number)
            elif word == b"empty":
                self.empty = True
            elif word == b"left":
                self.left = int(number)
        if lost and self.left is None:
            self._lose_warden()

    def step_clock(self, seconds: float) -> None:
        """Do nothing: the clock of a program that is not ours is its own."""

    def kill(self, *, silent: bool) -> None:
        """Kill it and all that it started; if ``silent``, stop it, so that its connections stay open."""
        self.killed = True
        self._say("stop" if silent else "kill")

    def end(self, patience: float = GRACE) -> None:
        """Ask it and all that it started to end, and after some time [s] kill what is left.

        ``left`` says when this is done.
        """
        self._say(f"end {patience}")

    def close(self) -> None:
        """Kill what is left, and wait for its end."""
        for pipe in (self._warden.stdin, self._warden.stdout):
            assert pipe is not None
            with contextlib.suppress(OSError):
                pipe.close()
        try:
            self._warden.wait(_ENDING)
        except subprocess.TimeoutExpired:
            self._warden.kill()
            self._warden.wait()

    def tail(self, lines: int = 5) -> list[str]:
        """Return the last lines that it printed, as far as they can be shown."""
        with self.log.open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - _TAIL))
            text = file.read(_TAIL).decode("utf-8", "replace")
        shown = ("".join(c for c in line if c.isprintable()) for line in text.splitlines())
        return [line for line in shown if line.strip()][-lines:]

    def _lose_warden(self) -> None:
        """End what can still be found after somebody has killed the warden, which else says goodbye."""
        self.left, self.empty = 0, True
        for environment in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                if self._mark in environment.read_bytes().split(b"\0"):
                    os.kill(int(environment.parent.name), signal.SIGKILL)

    def _say(self, line: str) -> None:
        with contextlib.suppress(OSError):
            os.write(self._ask, f"{line}\n".encode())
