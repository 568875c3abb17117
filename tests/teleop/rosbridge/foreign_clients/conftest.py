"""roslibpy's own tests are started with the first test of this folder, as they mostly sleep."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack

import pytest

from tests.teleop.rosbridge.foreign_clients.roslibpy_suite import Runs, begin_all


@pytest.fixture(scope="session")
def roslibpy_runs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Future[Runs]]:
    """Return the runs of roslibpy's own tests; an error in starting them is raised by ``result``."""
    folder = tmp_path_factory.mktemp("roslibpy")
    with ExitStack() as ending, ThreadPoolExecutor(1) as starter:
        yield starter.submit(begin_all, folder, ending)


@pytest.fixture(scope="session", autouse=True)
def _early(request: pytest.FixtureRequest) -> None:
    if any("roslibpy_runs" in getattr(item, "fixturenames", ()) for item in request.session.items):
        request.getfixturevalue("roslibpy_runs")
