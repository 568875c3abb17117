"""What all tests of sessions share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.teleop.scenario.whatif.support import as_if_by_a_client, record


@pytest.fixture(scope="session", autouse=True)
def derived_files(cache: Path) -> Iterator[None]:
    """Keep prepared maps in a folder of the tests' own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache.parent))
        yield


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory, derived_files: None) -> Path:
    """A recorded drive of an operator of the library."""
    return record(tmp_path_factory.mktemp("whatif") / "run")


@pytest.fixture(scope="session")
def client_run(run: Path) -> Path:
    """The same drive, as if a client of one's own had driven."""
    return as_if_by_a_client(run, run.with_name("client_run"))
