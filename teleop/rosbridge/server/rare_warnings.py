"""Warnings that anybody outside can cause: of each kind a line a minute, with their number."""

from __future__ import annotations

import logging
from typing import Final

_PERIOD: Final = 60.0
"""Time between two lines of a kind [s]."""

_MAX_KINDS: Final = 16
"""Kinds that are counted apart; further ones count as one."""


class RareWarnings:
    """Counts what happens between the lines."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._said: dict[str, float] = {}
        self._count: dict[str, int] = {}

    def warn(self, kind: str, text: str, now: float) -> None:
        """Log a warning, unless one of its kind was logged in the last minute.

        Args:
            kind: What counts as the same.
            text: The warning, as it is now.
            now: Current time [s].
        """
        if kind not in self._count and len(self._count) >= _MAX_KINDS:
            kind = ""
        self._count[kind] = self._count.get(kind, 0) + 1
        said = self._said.get(kind)
        if said is None or now - said >= _PERIOD:
            self._logger.warning("%s (%d times)", text, self._count[kind])
            self._said[kind], self._count[kind] = now, 0
