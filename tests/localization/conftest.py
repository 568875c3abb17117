"""Maps that are prepared once; nothing changes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory
from localization.maps.map_files import save_cloud
from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.types import Pose
from tests.support_rooms import CORRIDOR, HALL, MOUNTS, SQUARE


@pytest.fixture(scope="session")
def hall() -> PreparedMap:
    return HALL.prepared()


@pytest.fixture(scope="session")
def hall_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the hall's map."""
    path = tmp_path_factory.mktemp("map") / "hall.ply"
    save_cloud(HALL.cloud(), path)
    return path


@pytest.fixture(scope="session")
def square() -> PreparedMap:
    return SQUARE.prepared()


@pytest.fixture(scope="session")
def corridor() -> PreparedMap:
    return CORRIDOR.prepared()


@pytest.fixture(scope="session", autouse=True)
def _loops_are_compiled() -> None:
    """Compile before a test's processor time is taken: on a new machine it would be some seconds of the first one."""
    Localizer(HALL.prepared(), MOUNTS)
    Trajectory.from_poses([(0, Pose.identity()), (2, Pose.identity())]).at(np.array([1]))
