"""Append-only file of JSON lines, written by a thread of its own, so that no disk can stop the robot.

``logging.handlers.QueueListener`` does not fit: it joins its thread without a time limit, so that a disk
that hangs would keep the robot from ending, and cannot be stopped while its bounded queue is full.
"""

from __future__ import annotations

import json
import logging
import os
import queue
import threading
from pathlib import Path
from typing import Any, Final, TypeAlias

from teleop.errors import TeleopError

_LOG: Final = logging.getLogger(__name__)

_MAX_WAITING: Final = 10_000
"""Number of lines that wait for the disk; further ones are dropped and counted."""

_CLOSE_TIMEOUT: Final = 2.0
"""Time for the last lines to be written when the robot ends [s]."""

Line: TypeAlias = dict[str, Any]


class AuditError(TeleopError, ValueError):
    """The audit log cannot be written."""


def open_audit_file(path: Path) -> int:
    """Open a file for appending, or create one that only its owner can read; return its descriptor.

    Raises:
        AuditError: If it cannot be opened.
    """
    try:
        return os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise AuditError(f"cannot write the audit log {path}: {error.strerror}") from error


class AuditFile:
    """Lines of JSON, each passed to the operating system as soon as the disk accepts it."""

    def __init__(self, path: Path, first: Line, *, max_waiting: int = _MAX_WAITING) -> None:
        """Open a file, or create one that only its owner can read, and write a first line.

        Args:
            path: The file; lines are appended to an existing one.
            first: The first line.
            max_waiting: Number of lines that may wait for the disk.

        Raises:
            AuditError: If the file cannot be opened or the line cannot be written.
        """
        self._path = path
        self._file = open_audit_file(path)
        self._torn = False
        self._failed = self._overflowed = self._reported = 0
        self._warned = False
        self._lines: queue.Queue[Line | None] = queue.Queue(max_waiting)
        try:
            self._write(first)
        except OSError as error:
            os.close(self._file)
            raise AuditError(f"cannot write the audit log {path}: {error.strerror}") from error
        self._thread = threading.Thread(target=self._run, name="audit", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> int:
        """Number of lines that were not written because the disk was full, gone or too slow."""
        return self._failed + self._overflowed

    def add(self, line: Line) -> None:
        """Have a line written; returns at once, whatever the disk does."""
        try:
            self._lines.put_nowait(line)
        except queue.Full:
            self._overflowed += 1
            self._warn("the disk is too slow")

    def close(self) -> None:
        """Write the waiting lines, for at most two seconds."""
        try:
            self._lines.put(None, timeout=_CLOSE_TIMEOUT)
        except queue.Full:
            return  # the thread is blocked by the disk, and ends with the program
        self._thread.join(_CLOSE_TIMEOUT)
        if not self._thread.is_alive():
            os.close(self._file)

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            try:
                missing = self.lost - self._reported
                if missing:
                    self._write({"what": "lost", "lines": missing})
                    self._reported += missing
                self._write(line)
            except OSError as error:
                self._failed += 1
                self._warn(error.strerror or str(error))

    def _write(self, line: Line) -> None:
        text = ("\n" if self._torn else "") + json.dumps(line, allow_nan=False) + "\n"
        data = text.encode()
        written = os.write(self._file, data)
        # A disk that runs full accepts part of a line; the next line must not be appended to it.
        self._torn = written < len(data)
        if self._torn:
            raise OSError(None, "No space left for a whole line")

    def _warn(self, why: str) -> None:
        if not self._warned:
            self._warned = True
            _LOG.error(
                "lines of the audit log %s are lost: %s; the robot continues", self._path, why
            )
