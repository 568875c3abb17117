"""What a journal says: where the log was read to, what is begun, and which results wait."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import msgspec

from teleop.bridges.kafka.results import Result
from teleop.step_commands.turtle_control import StepSizes

REMEMBERED: Final = 1000
"""Driven commands by which those that come again in a new log are known; as many before it began, and since."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A command of the log, by which the log is recognised."""

    timestamp: int
    """Its time [ms]."""
    digest: str
    """Digest of its time, key and value."""


@dataclass(frozen=True, slots=True)
class JournalState:
    """The sum of a journal's entries; each function returns the state after an entry."""

    log: int = 0
    """How often the log was found to have begun again."""
    next: int | None = None
    """Offset of the next command; None before the log was first read."""
    end: int = 0
    """The largest end of the log that was seen."""
    mark: Mark | None = None
    """The command before ``next``; None if there is no such command."""
    begun: int | None = None
    """Offset of the command that is being carried out."""
    driven: tuple[str, ...] = ()
    """Digests of the last commands of this log that were begun."""
    driven_before: tuple[str, ...] = ()
    """Digests of the last commands that were begun before the log began again."""
    distance: float | None = None
    """Length of a step, as commands have set it [m]."""
    angle: int | None = None
    """Size of a turn, as commands have set it [deg]."""
    inverted: bool | None = None
    """Whether right means left, where commands have set it otherwise than the bridge's options."""
    waiting: tuple[Result, ...] = ()
    """Results that are yet to be published, in order."""
    published: int = 0
    """Offset in the topic of results behind the last one that was published."""

    def sizes(self, defaults: StepSizes) -> StepSizes:
        """Return the sizes in force, with speeds of the defaults, and their senses unless commands have set them."""
        inverted = defaults.right_turns_left if self.inverted is None else self.inverted
        return replace(
            defaults, distance=self.distance, angle=self.angle, right_turns_left=inverted
        )

    def after(self, entry: dict[str, Any]) -> JournalState:
        """Return the state after an entry.

        Raises:
            KeyError: If it is no entry of a journal; TypeError and ValueError likewise.
        """
        match entry["is"]:
            case "state":
                return msgspec.convert(entry["state"], JournalState)
            case "opened":
                mark = None if entry["mark"] is None else Mark(**entry["mark"])
                state = self if entry["log"] == self.log else self._in_a_new_log()
                return replace(
                    state, log=entry["log"], next=entry["next"], end=entry["end"], mark=mark
                )
            case "begun":
                driven = (*self.driven, entry["mark"]["digest"])[-REMEMBERED:]
                return replace(self, begun=entry["offset"], driven=driven)
            case "ended":
                result = Result(**entry["result"])
                state = replace(self, begun=None, waiting=(*self.waiting, result))
                if entry["mark"] is None:  # a loss, of which no command is the cause
                    return state
                return replace(
                    state,
                    next=result.offset + 1,
                    end=max(self.end, entry["end"]),
                    mark=Mark(**entry["mark"]),
                    distance=entry["distance"],
                    angle=entry["angle"],
                    inverted=entry["inverted"],
                )
            case "published":
                rest = self.waiting[entry["count"] :]
                return replace(self, waiting=rest, published=entry["next"])
            case kind:
                raise ValueError(f"unknown entry {kind!r}")

    def _in_a_new_log(self) -> JournalState:
        before = (*self.driven_before, *self.driven)[-REMEMBERED:]
        return replace(self, driven=(), driven_before=before)

    def as_entry(self) -> dict[str, Any]:
        """Return an entry that says all of it."""
        return {"is": "state", "state": asdict(self)}
