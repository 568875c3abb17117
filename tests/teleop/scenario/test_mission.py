"""Missions: what they refuse, and how wrong their hints are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.geometry import wrap_angle
from localization.types import SECOND, Pose
from teleop.errors import SettingError
from teleop.scenario.mission import Mission, MissionLimits


@given(st.integers(0, 10_000), st.floats(0.0, 3.0), st.floats(0.0, 90.0))
def test_hint_is_as_wrong_as_the_mission_says(seed: int, metres: float, degrees: float) -> None:
    spawn = Pose.planar(3.0, -2.0, 2.5)
    mission = Mission(seed=seed, pose_error=metres, heading_error=degrees)
    hint = mission.hint(spawn)
    off = hint.map_from_base.position - spawn.position
    assert np.hypot(off[0], off[1]) == pytest.approx(metres, abs=1e-9)
    turn = abs(wrap_angle(hint.map_from_base.yaw - spawn.yaw))
    assert np.rad2deg(turn) == pytest.approx(degrees, abs=1e-6)


def test_seed_decides_the_hint() -> None:
    spawn = Pose.planar(0.0, 0.0, 0.0)
    first, again, other = (
        Mission(seed=s).hint(spawn).map_from_base.position.tolist() for s in (1, 1, 2)
    )
    assert first == again != other


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("pose_error", -1.0),
        ("pose_error", float("nan")),
        ("heading_error", float("inf")),
        ("hint_sigma", -0.1),
        ("duration", 0.0),
        ("seed", -1),
    ],
)
def test_mission_names_the_field_it_refuses(field: str, value: float) -> None:
    with pytest.raises(SettingError, match=field):
        Mission(**{field: value})  # type: ignore[arg-type]


def test_slips_last_a_second_at_twice_the_speed() -> None:
    (slip,) = Mission(slip=(12.5,)).slips
    assert (slip.start_ns, slip.duration_ns, slip.factor) == (12_500_000_000, SECOND, 2.0)


def test_short_tour_has_a_shorter_least_distance() -> None:
    limits = MissionLimits(distance=80.0)
    assert limits.for_tour(300.0) == limits
    assert limits.for_tour(87.9) == limits
    assert limits.for_tour(50.0).distance == pytest.approx(40.0)
    assert limits.for_tour(50.0).position_rmse == limits.position_rmse
