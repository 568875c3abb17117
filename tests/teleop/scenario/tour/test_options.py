"""Options of a tour: what they refuse, how wrong the hints are, and what scenario they make."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.geometry import wrap_angle
from localization.types import SECOND, Pose
from robot_sim import World
from teleop.errors import SettingError
from teleop.scenario.files.errors import ScenarioError
from teleop.scenario.files.operator_settings import Station
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.scenario import Mission
from teleop.scenario.files.shipped import shipped_files
from teleop.scenario.session.places import goal_points
from teleop.scenario.session.run import run_scenario
from teleop.scenario.session.scene import simulation_config
from teleop.scenario.session.station import station_hint
from teleop.scenario.sweeps.swept_fields import with_values
from teleop.scenario.tour.options import TourOptions, least_distance, tour_scenario


@given(st.integers(0, 10_000), st.floats(0.0, 3.0), st.floats(0.0, 90.0))
def test_hint_is_as_wrong_as_the_station_is_to_make_it(
    seed: int, metres: float, degrees: float
) -> None:
    true = Pose.planar(3.0, -2.0, 2.5)
    hint = station_hint(Station("station", off=metres, turned=degrees), seed, true)
    off = hint.map_from_base.position - true.position
    assert np.hypot(off[0], off[1]) == pytest.approx(metres, abs=1e-9)
    turn = abs(wrap_angle(hint.map_from_base.yaw - true.yaw))
    assert np.rad2deg(turn) == pytest.approx(degrees, abs=1e-6)


def test_seed_decides_the_hint() -> None:
    true = Pose.planar(0.0, 0.0, 0.0)
    first, again, other = (
        station_hint(Station("station"), s, true).map_from_base.position.tolist() for s in (1, 1, 2)
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
        ("slip", (-1.0,)),
    ],
)
def test_option_that_is_refused_is_named(field: str, value: object) -> None:
    with pytest.raises(SettingError, match=field):
        TourOptions(**{field: value})  # type: ignore[arg-type]


def test_what_no_scenario_can_say_is_refused_by_its_field() -> None:
    with pytest.raises(SettingError, match=r"mission\.time_limit"):
        tour_scenario(TourOptions(duration=1e6))


def test_no_options_make_the_shipped_scenario() -> None:
    scenario, _ = tour_scenario(TourOptions())
    assert scenario == read_scenario(shipped_files()["tour"])


def test_every_option_reaches_the_scenario() -> None:
    options = TourOptions(
        scene="corridor",
        seed=7,
        pose_error=2.0,
        heading_error=30.0,
        hint_sigma=0.7,
        hint_sigma_heading=12.0,
        slip=(12.5, 500.0),
        duration=20.0,
    )
    scenario, world = tour_scenario(options)
    assert (scenario.world.scene, world.name, scenario.seed) == ("corridor", "corridor", 7)
    assert scenario.operator == Station(
        "station", off=2.0, turned=30.0, sigma=0.7, sigma_heading=12.0
    )
    assert scenario.mission.time_limit == 20.0
    # A drive that is cut short need not reach anything.
    assert (scenario.limits.goals, scenario.limits.distance) == (False, None)
    (slip,) = simulation_config(scenario).drive.slips
    assert (slip.start_ns, slip.duration_ns, slip.factor) == (12_500_000_001, SECOND, 2.0)


def test_short_tour_has_a_shorter_least_distance() -> None:
    (corridor, long), (office, _) = (
        tour_scenario(TourOptions(scene=name)) for name in ("corridor", "office")
    )
    assert (corridor.limits.distance, office.limits.distance) == (80.0, 80.0)
    assert least_distance(long, 151.0) == pytest.approx(0.8 * 152.0, rel=1e-3)


def test_goals_of_a_tour_are_its_way_points_and_the_last_is_stayed_at(office: World) -> None:
    scenario, _ = tour_scenario(TourOptions())
    goals = goal_points(office, scenario)
    assert [(goal.x, goal.y) for goal in goals] == list(office.tour)
    assert {goal.within for goal in goals[:-1]} == {1.0}
    assert (goals[-1].within, goals[-1].stay) == (0.5, 2 * SECOND)


def test_station_is_refused_what_it_cannot_do(tmp_path: Path) -> None:
    scenario, _ = tour_scenario(TourOptions(duration=1.0))
    with pytest.raises(SettingError, match="a station steps the robot, in lockstep"):
        run_scenario(scenario, tmp_path, pace="real")
    with pytest.raises(SettingError, match="a station needs none"):
        run_scenario(scenario, tmp_path, tokens=tmp_path / "tokens.toml")
    with pytest.raises(ScenarioError, match="a station drives tours"):
        run_scenario(replace(scenario, mission=Mission(time_limit=1.0)), tmp_path)
    with pytest.raises(SettingError, match="a sweep needs an operator of the library"):
        with_values(scenario, {"world.sun": 0.5})
    assert list(tmp_path.iterdir()) == []
