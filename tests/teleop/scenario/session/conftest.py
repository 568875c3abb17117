"""What all tests of sessions share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.teleop.scenario.session.support import run, scenario


@pytest.fixture(scope="session", autouse=True)
def derived_files(cache: Path) -> Iterator[None]:
    """Keep prepared maps in a folder of the tests' own; prepare the corridor's on no test's account."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache.parent))
        run(scenario(), ticks=1)
        yield
