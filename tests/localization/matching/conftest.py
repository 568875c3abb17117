from __future__ import annotations

import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import Pose
from tests.support_grid import grid_of
from tests.support_rooms import CORRIDOR


@pytest.fixture(scope="session")
def rough_corridor(tmp_path_factory: pytest.TempPathFactory) -> PreparedMap:
    """A corridor without ends along x, drawn into an occupancy grid from poses with the errors of a survey."""
    poses = [Pose.planar(x, 0.0, 0.0) for x in range(-12, 13)]
    return grid_of(CORRIDOR, poses, tmp_path_factory.mktemp("grid"), reach=8.0)
