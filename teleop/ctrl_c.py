"""Ctrl-C before a command handles it itself: it must not be lost, nor taken for a defect.

A KeyboardInterrupt may be: Python drops what a callback of a weak reference raises, and compiled modules drop it or
turn it into errors of their own.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

_RETRY: Final = 0.02
"""Time after which it is raised again where an import held it up, or where it was dropped [s]."""


class CtrlCHandler:
    """Raises KeyboardInterrupt upon Ctrl-C, but not while a module is being imported, and again if it was dropped."""

    def __init__(self) -> None:
        self.raised = False
        """Whether it was raised: any error that follows may come from it."""

    def handle(self) -> None:
        """Handle Ctrl-C from now on, until an event loop does; where a shell has it ignored, it stays so."""
        if hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, _raise_again)
            sys.unraisablehook = _raise_what_was_dropped
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._interrupt)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if hasattr(signal, "setitimer") and _importing(frame):
            signal.setitimer(signal.ITIMER_REAL, _RETRY)
            return
        self.raised = True
        signal.default_int_handler(number, frame)


@contextmanager
def left_to_event_loops() -> Iterator[None]:
    """Have ``asyncio.Runner`` take Ctrl-C: it ends its task between two callbacks, never in the middle of a tick."""
    handler = signal.getsignal(signal.SIGINT)
    ours = isinstance(getattr(handler, "__self__", None), CtrlCHandler)
    if not ours or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def _raise_what_was_dropped(dropped: UnraisableHookArgs) -> None:
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        signal.setitimer(signal.ITIMER_REAL, _RETRY)
    else:
        sys.__unraisablehook__(dropped)


def _raise_again(_number: int, _frame: FrameType | None) -> None:
    signal.raise_signal(signal.SIGINT)


def _importing(frame: FrameType | None) -> bool:
    """Return whether a frame, or one that called it, is of Python's import system."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False
