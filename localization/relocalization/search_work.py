"""Work of a search, in pieces: done once however often it is asked for, and measured in points, never in time.

A search of the whole map takes a tenth of a second of processor time and more. The localiser spends a fixed amount of it on
each stretch of the readings' time. How much was granted is a number in the localiser's state, so that a state
can be returned to; what the work came to is kept here, and is the same for every state.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Final, TypeAlias, TypeVar

from localization.types import Candidate

Result = TypeVar("Result")
Work: TypeAlias = Generator[int, None, Result]
"""Yields the amount of each piece, in points laid over the plan or what costs as much, and returns the result."""
SearchWork: TypeAlias = Work[tuple[Candidate, ...]]
"""Returns the places found, best first."""

PIECE: Final = 250_000
"""Amount of a piece [points]."""
REFINEMENT: Final = 2_500_000
"""A place that is refined against the cloud costs as much as this many points on the plan."""


class ResumableSearch:
    """The pieces of a search, computed once however often they are asked for."""

    def __init__(self, work: SearchWork) -> None:
        self._work = work
        self._spent = 0
        self._found: tuple[Candidate, ...] | None = None

    def after(self, granted: int) -> tuple[Candidate, ...] | None:
        """Return the places found once so much work may have been done; None if the search takes more.

        Args:
            granted: amount of work since the search began [points].
        """
        while self._found is None and self._spent <= granted:
            try:
                self._spent += next(self._work)
            except StopIteration as done:
                self._found = done.value
        return self._found if self._spent <= granted else None
