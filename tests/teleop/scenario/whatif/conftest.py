"""What all tests of forks share."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.teleop.scenario.whatif.support import as_if_by_a_client, record


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory, derived_files: None) -> Path:
    """A recorded drive of an operator of the library."""
    return record(tmp_path_factory.mktemp("whatif") / "run")


@pytest.fixture(scope="session")
def client_run(run: Path) -> Path:
    """The same drive, as if a client of one's own had driven."""
    return as_if_by_a_client(run, run.with_name("client_run"))
