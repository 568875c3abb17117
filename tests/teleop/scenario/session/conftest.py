"""What all tests of sessions share."""

from __future__ import annotations

import pytest

from tests.teleop.scenario.session.support import run, scenario


@pytest.fixture(scope="session", autouse=True)
def prepared_corridor(derived_files: None) -> None:
    """Prepare the corridor's map on no test's account."""
    run(scenario(), ticks=1)
