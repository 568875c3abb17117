"""Processes that run scenarios side by side, and end with the command that started them, however that ends."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from typing import Final, ParamSpec, TypeVar

from teleop.errors import TeleopError

_Given = ParamSpec("_Given")
_Value = TypeVar("_Value")
_HELD: Final = (signal.SIGINT, signal.SIGTERM)


class WorkerPool:
    """Hands tasks to processes."""

    def __init__(self, executor: ProcessPoolExecutor) -> None:
        self._executor = executor

    def submit(
        self, task: Callable[_Given, _Value], *args: _Given.args, **kwargs: _Given.kwargs
    ) -> Future[_Value]:
        """Hand over a task, in which KeyboardInterrupt may be raised."""
        # A process that is started here inherits the mask, and takes no signal before it can handle it.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _HELD)
        try:
            return self._executor.submit(_run, task, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def worker_pool(count: int) -> Iterator[WorkerPool]:
    """Start processes; who leaves early, as by Ctrl-C, interrupts what they do, and waits for their end.

    Args:
        count: Number of processes.

    Raises:
        TeleopError: If a process was killed.
    """
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=context, initializer=_begin) as executor:
        try:
            yield WorkerPool(executor)
        except BrokenProcessPool:
            raise TeleopError(
                "a process that ran scenarios was killed, perhaps for want of memory; try fewer --jobs"
            ) from None
        except BaseException:
            for process in multiprocessing.active_children():
                process.terminate()
            executor.shutdown(cancel_futures=True)
            raise


class _Interruption:
    """Owns whether this process was asked to end: the task is interrupted once, and none is begun any more."""

    def __init__(self) -> None:
        self.is_asked = self.is_busy = False

    def handle(self, *_: object) -> None:
        was_asked, self.is_asked = self.is_asked, True
        if self.is_busy and not was_asked:
            raise KeyboardInterrupt


_interruption: Final = _Interruption()


def _begin() -> None:
    """Begin a process: the command alone handles Ctrl-C, which a terminal sends to all, and passes it on."""
    # A function, for clients inherit what is ignored.
    signal.signal(signal.SIGINT, lambda *_: None)
    signal.signal(signal.SIGTERM, _interruption.handle)
    parent = multiprocessing.parent_process()
    assert parent is not None
    # It inherits the mask: a signal that it took would not wake the thread that works.
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _HELD)


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def _run(task: Callable[_Given, _Value], /, *args: _Given.args, **kwargs: _Given.kwargs) -> _Value:
    _interruption.is_busy = True
    try:
        if _interruption.is_asked:
            raise KeyboardInterrupt
        return task(*args, **kwargs)
    finally:
        _interruption.is_busy = False
