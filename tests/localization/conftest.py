"""Maps that are prepared once; nothing changes them."""

from __future__ import annotations

import pytest

from localization.maps.prepared_map import PreparedMap
from tests.support_rooms import CORRIDOR, HALL, SQUARE


@pytest.fixture(scope="session")
def hall() -> PreparedMap:
    return HALL.prepared()


@pytest.fixture(scope="session")
def square() -> PreparedMap:
    return SQUARE.prepared()


@pytest.fixture(scope="session")
def corridor() -> PreparedMap:
    return CORRIDOR.prepared()
