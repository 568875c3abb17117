"""Ctrl-C before a command handles it itself: it must not be lost, nor taken for a defect.

A KeyboardInterrupt may be: Python drops what a callback of a weak reference raises, and compiled modules turn it into
errors of their own.
"""

from __future__ import annotations

import signal
from types import FrameType
from typing import Final

_RETRY: Final = 0.02
"""Time between looks whether an import is over [s]."""


class Interruption:
    """Raises KeyboardInterrupt upon Ctrl-C, but not while a module is being imported, and remembers that it did."""

    def __init__(self) -> None:
        self.raised = False
        """Whether it was raised: any error that follows may come from it."""

    def handle(self) -> None:
        """Handle Ctrl-C from now on, until an event loop does; where a shell has it ignored, it stays so."""
        if hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, _raise_again)
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._interrupt)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if hasattr(signal, "setitimer") and _importing(frame):
            signal.setitimer(signal.ITIMER_REAL, _RETRY)
            return
        self.raised = True
        signal.default_int_handler(number, frame)


def _raise_again(_number: int, _frame: FrameType | None) -> None:
    signal.raise_signal(signal.SIGINT)


def _importing(frame: FrameType | None) -> bool:
    """Return whether a frame, or one that called it, is of Python's import system."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False
