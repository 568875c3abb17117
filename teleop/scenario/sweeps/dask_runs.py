"""Runs of a sweep on Dask: handed out as workers are free, and taken as they end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from localization.extras import require
from teleop.errors import SettingError
from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.sweeps.cells import Run
from teleop.scenario.sweeps.dask_workers import Workers, client_of
from teleop.scenario.sweeps.running import RunResult, run_one

if TYPE_CHECKING:
    from distributed import Client, Future

_Value = TypeVar("_Value")

_AHEAD: Final = 3
"""Runs that wait at each worker: enough that none is idle, few enough that little is lost when the sweep ends."""
_PATIENCE_MIDWAY: Final = 60.0
"""Time without any worker after which a sweep gives up [s]."""
_LOOK: Final = 5.0
"""Time between two looks at whether there are workers [s]."""
_KEPT: Final = "what is done is kept, and the same command goes on where it was"


def results_of(
    runs: Sequence[Run], workers: Workers, *, beside: Path | None
) -> Iterator[tuple[Run, RunResult]]:
    """Yield the result of each run as it is known, in any order.

    What a worker was computing when it ended is computed again by another one.

    Args:
        runs: The runs.
        workers: Where they are computed.
        beside: Folder of the scenario's file, which a worker on another machine must have as well.

    Raises:
        SettingError: If no scheduler answers, or it goes away, or all workers do, or a run has ended several workers.
    """
    require("distributed", "a sweep")

    folder = None if beside is None else str(beside.resolve())
    waiting = deque(runs)
    with client_of(workers, len(runs)) as client:
        under_way: dict[Future[Any], Run] = {}
        while waiting or under_way:
            with _losses_said_in_a_line(workers):
                room = _AHEAD * max(1, _threads(client)) - len(under_way)
                for _ in range(min(room, len(waiting))):
                    run = waiting.popleft()
                    text = SCHEMA.dump_json(run.scenario).decode()
                    key = f"run-{run.key}"
                    under_way[client.submit(run_one, text, folder, key=key, pure=False)] = run
                ended = _first_ended(client, list(under_way))
            for future in ended:
                run = under_way.pop(future)
                with _losses_said_in_a_line(workers):
                    result = _result(client, future, run)
                yield run, result


def _threads(client: Client) -> int:
    return sum(client.nthreads().values())


def _first_ended(client: Client, futures: list[Future[Any]]) -> list[Future[Any]]:
    """Return those that have ended, at least one."""
    from distributed import wait

    def attempt(timeout: float) -> list[Future[Any]]:
        return list(wait(futures, timeout=timeout, return_when="FIRST_COMPLETED").done)

    return _patiently(client, attempt)


def _result(client: Client, future: Future[Any], run: Run) -> RunResult:
    """Return what a run has shown; it is computed again if the worker that had it is lost."""
    from distributed import KilledWorker

    try:
        fields = _patiently(client, lambda timeout: future.result(timeout=timeout))
    except KilledWorker:
        values = ", ".join(f"{name}={value}" for name, value in run.cell.values)
        raise SettingError(
            f"the run of {values}, seed {run.number}, ended each worker that tried it"
            " (is there enough memory?); what is done is kept"
        ) from None
    future.release()
    return RunResult(**fields)


def _patiently(client: Client, attempt: Callable[[float], _Value]) -> _Value:
    """Return what an attempt that may time out [s] returns; give up if there are no workers for a minute."""
    without = 0.0
    while True:
        try:
            return attempt(_LOOK)
        except TimeoutError:
            without = 0.0 if _threads(client) else without + _LOOK
        if without >= _PATIENCE_MIDWAY:
            raise SettingError(f"all workers have gone, for {_PATIENCE_MIDWAY:g} s; {_KEPT}")


@contextmanager
def _losses_said_in_a_line(workers: Workers) -> Iterator[None]:
    """Say in one line that the scheduler has gone."""
    from distributed import CancelledError

    try:
        yield
    except (CancelledError, OSError):
        where = f"--dask {workers.address}: " if workers.address else ""
        raise SettingError(f"{where}the scheduler has gone; {_KEPT}") from None
