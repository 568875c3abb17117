"""Calls of a program's callbacks, which must not end its connection."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Final, ParamSpec

_LOG: Final = logging.getLogger(__name__)

P = ParamSpec("P")


def call_back(
    subject: str, callback: Callable[P, object], *args: P.args, **kwargs: P.kwargs
) -> None:
    """Call a callback of a subject, such as a topic; what it raises is logged."""
    try:
        callback(*args, **kwargs)
    except Exception:
        _LOG.exception("a callback of %s failed", subject)
