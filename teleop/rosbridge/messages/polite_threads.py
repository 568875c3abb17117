"""Threads that work in Python for long beside an event loop, and leave it most of the time.

Only one thread of Python runs at a time. The event loop gives that up with each call of a socket,
and has to wait for it afterwards; beside a thread that always works it would do one call a
millisecond at most.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

_MESSAGES: Final = 128
"""Nested messages between two pauses, which take about a millisecond."""

_PAUSE: Final = 0.004
"""Length of a pause [s]."""


class _Thread(threading.local):
    paused: Callable[[], object] | None = None
    messages = 0


_THREAD: Final = _Thread()
_NEVER: Final = threading.Event()


@contextmanager
def polite_thread(paused: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Have this thread pause again and again meanwhile, and call ``paused`` after each pause.

    What that raises ends the work.
    """
    before, _THREAD.paused = _THREAD.paused, paused
    try:
        yield
    finally:
        _THREAD.paused = before


def after_message() -> None:
    """Pause now and then, if this thread is polite; called after the work on each nested message."""
    if _THREAD.paused is not None:
        _THREAD.messages += 1
        if _THREAD.messages >= _MESSAGES:
            _THREAD.messages = 0
            _NEVER.wait(_PAUSE)
            _THREAD.paused()
