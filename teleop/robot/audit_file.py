"""A file that only grows, written by a thread of its own: no disk can stop the robot."""

from __future__ import annotations

import json
import logging
import os
import queue
import threading
from pathlib import Path
from typing import Any, Final, TypeAlias

_LOG: Final = logging.getLogger(__name__)

_MOST_WAITING: Final = 10_000
"""Lines that wait for the disk; further ones are lost, and counted."""

_PATIENCE: Final = 2.0
"""Time for the last lines to be written when the robot ends [s]."""

Line: TypeAlias = dict[str, Any]


class AuditError(ValueError):
    """The file cannot be written."""


class AuditFile:
    """Lines of JSON, each handed to the operating system as soon as the disk lets it."""

    def __init__(self, path: Path, first: Line, *, most_waiting: int = _MOST_WAITING) -> None:
        """Open a file, or make one that only its owner can read, and write a first line.

        Raises:
            AuditError: If that cannot be done; one line says why.
        """
        self._path = path
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
        try:
            self._file = os.open(path, flags, 0o600)
        except OSError as error:
            raise AuditError(f"cannot write the audit log {path}: {error.strerror}") from error
        self._torn = False
        self._failed = self._overflowed = self._told = 0
        self._complained = False
        self._lines: queue.Queue[Line | None] = queue.Queue(most_waiting)
        try:
            self._write(first)
        except OSError as error:
            os.close(self._file)
            raise AuditError(f"cannot write the audit log {path}: {error.strerror}") from error
        self._thread = threading.Thread(target=self._run, name="audit", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> int:
        """Lines that were not written because the disk was full, gone or too slow."""
        return self._failed + self._overflowed

    def add(self, line: Line) -> None:
        """Have a line written; returns at once, whatever the disk does."""
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._overflowed += 1
            self._complain("the disk is too slow")

    def close(self) -> None:
        """Write what waits, for at most two seconds."""
        try:
            self._lines.put(None, timeout=_PATIENCE)
        except queue.Full:
            return  # the thread hangs in the disk, and ends with the program
        self._thread.join(_PATIENCE)
        if not self._thread.is_alive():
            os.close(self._file)

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            try:
                missing = self.lost - self._told
                if missing:
                    self._write({"what": "lost", "lines": missing})
                    self._told += missing
                self._write(line)
            except OSError as error:
                self._failed += 1
                self._complain(error.strerror or str(error))

    def _write(self, line: Line) -> None:
        text = ("\n" if self._torn else "") + json.dumps(line, allow_nan=False) + "\n"
        data = text.encode()
        written = os.write(self._file, data)
        # A disk that runs full takes part of a line; the next one must not be glued to it.
        self._torn = written < len(data)
        if self._torn:
            raise OSError(None, "No space left for a whole line")

    def _complain(self, why: str) -> None:
        if not self._complained:
            self._complained = True
            _LOG.error("lines of the audit log %s are lost: %s; the robot goes on", self._path, why)
