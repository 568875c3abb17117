"""Whole drives through the office, in lockstep: what the project promises, on real parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from teleop.scenario.files.faults import WheelSlip
from teleop.scenario.tour.drive import DrivenTour, drive_tour
from teleop.scenario.tour.options import TourOptions, tour_scenario
from tests.teleop.scenario.tour.support import in_memory

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def drive(options: TourOptions, folder: Path) -> DrivenTour:
    return drive_tour(in_memory(options), folder, picture=False)


@pytest.mark.long
def test_slipping_wheels_do_not_carry_the_estimate_away(tmp_path: Path) -> None:
    # What a slip did to the estimate shows at once; ten seconds after the last the drive may end.
    options = TourOptions(seed=3, slip=(20.0, 31.03), duration=42.0)
    summary = drive(options, tmp_path).summary
    assert summary.ate is not None
    assert summary.ate.position.max <= 0.10
    assert summary.health["slipping"] > 0.0
    assert summary.passed, summary.checks


@pytest.mark.long
def test_slip_is_noticed_even_when_it_sets_in_too_gently_for_the_tyre_test(tmp_path: Path) -> None:
    """Wheels 30 % too fast gain no impossible speed; KISS-ICP has to contradict them."""
    slip = WheelSlip("wheel_slip", 20.0, 2.0, 1.3)
    scenario = replace(in_memory(TourOptions(seed=3, duration=30.0)), fault=(slip,))
    driven = drive_tour(scenario, tmp_path, picture=False)
    lines = driven.outcome.lines
    slipping = lines.stamps[np.array(lines.health) == "slipping"] / 1e9
    assert len(slipping)
    assert 20.0 <= slipping[0] <= 20.6
    assert driven.summary.ate is not None
    assert driven.summary.ate.position.max <= 0.05


@pytest.mark.process
def test_hint_that_is_far_off_is_not_followed_and_the_robot_finds_itself(tmp_path: Path) -> None:
    """A hint twelve metres off, claimed to be good to a decimetre, leads nowhere."""
    options = TourOptions(
        seed=1, pose_error=12.0, hint_sigma=0.1, hint_sigma_heading=3.0, duration=4.0
    )
    scenario, _ = tour_scenario(options)
    driven = drive_tour(scenario, tmp_path, picture=False)
    (verdict,) = driven.summary.facts.verdicts
    assert verdict.split()[0] == "rejected"
    error = driven.outcome.lines.error
    assert np.isnan(error[0])
    assert np.nanmax(error) < 0.05
    assert error[-1] < 0.05
