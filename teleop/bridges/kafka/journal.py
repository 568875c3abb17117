"""The file by which a bridge that was killed knows what it has begun and what it has answered."""

from __future__ import annotations

import asyncio
import fcntl
import json
import os
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from teleop.bridges.kafka.journal_state import JournalState, Mark
from teleop.bridges.kafka.results import Result
from teleop.errors import SettingError, TeleopError
from teleop.step_commands.turtle_control import StepSizes

COMPACTED: Final = 1_000_000
"""Size from which a journal is written anew, shorter [bytes]."""


class JournalError(TeleopError):
    """The journal cannot be written; without it no step may be driven."""


class Journal:
    """A file of JSON lines, each synchronised with the disk before what it says is acted upon.

    The last line may be torn by a kill or a full disk: what it says has not been acted upon, and it is cut off.
    A journal belongs to one topic and partition, and to one running bridge.
    """

    def __init__(self, path: Path, log: str) -> None:
        """Open or make the file.

        Args:
            path: The file.
            log: Name of the log, such as ``turtle_control/0``; the file may not be of another one.

        Raises:
            SettingError: If it is in use, is of another log, or is no journal.
        """
        self.path = path
        self._log = log
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise SettingError(f"cannot open the journal {path}: {error.strerror}") from None
        try:
            self._lock()
            self.state = self._read()
            if self._size > COMPACTED or self._size == 0:
                self._compact()
        except BaseException:
            os.close(self._file)
            raise
        self.changed = asyncio.Event()
        """Set with each entry; who waits for one clears it."""

        self._writing = asyncio.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._file)

    async def open_log(self, *, log: int, next: int, end: int, mark: Mark | None) -> None:
        """Note from where the log is read, at the first time and after a loss."""
        await self._add({"is": "opened", "log": log, "next": next, "end": end, "mark": _dict(mark)})

    async def begin(self, offset: int, mark: Mark) -> None:
        """Note that a command is about to be carried out."""
        await self._add({"is": "begun", "offset": offset, "mark": asdict(mark)})

    async def end(
        self,
        result: Result,
        mark: Mark | None,
        end: int,
        sizes: StepSizes,
        *,
        inverted: bool | None = None,
    ) -> None:
        """Note what became of a command and what holds from now on.

        Args:
            result: The answer.
            mark: What the command is recognised by; None of a loss.
            end: End of the log.
            sizes: Sizes of steps.
            inverted: Whether right means left, where commands have set it otherwise than the bridge's options.
        """
        await self._add(
            {
                "is": "ended",
                "result": asdict(result),
                "mark": _dict(mark),
                "end": end,
                "distance": sizes.distance,
                "angle": sizes.angle,
                "inverted": inverted,
            }
        )

    async def publish(self, count: int, next: int) -> None:
        """Note that the first results are published, and where the topic of results goes on."""
        await self._add({"is": "published", "count": count, "next": next})

    async def _add(self, entry: dict[str, Any]) -> None:
        async with self._writing:
            state = self.state.after(entry)
            line = json.dumps(entry).encode() + b"\n"
            try:
                if os.write(self._file, line) != len(line):
                    raise JournalError(f"{self.path}: the disk is full")
                self._size += len(line)
                self.state = state
                await asyncio.to_thread(os.fdatasync, self._file)
                if self._size > COMPACTED:
                    self._compact()
            except OSError as error:
                raise JournalError(f"{self.path}: {error.strerror}") from None
        self.changed.set()

    def _read(self) -> JournalState:
        state = JournalState()
        content = self.path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.ftruncate(self._file, whole)
        self._size = whole
        os.lseek(self._file, whole, os.SEEK_SET)
        try:
            for number, line in enumerate(content[:whole].splitlines()):
                entry = json.loads(line)
                if number == 0:
                    self._check_log(entry["journal"])
                else:
                    state = state.after(entry)
        except (ValueError, KeyError, TypeError):
            raise SettingError(
                f"{self.path}:{number + 1} is no entry of a journal; name another file with --journal"
            ) from None
        return state

    def _check_log(self, log: str) -> None:
        if log != self._log:
            raise SettingError(
                f"the journal {self.path} is of {log}, not of {self._log}; name another file with --journal"
            )

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            replaced = self.path.stat().st_ino != os.fstat(self._file).st_ino
        except OSError:
            replaced = True
        if replaced:  # or locked
            raise SettingError(
                f"another bridge uses the journal {self.path}; end it, or name another file with --journal"
            ) from None

    def _compact(self) -> None:
        """Replace the file by one that holds the name of the log and the present state."""
        temporary = self.path.with_name(f"{self.path.name}.new")
        lines = ({"journal": self._log}, self.state.as_entry())
        content = b"".join(json.dumps(line).encode() + b"\n" for line in lines)
        flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC
        fresh = os.open(temporary, flags, 0o600)
        try:
            fcntl.flock(fresh, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.write(fresh, content)
            os.fsync(fresh)
            temporary.replace(self.path)
            _sync_folder(self.path.parent)
        except BaseException:
            os.close(fresh)
            raise
        os.close(self._file)
        self._file, self._size = fresh, len(content)


def _sync_folder(folder: Path) -> None:
    """Make the name of a file in the folder survive a power failure."""
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _dict(mark: Mark | None) -> dict[str, Any] | None:
    return None if mark is None else asdict(mark)
