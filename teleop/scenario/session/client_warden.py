"""Starts a command, adopts whatever it leaves behind, and ends all of it: a program of its own.

A client may start children that leave its process group, its session and their parents, clear their environment
and ignore signals. Linux gives the orphans among them to the nearest ancestor that has asked for them (``prctl``,
PR_SET_CHILD_SUBREAPER), which is this process. So all of them are its descendants until they end; and when the
program that started the client dies, however it dies, this one reads the end of its standard input and ends them.

It imports the standard library only, so that it starts at once. On standard input it reads lines: ``kill``, ``stop``
(which leaves all processes stopped, and their connections open) and ``end SECONDS``. On standard output it writes
``status NUMBER`` as the command ends, ``empty`` when no process is left, and ``left NUMBER``, how many it could not
end, as it ends itself.
"""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

_SUBREAPER = 36
"""PR_SET_CHILD_SUBREAPER of linux/prctl.h."""
_STUBBORN = 3.0
"""Time in which killed processes must be gone [s]; what hangs in the kernel stays longer."""
_LOOK = 0.01
"""Time between two looks at processes that are ending [s]."""


class Warden:
    """Owns the processes of a command."""

    def __init__(self, command: str) -> None:
        """Start a command in a session, and so a process group, of its own."""
        ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
        self._empty = False
        self._command = subprocess.Popen(
            ["/bin/sh", "-c", command], stdin=subprocess.DEVNULL, stdout=2, start_new_session=True
        )

    def reap(self) -> None:
        """Take leave of processes that have ended, and say what has changed."""
        while True:
            try:
                process, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                if not self._empty:
                    self._empty = True
                    _say("empty")
                return
            if process == 0:
                return
            if process == self._command.pid:
                _say(f"status {os.waitstatus_to_exitcode(status)}")

    def send(self, *numbers: signal.Signals) -> None:
        """Send signals to all processes that live."""
        for process in _descendants():
            for number in numbers:
                with contextlib.suppress(OSError):
                    os.kill(process, number)

    def end(self, patience: float) -> int:
        """Ask all processes to end, and after some time [s] kill what is left; return how many stay."""
        if patience > 0.0:
            # A stopped process takes the request once it goes on.
            self.send(signal.SIGTERM, signal.SIGCONT)
            self._wait(patience, lambda: None)
        self.kill()
        return 0 if self._empty else len(_descendants())

    def stop(self) -> None:
        """Stop all processes; twice, for those that one of them has just started."""
        self.send(signal.SIGSTOP)
        self.send(signal.SIGSTOP)

    def kill(self) -> None:
        """Kill all processes, and wait for their end."""
        self._wait(_STUBBORN, self._kill)

    def _kill(self) -> None:
        self.stop()  # so that none starts another meanwhile
        self.send(signal.SIGKILL)

    def _wait(self, seconds: float, act: Callable[[], None]) -> None:
        for _ in range(math.ceil(seconds / _LOOK)):
            act()
            self.reap()
            if self._empty:
                return
            time.sleep(_LOOK)


def _descendants() -> list[int]:
    """Return the processes below this one that have not ended."""
    children: dict[int, list[int]] = {}
    ended = set()
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            # The name of the program, in brackets, may hold anything.
            fields = file.read_bytes().rpartition(b")")[2].split()
            process = int(file.parent.name)
            children.setdefault(int(fields[1]), []).append(process)
            if fields[0] in (b"Z", b"X"):
                ended.add(process)
    found, next_ = [], [os.getpid()]
    while next_:
        below = children.get(next_.pop(), [])
        next_ += below
        found += below
    return [process for process in found if process not in ended]


def _say(line: str) -> None:
    with contextlib.suppress(OSError):
        os.write(1, f"{line}\n".encode())


def main(command: str) -> None:
    """Keep a command until the end of standard input, or the request to end it."""
    # What is ignored stays ignored in the command; what is caught does not.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)
    woken, wake = os.pipe()
    for end in (woken, wake):
        os.set_blocking(end, False)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    warden, text = Warden(command), b""
    while True:
        warden.reap()
        ready, _, _ = select.select([0, woken], [], [])
        if woken in ready:
            os.read(woken, 4096)
        if 0 not in ready:
            continue
        text += (read := os.read(0, 4096))
        *lines, text = text.split(b"\n")
        for line in lines if read else [b"end 0"]:
            word, _, seconds = line.partition(b" ")
            if word == b"end":
                _say(f"left {warden.end(float(seconds))}")
                return
            warden.stop() if word == b"stop" else warden.kill()


if __name__ == "__main__":
    main(sys.argv[1])
