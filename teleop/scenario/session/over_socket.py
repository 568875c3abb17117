"""A run with a client that is not ours: over a real socket, at the clock's pace or stepped by the client."""

from __future__ import annotations

import asyncio
from typing import Final

from localization.types import SECOND
from teleop.clock import LARGEST_LAG, PERIOD
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.tick_record import TickRecord, resting
from teleop.scenario.referee.outcome import EventKind
from teleop.scenario.session.attendance import Attendance
from teleop.scenario.session.client_process import ClientProcess
from teleop.scenario.session.client_watch import ClientWatch
from teleop.scenario.session.in_memory import Progress
from teleop.scenario.session.session import Session

LINGER: Final = 10.0
"""Real time that a client has to end by itself once the run is over [s]."""
_POLL: Final = 0.05
"""Real time between two looks at a client while the robot waits [s]."""
_LISTEN: Final = 0.001
"""Real time for sockets between two ticks of a robot that is behind [s]."""


async def run_over_socket(
    session: Session,
    watch: ClientWatch,
    client: ClientProcess | None,
    *,
    patience: float,
    progress: Progress = lambda share, text: None,
) -> str:
    """Tick a started session by the clock until it is over.

    The world waits for the client's first connection. What happens from then on depends on when frames arrive,
    not on how fast this machine is: lag is let go. Where the client has gone, the robot is ticked until it rests.

    Args:
        session: The session, whose server listens.
        watch: Sees who is connected.
        client: The client's processes; None if somebody else has started it.
        patience: Real time within which it must connect, and come back if it leaves [s].
        progress: Called once in a second of robot time.

    Returns:
        Why the client failed; empty if it did not.
    """
    attendance = Attendance(watch, client, patience, asyncio.get_running_loop().time)
    if failure := await _connected(watch, attendance):
        return _failed(session, failure)
    pace = _Pace()
    failure, braking = "", 0
    while session.ending is None:
        tick = session.tick()
        if tick is not None and tick.stamp % SECOND == 0:
            share, health = tick.stamp / session.time_limit, tick.estimate.health.value
            progress(share, f"{tick.stamp // SECOND} s, {health}")
        if session.ending is not None:
            break  # before a client that waited for the end can leave
        failure = failure or attendance.absent()
        if failure:
            braking += 1
            if tick is None or resting(tick) or braking > LockstepService.MAX_BRAKING_TICKS:
                break
        await pace.wait()
    return _failed(session, failure or await _end(session, attendance))


async def run_stepped(
    session: Session,
    watch: ClientWatch,
    client: ClientProcess | None,
    *,
    patience: float,
    progress: Progress = lambda share, text: None,
) -> str:
    """Wait while a client steps a started session, until it is over or the client has gone.

    Args:
        session: The session, whose server listens.
        watch: Sees who is connected.
        client: The client's processes; None if somebody else has started it.
        patience: Real time within which it must connect, step, and come back if it leaves [s].
        progress: Called once in a second of robot time.

    Returns:
        Why the client failed; empty if it did not.
    """
    loop = asyncio.get_running_loop()
    begun = loop.time()

    def report(tick: TickRecord) -> None:
        if tick.stamp % SECOND == 0:
            factor = tick.stamp / SECOND / max(loop.time() - begun, 1e-9)
            text = f"{tick.stamp // SECOND} s at {factor:.1f}x, {tick.estimate.health.value}"
            progress(session.share, text)

    session.stepped.observers = (*session.stepped.observers, report)
    session.records_later = True
    service = LockstepService(
        session.stepped, over=lambda: session.ending or "", deferred=session.record
    )
    attendance = Attendance(watch, client, patience, loop.time)
    if failure := await _connected(watch, attendance):
        return _failed(session, failure)
    stamp, moved = session.stamp, loop.time()
    while session.ending is None:
        await asyncio.sleep(_POLL)
        if session.ending is not None:
            break  # and a client that waited for the end may be gone by now
        if session.stamp != stamp:
            stamp, moved = session.stamp, loop.time()
        if isinstance(service.error, OSError):
            raise service.error  # the run cannot be recorded
        if service.error is not None:
            session.end(str(service.error), cut_short=True)
        elif failure := attendance.absent():
            return await _braked(session, failure)
        elif loop.time() - moved > patience:
            failure = f"the client has not called /sim/step for {patience:g} s"
            return await _braked(session, failure)
    return _failed(session, await _end(session, attendance))


async def end_client(client: ClientProcess) -> None:
    """End a client with all that it has started; it is asked before it is killed."""
    client.end()
    while client.left is None:
        await asyncio.sleep(_POLL)
        client.look()


class _Pace:
    """Waits for the moments of ticks; owns when the next one is due."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._due = self._loop.time()

    async def wait(self) -> None:
        """Wait until the next tick is due, and listen to the sockets meanwhile."""
        self._due += PERIOD / SECOND
        if (lag := self._loop.time() - self._due) > LARGEST_LAG / SECOND:
            self._due += lag
        await asyncio.sleep(max(_LISTEN, self._due - self._loop.time()))


async def _connected(watch: ClientWatch, attendance: Attendance) -> str:
    """Wait for the first connection; return why there is none, or nothing."""
    while not watch.ever:
        if failure := attendance.absent():
            return failure
        await asyncio.sleep(_POLL)
    return ""


async def _braked(session: Session, failure: str) -> str:
    """Tick a robot that nobody steps any more until it rests, and end the session."""
    for _ in range(LockstepService.MAX_BRAKING_TICKS):
        tick = session.tick()
        if tick is None or resting(tick):
            break
        await asyncio.sleep(0)
    return _failed(session, failure)


def _failed(session: Session, failure: str) -> str:
    """End a session, if it has not ended, because the client failed; return why, or nothing if it has not."""
    if failure:
        session.note(EventKind.CLIENT, failure)
        session.end(failure)
    return failure


async def _end(session: Session, attendance: Attendance) -> str:
    """Let a client end by itself once the run is over, as a test does that looks at the display at last.

    Returns:
        Why it has failed, also before the end of the run; empty if it has not.
    """
    # Who has reached the last goal may be gone by the time that this is seen.
    failure = "" if session.referee.all_reached else attendance.at_the_end()
    for _ in range(round(LINGER / _POLL)):
        if attendance.ended:
            break
        await asyncio.sleep(_POLL)
    return failure or attendance.failure()
