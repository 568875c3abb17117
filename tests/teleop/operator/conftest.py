"""A short drive, recorded once, for all tests of the display."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.display.rerun_sink import Sink
from localization.maps.cloud import Cloud
from robot_sim import World
from teleop.operator.display.display import Display
from tests.teleop.operator.support import Moment, drive, play


@pytest.fixture(scope="session")
def moments(office: World, office_cloud: Cloud, cache: Path) -> list[Moment]:
    """Twelve seconds of the tour, with a hint after one and an e-stop from six to eight."""
    return list(drive(office, office_cloud, cache, seconds=12.0, estop=(6.0, 8.0)))


@pytest.fixture(scope="session")
def recording(
    moments: list[Moment], office_cloud: Cloud, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The drive as the display records it."""
    path = tmp_path_factory.mktemp("display") / "drive.rrd"
    display = Display(office_cloud, sink=Sink(file=path), strict=True)
    display.link(connected=True, text="ws://127.0.0.1:9090", stamp=0)
    play(moments, display)
    display.close()
    assert not display.failures
    return path


@pytest.fixture
def cloud() -> Cloud:
    """A floor of 4 by 4 m and a ceiling."""
    grid = np.stack(np.meshgrid(np.arange(0, 4, 0.1), np.arange(0, 4, 0.1)), axis=-1).reshape(-1, 2)
    floor = np.column_stack([grid, np.zeros(len(grid))])
    points = np.concatenate([floor, floor + (0.0, 0.0, 2.5)])
    normals = np.repeat([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], len(grid), axis=0)
    return Cloud(points, normals, name="plain", sha256="a" * 64)
