"""A map that several drives are held against; nothing changes it."""

from __future__ import annotations

import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import SECOND
from tests.localization.pipeline.wheel_log import BEGIN, LAP_START, OFFICE, lap
from tests.support_grid import grid_of
from tests.support_rooms import Drive


@pytest.fixture(scope="session")
def grid(tmp_path_factory: pytest.TempPathFactory) -> PreparedMap:
    """The office as an occupancy grid, drawn from a place each second of a lap."""
    going = Drive(OFFICE, LAP_START, *lap(), begin=BEGIN)
    seen_from = [going.pose(stamp) for stamp in range(BEGIN, going.end, SECOND)]
    return grid_of(OFFICE, seen_from, tmp_path_factory.mktemp("grid"))
