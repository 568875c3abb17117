"""A corridor in an occupancy grid: its rough walls hold nothing along themselves."""

from __future__ import annotations

import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import SECOND
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    PASSAGE,
    PASSAGE_REACH,
    PASSAGE_START,
    PASSING,
    Wheels,
    follow,
    moments,
    summary,
)
from tests.support_grid import grid_of
from tests.support_rooms import Drive

pytestmark = pytest.mark.slow

DRIVE = Drive(PASSAGE, PASSAGE_START, *PASSING, begin=BEGIN)


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> PreparedMap:
    seen_from = [DRIVE.pose(stamp) for stamp in range(BEGIN, DRIVE.end, SECOND)]
    return grid_of(PASSAGE, seen_from, tmp_path_factory.mktemp("grid"), reach=PASSAGE_REACH)


@pytest.mark.long
def test_estimate_does_not_slide_along_a_corridor_while_the_wheels_are_right(
    grid: PreparedMap,
) -> None:
    log = moments(PASSAGE, DRIVE, Wheels(way=1.005), reach=PASSAGE_REACH)
    followed = follow(grid, DRIVE, log)
    # Wheels alone would be 0.13 m off at the end of what is bare.
    assert followed.off.max() < 0.3, summary(followed)
    assert followed.trusted_though_wrong == 0.0, summary(followed)
    assert followed.off[followed.true > 50.0].max() < 0.25, summary(followed)
