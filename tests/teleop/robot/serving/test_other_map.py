"""``farsteer serve --map`` and ``--slip``: another map of the same place, and wheels that spin on request."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud, CloudError
from localization.maps.map_files import save_cloud
from localization.types import SECOND
from robot_sim import SlipFault, World
from teleop.errors import SettingError
from teleop.robot.serving.other_map import load_other_map
from teleop.robot.serving.robot_options import slip_bursts
from teleop.robot.serving.serve_config import ServeConfig


def test_other_map_of_the_place_is_taken_with_its_own_hash(
    office: World, office_cloud: Cloud, tmp_path: Path
) -> None:
    path = tmp_path / "older.ply"
    saved = save_cloud(replace(office_cloud, points=office_cloud.points + 0.01), path)
    assert load_other_map(path, office).sha256 == saved.sha256
    assert saved.sha256 != office_cloud.sha256


def test_map_in_another_frame_or_of_another_place_is_refused(
    office: World, office_cloud: Cloud, tmp_path: Path
) -> None:
    path = tmp_path / "other.ply"
    save_cloud(replace(office_cloud, frame="odom"), path)
    with pytest.raises(CloudError, match=r"is in frame 'odom'; the robot's is 'map'"):
        load_other_map(path, office)
    save_cloud(replace(office_cloud, points=office_cloud.points + np.array([80.0, 0, 0])), path)
    with pytest.raises(CloudError, match="is not a map of office: the robot starts at x"):
        load_other_map(path, office)


def test_map_that_operators_could_not_load_is_refused(office: World) -> None:
    with pytest.raises(CloudError, match=r"map must be a cloud .* got 'map\.yaml'"):
        load_other_map(Path("map.yaml"), office)


def test_wheels_spin_at_the_times_of_the_setting() -> None:
    with pytest.raises(SettingError, match="slip must hold times >= 0 s"):
        ServeConfig(slip=(-1.0,))
    assert slip_bursts((2.5,)) == (SlipFault(2 * SECOND + SECOND // 2, SECOND, 2.0),)
