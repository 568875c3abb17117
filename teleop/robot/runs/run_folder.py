"""The folder of recorded runs: what is in it, what is kept, and how room is made for others."""

from __future__ import annotations

import contextlib
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from mcap.exceptions import McapError
from mcap.reader import make_reader

LIST: Final = "/runs"
"""Path of the list over HTTP; a run is below it."""

MOST_BYTES: Final = 1_000_000_000
"""Largest size of a run [bytes]: about an hour and a half of driving."""

_NAME: Final = re.compile(r"run-\d{8}-\d{6}\.mcap")
_KEPT: Final = ".kept"
"""Ending of an empty file beside a run that is kept."""
_MOST_LISTED: Final = 200


class _Stored(NamedTuple):
    path: Path
    size: int
    """[bytes]"""

    kept: bool


class RunFolder:
    """Runs by name; a run that is kept has a file beside it, so that it is kept by the next robot as well."""

    def __init__(self, folder: Path, space: int) -> None:
        """Take a folder over, which need not be there yet; ``space`` is the most that its runs may take [bytes]."""
        self.folder, self.space = folder, space

    def find(self, name: str) -> Path | None:
        """Return the path of a run; None if there is no such run."""
        path = self.folder / name
        return path if _NAME.fullmatch(name) and path.is_file() else None

    def keep(self, path: Path, keep: bool) -> None:
        """Keep a run when room is made, or no longer.

        Raises:
            OSError: If the folder cannot be written.
        """
        mark = _mark(path)
        if keep:
            mark.touch()
        else:
            mark.unlink(missing_ok=True)

    def delete(self, path: Path) -> None:
        """Delete a run.

        Raises:
            OSError: If it cannot be deleted.
        """
        path.unlink()
        _mark(path).unlink(missing_ok=True)

    def room(self) -> int:
        """Return what a new run may take at most [bytes], once the runs that nobody keeps are gone."""
        kept = sum(run.size for run in self._stored() if run.kept)
        return max(0, min(MOST_BYTES, self.space - kept))

    def make_room(self, present: Path) -> list[str]:
        """Delete the oldest runs that nobody keeps until all take no more than they may; return their names.

        Args:
            present: The run that is being recorded, which stays.
        """
        stored = sorted(self._stored())
        taken, gone = sum(run.size for run in stored), list[str]()
        for run in stored:
            if taken > self.space and not run.kept and run.path != present:
                with contextlib.suppress(OSError):  # what cannot be deleted takes its room on
                    self.delete(run.path)
                    taken -= run.size
                    gone.append(run.path.name)
        return gone

    def facts(self, without: str) -> list[dict[str, Any]]:
        """Return the newest runs first, as ``/runs`` lists them, without the one of this name."""
        stored = sorted((run for run in self._stored() if run.path.name != without), reverse=True)
        return [_facts(run) for run in stored[:_MOST_LISTED]]

    def _stored(self) -> Iterator[_Stored]:
        for path in self.folder.glob("run-*.mcap"):
            with contextlib.suppress(FileNotFoundError):  # deleted meanwhile
                if self.find(path.name) is not None:
                    yield _Stored(path, path.stat().st_size, _mark(path).exists())


def _mark(path: Path) -> Path:
    return path.with_name(path.name + _KEPT)


def _facts(run: _Stored) -> dict[str, Any]:
    name, seconds = run.path.name, None
    try:
        with run.path.open("rb") as file:
            summary = make_reader(file).get_summary()
        if summary is not None and (all_of := summary.statistics) is not None:
            seconds = (all_of.message_end_time - all_of.message_start_time) / 1e9
    except (McapError, OSError, struct.error):  # the last of a file of a few bytes
        pass  # it has no end, since the disk was full: its length is not known
    return {
        "name": name,
        "url": f"{LIST}/{name}",
        "start": f"{name[4:8]}-{name[8:10]}-{name[10:12]}T{name[13:15]}:{name[15:17]}:{name[17:19]}Z",
        "seconds": seconds,
        "bytes": run.size,
        "kept": run.kept,
    }
