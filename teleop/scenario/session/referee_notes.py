"""What the referee noted of clients, and how the run ended, as lines of JSON.

None of it follows from the messages that the robot took: who came and left, what was tried and is not allowed, which
rules the frames on the wire have broken. A repeated run gets it from here, so that its verdict is the same.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TextIO

from teleop.errors import TeleopError
from teleop.scenario.referee.outcome import Event, EventKind

KINDS: Final = (EventKind.CLIENT, EventKind.VIOLATION, EventKind.RULE)
"""Kinds of events that the trajectory does not show."""


class NotesFileError(TeleopError):
    """The file of the referee's notes is damaged; the message names file and line."""


@dataclass(frozen=True, slots=True)
class Note:
    """An event that the trajectory does not show."""

    stamp: int
    """Robot time [ns]: the end of a tick, or 0."""
    kind: EventKind
    """One of ``KINDS``."""
    text: str
    """What happened; may contain names from the wire."""


@dataclass(frozen=True, slots=True)
class Ending:
    """How a run ended."""

    ending: str
    """Why, as a sentence without a full stop."""
    failure: str = ""
    """How the client failed; empty if it did not."""
    cut_short: bool = False
    """Whether it ended before it was decided, so that it cannot have passed."""


@dataclass(frozen=True, slots=True)
class Notes:
    """All that such a file holds."""

    notes: Sequence[Note]
    """The events, in order."""
    ending: Ending | None
    """How the run ended; None if its process ended first, such as by SIGKILL."""


class NotesWriter:
    """Writes notes as they are made."""

    def __init__(self, path: Path) -> None:
        self._file: TextIO = path.open("w", encoding="utf-8")

    def write(self, event: Event) -> None:
        """Write an event if the trajectory does not show it."""
        if event.kind in KINDS:
            self._write({"stamp": event.stamp, "kind": event.kind.value, "text": event.text})

    def end(self, ending: Ending) -> None:
        """Write how the run ended, after all events."""
        self._write(
            {"ending": ending.ending, "failure": ending.failure, "cut_short": ending.cut_short}
        )

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, line: dict[str, object]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":")) + "\n")
        # What has been noted is on the disk, whatever happens to the process.
        self._file.flush()


def read_notes(path: Path) -> Notes:
    """Return what a file of notes holds.

    Raises:
        NotesFileError: If the file is damaged.
    """
    notes: list[Note] = []
    ending = None
    with path.open("rb") as file:
        for number, text in enumerate(file, 1):
            try:
                line = _line(json.loads(text))
                if ending is not None:
                    raise ValueError("a line after the end of the run")
                if isinstance(line, Ending):
                    ending = line
                    continue
                if notes and line.stamp < notes[-1].stamp:
                    raise ValueError(f"time {line.stamp} after time {notes[-1].stamp}")
                notes.append(line)
            except (ValueError, RecursionError) as error:
                raise NotesFileError(f"{path}:{number}: is damaged: {error}") from None
    return Notes(notes, ending)


def _line(values: Any) -> Note | Ending:
    """Return a line; raise ValueError for anything else."""
    match values:
        case {"stamp": int(stamp), "kind": str(kind), "text": str(text), **more} if not more:
            if kind in KINDS:
                return Note(stamp, EventKind(kind), text)
        case {
            "ending": str(ending),
            "failure": str(failure),
            "cut_short": bool(cut_short),
            **more,
        } if not more:
            return Ending(ending, failure, cut_short)
    raise ValueError("neither a note nor the end of a run")
