"""Figures of time lines made by hand, and each limit kept and missed."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from localization.types import Health, Pose
from teleop.scenario.files.limits import Limits
from teleop.scenario.referee.judging import judge
from teleop.scenario.referee.outcome import LimitCheck
from teleop.scenario.referee.referee import Referee
from tests.teleop.scenario.referee.ticks import COVARIANCE, Ticks

KEPT: dict[str, float] = {
    "goals": 2.0,
    "goals_reached": 2.0,
    "goal_time": 20.0,
    "duration": 30.0,
    "contacts": 1.0,
    "tilt": math.radians(5.0),
    "position_max": 0.3,
    "doubted_max": 0.4,
    "position_rmse": 0.1,
    "heading_rmse": math.radians(1.0),
    "heading_max": math.radians(4.0),
    "lost": 2.0,
    "silent_error": 0.5,
    "stops": 1.0,
    "hints": 2.0,
    "stopping_time": 0.9,
    "runaway": 0.6,
    "violations": 0.0,
    "nees": 6.0,
    "distance": 12.0,
    "picked": 3.0,
    "placed": 2.0,
    "dropped": 1.0,
    "arm_contacts": 1.0,
    "load": 0.5,
    "load_max": 0.9,
    "slip": 0.01,
    "tip_moved": 0.002,
    "tip_off": 0.004,
    "pointing_off": math.radians(5.0),
    "mirror_error": math.radians(1.0),
    "wheels_off": 0.3,
    "rules": 0.0,
}
"""Figures that keep ``LIMITS``."""

ANGLES = {"tilt", "heading_rmse", "heading_max", "pointing_off", "mirror_error"}
"""Figures in [rad], whose limits are in [deg]."""

FIGURE = {"goals": "goals_reached", "duration": "goal_time"}
"""Figure of a limit, where it is named otherwise."""

NAMES = [field.name for field in fields(Limits) if field.name != "grace"]


def _just_kept(name: str) -> Any:
    """Return a limit that is just kept."""
    value = KEPT[FIGURE.get(name, name)]
    if name in ANGLES:
        return math.degrees(value) + 1e-9
    return {"goals": True, "rules": True, "nees": (value, value)}.get(name, value)


LIMITS = Limits(**{name: _just_kept(name) for name in NAMES})

MISSES = {
    name: math.radians(math.degrees(value) + 1e-3) if name in ANGLES else math.nextafter(value, 1e9)
    for name, value in KEPT.items()
} | {"goals": 3.0, "distance": math.nextafter(12.0, 0.0), "picked": 2.0, "placed": 1.0}
"""Of each figure a value that just misses."""


def missed(figures: dict[str, float], limits: Limits = LIMITS) -> list[str]:
    return [check.name for check in judge(limits, figures) if not check.met]


def test_every_limit_is_judged_and_kept_by_a_value_that_equals_it() -> None:
    checks = judge(LIMITS, KEPT)
    assert sorted(check.name for check in checks) == sorted(NAMES)
    assert all(check.met for check in checks)


@pytest.mark.parametrize("name", NAMES)
def test_limit_is_missed_by_the_next_value_and_no_other_limit_with_it(name: str) -> None:
    figure = "goals" if name == "goals" else FIGURE.get(name, name)
    assert missed({**KEPT, figure: MISSES[figure]}) == [name]


@pytest.mark.parametrize("name", NAMES)
def test_figure_that_could_not_be_measured_misses_its_limit(name: str) -> None:
    assert missed({**KEPT, FIGURE.get(name, name): math.nan}) == [name]


def test_only_goals_and_violations_are_judged_unless_a_limit_is_given() -> None:
    checks = judge(Limits(), {**KEPT, "goals_reached": 1.0, "violations": 4.0})
    assert [(check.name, check.met) for check in checks] == [
        ("goals", False),
        ("violations", False),
    ]


def test_goals_need_not_be_reached_if_the_scenario_says_so() -> None:
    assert missed({**KEPT, "goals_reached": 0.0}, Limits(goals=False)) == []


def test_limit_of_zero_is_a_limit() -> None:
    zero: Any = {"contacts": 0, "lost": 0.0, "stops": 0, "hints": 0, "runaway": 0.0}
    assert missed(KEPT, Limits(**zero)) == ["contacts", "lost", "stops", "hints", "runaway"]


def test_nees_has_two_bounds() -> None:
    limits = Limits(nees=(3.0, 9.0))
    assert missed({**KEPT, "nees": 2.9}, limits) == ["nees"]
    assert missed({**KEPT, "nees": 9.1}, limits) == ["nees"]
    assert missed({**KEPT, "nees": 3.0}, limits) == []


def test_check_says_value_and_limit_in_the_units_of_files() -> None:
    (goals, tilt, violations) = judge(Limits(tilt=4.0), KEPT)
    assert (tilt.text, tilt.limit, tilt.unit, tilt.met) == ("largest tilt", "<= 4", "deg", False)
    assert tilt.value == pytest.approx(5.0)
    assert goals == LimitCheck("goals", "goals reached", 2.0, "= 2", "", True)
    assert violations.limit == "<= 0"


# Figures


def figures_of(*places: float, **options: Any) -> dict[str, float]:
    """Return the figures of a robot at these x [m], one a tick."""
    referee, ticks = Referee((), Limits()), Ticks()
    for x in places:
        referee.take(ticks.tick(x, **options))
    return referee.judged()[1]


def test_distance_is_the_way_driven_and_not_the_distance_from_the_start() -> None:
    assert figures_of(0.0, 0.01, 0.02, 0.01, 0.0)["distance"] == pytest.approx(0.04)


def test_kidnap_is_no_distance_driven() -> None:
    assert figures_of(0.0, 0.01, 40.0, 40.01)["distance"] == pytest.approx(0.02)


def test_errors_of_the_position_are_those_while_the_robot_claims_to_know_it() -> None:
    referee, ticks = Referee((), Limits()), Ticks()
    for error, health in (
        (0.3, Health.TRACKING),
        (0.4, Health.DEGRADED),
        (0.0, Health.SLIPPING),
        (3.0, Health.SUSPECT),
        (9.0, Health.LOST),
        (9.0, Health.RELOCALISING),
    ):
        referee.take(ticks.tick(guess=(0.0, error, 0.0), health=health))
    figures = referee.judged()[1]
    assert figures["position_max"] == pytest.approx(0.4)
    assert figures["doubted_max"] == pytest.approx(3.0)
    assert figures["position_rmse"] == pytest.approx(math.sqrt((0.09 + 0.16) / 3.0))
    assert figures["position_p95"] == pytest.approx(np.percentile([0.3, 0.4, 0.0], 95))


def test_error_of_the_heading_is_the_root_of_the_mean_square_and_its_largest_size() -> None:
    referee, ticks = Referee((), Limits()), Ticks()
    for turned in (0.03, -0.04, 2.0 * math.pi):
        referee.take(ticks.tick(guess=(0.0, 0.0, turned)))
    figures = referee.judged()[1]
    assert figures["heading_rmse"] == pytest.approx(math.sqrt(0.0025 / 3.0))
    assert figures["heading_max"] == pytest.approx(0.04)


def carried(
    grace: float, doubts_after: int = 1000, *, turned: float = 0.0, away: float = 9.0
) -> dict[str, float]:
    """Return the figures of a robot that was carried off after a second and believes to stand where it was."""
    referee, ticks = Referee((), Limits(grace=grace)), Ticks()
    for number in range(200):
        gone = number >= 50
        doubts = 50 + doubts_after <= number < 50 + doubts_after + 5
        referee.take(
            ticks.tick(
                away * gone,
                heading=turned * gone,
                guess=(0.02, 0.0, 0.0),
                health=Health.SUSPECT if doubts else Health.TRACKING,
            )
        )
    return referee.judged()[1]


def test_errors_count_only_after_the_grace_that_follows_a_kidnap() -> None:
    within, beyond = carried(3.0), carried(2.98)
    assert within["position_max"] == pytest.approx(0.02)
    assert beyond["position_max"] == pytest.approx(8.98)
    assert within["nees"] < 1.0 < beyond["nees"]
    assert carried(0.0)["position_rmse"] > beyond["position_rmse"] > within["position_rmse"]


def test_grace_ends_when_the_robot_doubts_its_place() -> None:
    assert carried(3.0, doubts_after=20)["position_max"] == pytest.approx(8.98)


def test_grace_spares_no_robot_that_nobody_has_carried() -> None:
    referee, ticks = Referee((), Limits(grace=60.0)), Ticks()
    for number in range(50):
        referee.take(ticks.tick(0.04 * number, guess=(0.0, 0.0, 0.0)))
    assert referee.judged()[1]["position_max"] == pytest.approx(0.04 * 49)


def test_robot_that_is_turned_where_it_stands_has_its_grace_too() -> None:
    assert carried(3.0, turned=1.0, away=0.0)["heading_max"] == 0.0
    assert carried(1.0, turned=1.0, away=0.0)["heading_max"] == pytest.approx(1.0)


def test_grace_shortens_no_time_that_the_robot_is_wrong_and_says_nothing() -> None:
    assert carried(3.0)["silent_error"] == pytest.approx(3.0)


def test_error_of_height_does_not_count_as_one_of_the_position() -> None:
    guess = Pose(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    assert figures_of(0.0, guess=guess)["position_max"] == 0.0


def test_error_of_the_heading_is_the_short_way_round() -> None:
    figures = figures_of(0.0, heading=math.radians(179.0), guess=(0.0, 0.0, math.radians(-179.0)))
    assert figures["heading_max"] == pytest.approx(math.radians(2.0))


@pytest.mark.parametrize("health", [Health.WAITING, Health.LOST, Health.RELOCALISING])
def test_time_without_a_place_is_lost(health: Health) -> None:
    known = health is not Health.WAITING
    assert figures_of(0.0, 0.0, 0.0, health=health, known=known)["lost"] == pytest.approx(0.06)


@pytest.mark.parametrize(
    "health", [Health.TRACKING, Health.DEGRADED, Health.SLIPPING, Health.SUSPECT]
)
def test_time_with_a_place_is_not_lost(health: Health) -> None:
    assert figures_of(0.0, 0.0, health=health)["lost"] == 0.0


def test_silent_error_is_the_time_with_half_a_metre_while_localised() -> None:
    referee, ticks = Referee((), Limits()), Ticks()
    for error, health in (
        (0.5, Health.TRACKING),
        (0.501, Health.TRACKING),
        (0.501, Health.SLIPPING),
        (0.501, Health.SUSPECT),
        (0.501, Health.LOST),
    ):
        referee.take(ticks.tick(guess=(error, 0.0, 0.0), health=health))
    assert referee.judged()[1]["silent_error"] == pytest.approx(0.04)


def test_figures_of_an_estimate_that_never_was_are_not_measured() -> None:
    figures = figures_of(0.0, 0.0, known=False, health=Health.WAITING)
    for name in ("position_max", "position_rmse", "position_p95", "heading_max", "nees"):
        assert math.isnan(figures[name])
    assert figures["silent_error"] == 0.0


def test_nees_weighs_each_error_by_its_variance() -> None:
    # 0.2 m at a standard deviation of 0.1 m, and 0.03 rad at one of 0.01 rad: 4 + 9.
    assert figures_of(0.0, guess=(0.2, 0.0, 0.03))["nees"] == pytest.approx(13.0)


def test_covariance_of_nothing_costs_the_figure_and_not_the_run() -> None:
    referee, ticks = Referee((), Limits(nees=(0.0, 1e9))), Ticks()
    referee.take(ticks.tick(covariance=np.zeros((6, 6))))
    referee.take(ticks.tick(covariance=COVARIANCE))
    lines, figures, checks = referee.judged()
    assert np.isnan(lines.nees).tolist() == [True, False]
    assert math.isnan(figures["nees"])
    assert not next(check.met for check in checks if check.name == "nees")


def test_largest_tilt_is_the_figure() -> None:
    referee, ticks = Referee((), Limits()), Ticks()
    for tilt in (0.0, 0.4, -0.2):
        referee.take(ticks.tick(tilt=tilt))
    assert referee.judged()[1]["tilt"] == pytest.approx(0.4)


def test_sigma_is_the_longer_axis_of_the_positions_ellipse() -> None:
    covariance = COVARIANCE.copy()
    covariance[:2, :2] = [[0.05, 0.04], [0.04, 0.05]]
    referee = Referee((), Limits())
    referee.take(Ticks().tick(covariance=covariance))
    assert referee.judged()[0].sigma[0] == pytest.approx(0.3)


def test_replacing_a_limit_by_none_takes_it_out_of_the_judgement() -> None:
    for name in set(NAMES) - {"goals", "violations", "rules"}:
        limits = replace(LIMITS, **{name: None})  # type: ignore[arg-type]
        assert name not in [check.name for check in judge(limits, KEPT)]
