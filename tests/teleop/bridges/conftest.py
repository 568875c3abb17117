"""One broker for all tests of the bridges; each test has topics of its own."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest

from tests.teleop.bridges.support import Broker, broker

_NUMBERS = itertools.count()


@pytest.fixture(scope="session")
def tansu(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    """A broker whose log is in memory."""
    with broker(tmp_path_factory.mktemp("broker")) as started:
        yield started


@pytest.fixture
def topic() -> str:
    """A name for a topic that no other test uses."""
    return f"t{next(_NUMBERS)}"
