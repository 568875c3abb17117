"""The thread that works on large frames: for each client in turn, and for none that has left.

Who has used the thread least comes next (start-time fair queueing, with a start for those who have
not used it of late). A short frame does not wait for
the end of a long one: its work is done in a pause of that, if its client has used less.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from teleop.rosbridge.messages.polite_threads import polite_thread

SHORT: Final = 131_072
"""Size up to which a frame is worked on within a longer one [bytes]; 0.5 s of work at most."""

_START: Final = 400
"""What somebody who has not used the thread of late is ahead of the others, in pauses: 2 s of work."""

_T = TypeVar("_T")


class _AbandonedError(Exception):
    """Nobody waits for the result any more."""


@dataclass(slots=True, eq=False)
class _Job:
    client: int
    size: int
    work: Callable[[], Any]
    done: Callable[[Any, Exception | None], None]
    turn: int
    """What its client has used of the thread before, in pauses."""

    used: int = 1
    """What it has used itself."""

    abandoned: bool = False


class WorkThread:
    """A thread with one queue of work for each client."""

    def __init__(self, name: str) -> None:
        """Start the thread."""
        self._changed = threading.Condition()
        self._waiting: list[_Job] = []
        self._used: dict[int, int] = {}
        """What each client had used after its last job, if that is more than newcomers have."""

        self._turn = 0
        """The turn of the newest job that has begun."""

        self._closed = False
        threading.Thread(target=self._serve, name=name, daemon=True).start()

    async def run(self, client: int, size: int, work: Callable[[], _T]) -> _T:
        """Return the result of work, which is abandoned if this is cancelled.

        Args:
            client: For whom it is.
            size: Size of its frame [bytes].
            work: The work; it pauses with each nested message, see ``polite_threads``.
        """
        loop = asyncio.get_running_loop()
        future: asyncio.Future[_T] = loop.create_future()

        def done(result: Any, error: Exception | None) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(_resolve, future, result, error)

        job = self._add(client, size, work, done)
        try:
            return await future
        finally:
            self._abandon(job)

    def close(self) -> None:
        """End the thread, and abandon all work."""
        with self._changed:
            self._closed = True
            for job in self._waiting:
                job.abandoned = True
            self._waiting.clear()
            self._changed.notify()

    def _add(
        self,
        client: int,
        size: int,
        work: Callable[[], Any],
        done: Callable[[Any, Exception | None], None],
    ) -> _Job:
        with self._changed:
            turn = max(self._turn - _START, self._used.get(client, 0))
            job = _Job(client, size, work, done, turn)
            self._waiting.append(job)
            self._changed.notify()
            return job

    def _abandon(self, job: _Job) -> None:
        with self._changed:
            job.abandoned = True
            if job in self._waiting:
                self._waiting.remove(job)

    # In the thread

    def _serve(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._closed:
                    self._changed.wait()
                if self._closed:
                    return
                job = self._take(self._waiting)
            self._work(job)

    def _take(self, jobs: list[_Job]) -> _Job:
        job = min(jobs, key=lambda job: job.turn)  # of several, the one that waits longest
        self._waiting.remove(job)
        self._turn = max(self._turn, job.turn)
        return job

    def _work(self, job: _Job) -> None:
        result, error = None, None
        try:
            with polite_thread(lambda: self._paused(job)):
                result = job.work()
        except _AbandonedError:
            pass
        except Exception as raised:
            error = raised
        with self._changed:
            self._used[job.client] = max(self._used.get(job.client, 0), job.turn + job.used)
            least = self._turn - _START
            self._used = {who: used for who, used in self._used.items() if used > least}
        job.done(result, error)

    def _paused(self, job: _Job) -> None:
        if job.abandoned or self._closed:
            raise _AbandonedError
        job.used += 1
        if short := self._short_before(job):
            self._work(short)

    def _short_before(self, job: _Job) -> _Job | None:
        if job.size <= SHORT:
            return None
        with self._changed:
            turn = job.turn + job.used
            found = [one for one in self._waiting if one.size <= SHORT and one.turn < turn]
            return self._take(found) if found else None


def _resolve(future: asyncio.Future[Any], result: Any, error: Exception | None) -> None:
    if not future.done():
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)
