from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from localization.config import LocalizerConfig
from localization.errors import LocalizationError
from localization.filter.ekf import initial_state
from localization.filter.ekf_config import EkfConfig
from localization.monitoring.wheel_modes import WheelConfig, WheelModes
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import Pose

COVARIANCE = np.diag(np.square([0.0057, 0.0049, 0.002]))
"""What KISS-ICP's motion of one sweep is worth in an office: x, y [m], yaw [rad]."""
CONFIG = LocalizerConfig()
MOVING = initial_state(CONFIG.ekf)
NEW = WheelModes.rolling_on(CONFIG.wheels, CONFIG.sensors, CONFIG.ekf)
TICK = 0.02


def driven(speed: float, seconds: float = 1.0, modes: WheelModes | None = None) -> WheelModes:
    """Modes of wheels that have rolled at a speed [m/s] while nothing was felt."""
    modes = modes or NEW
    for _ in range(round(seconds / TICK)):
        modes = modes.after(TICK, 0.0, 0.05).wheels_read(speed, TICK)
    return modes


def seen(modes: WheelModes, rolled: float, way: float) -> tuple[WheelModes, bool]:
    """Modes after a tenth of a second in which the wheels rolled, and KISS-ICP saw, a way [m]."""
    observed = (Pose.planar(way, 0.0, 0.0), COVARIANCE)
    return modes.after_sweep().rolled_on(rolled).compared(observed, 0.1, MOVING)


@pytest.mark.parametrize(
    ("rolled", "way", "sweeps"),
    [
        (0.041, 0.005, 1),  # the wheels spin up and the robot stays behind
        (0.021, 0.060, 1),  # they lock and it slides on
        (0.021, 0.041, 2),  # it outruns wheels that turn evenly: they hold it back
        (0.050, 0.051, 99),
    ],
)
def test_kiss_icp_finds_slip_the_sooner_the_less_rolling_wheels_explain_what_it_sees(
    rolled: float, way: float, sweeps: int
) -> None:
    modes, found = NEW, 99
    for number in range(1, 10):
        modes, misled = seen(modes, rolled, way)
        assert misled is modes.slipping
        if modes.slipping:
            found = number
            break
    assert found == sweeps


def test_robot_that_kiss_icp_holds_back_as_it_sets_off_does_not_slip() -> None:
    """Its local map has one view of the place where a robot stood, and lets go a moment later."""
    modes = driven(0.16)
    for rolled, way in ((0.016, 0.016), (0.021, 0.041), (0.026, 0.026)):
        modes, misled = seen(modes, rolled, way)
        assert not misled


@pytest.mark.parametrize(
    ("rolled", "way", "plausible"),
    [
        (0.0, 0.0, True),
        (0.0, 0.10, False),  # wheels that stand: people who walk past make KISS-ICP follow them
        (0.12, 0.09, True),  # wheels that spin pull the robot to their speed
        (0.0, 0.05, True),  # encoders that read nothing since a moment ago: it drives on
        (0.06, -0.05, False),
    ],
)
def test_robot_moves_at_a_speed_between_none_its_wheels_and_its_own(
    rolled: float, way: float, plausible: bool
) -> None:
    modes = driven(0.6 if rolled or way == 0.05 else 0.0).rolled_on(rolled)
    assert modes.plausible((Pose.planar(way, 0.0, 0.0), COVARIANCE), 0.1) is plausible


def test_slip_that_nothing_shows_any_more_ends_and_half_of_it_in_half_a_second() -> None:
    slips, usual = NEW.contradicted(), NEW.odds
    assert slips.after(0.4).slipping
    assert not slips.after(0.6).slipping
    assert slips.after(60.0).odds == pytest.approx(usual)
    assert slips.after(0.1).after(0.2).odds == pytest.approx(slips.after(0.3).odds)


@pytest.mark.parametrize(("stalled", "slips"), [(2, False), (7, True)])
def test_displacements_that_stall_and_catch_up_are_no_slip(stalled: int, slips: bool) -> None:
    sensors = SensorConfiguration(Motion.ODOMETRY)
    modes = WheelModes.rolling_on(CONFIG.wheels, sensors, EkfConfig.of(sensors))
    for _ in range(stalled):
        modes = modes.contradicted().after(0.15)
    assert modes.slipping
    assert modes.shows is slips
    assert not modes.after(1.0).shows


@pytest.mark.parametrize(
    ("push", "after", "slip"),
    [
        (0.0, 0.4, True),  # nothing pushes the robot to the speed of its wheels
        (0.0, 1.5, True),
        (0.0, 9.0, False),  # by then a speed that was only felt is worth nothing
        (0.5, 2.2, False),  # the wheels grip, and the robot speeds up to theirs
    ],
)
def test_wheels_that_spin_up_slip_until_the_robot_is_felt_to_be_as_fast(
    push: float, after: float, slip: bool
) -> None:
    modes = driven(0.6)
    for i in range(round(after / TICK)):
        modes = modes.after(TICK, push if i * TICK < 1.2 else 0.0, 0.05).wheels_read(1.2, TICK)
        if i == 4:
            assert modes.slipping
    assert modes.slipping is slip
    if not slip:
        assert modes.speed == pytest.approx(1.2, abs=0.1)


def test_wheels_that_speed_up_as_is_felt_do_not_slip() -> None:
    modes, speed = driven(0.0), 0.0
    for _ in range(50):
        speed += 2.0 * TICK
        modes = modes.after(TICK, 2.0, 0.05).wheels_read(speed, TICK)
        assert not modes.slipping
    assert modes.speed == pytest.approx(2.0, abs=0.05)


def test_kiss_icp_that_sees_nothing_along_a_corridor_measures_no_speed() -> None:
    for along, speed in ((0.005, 0.3), (3.0, 0.6)):
        modes = driven(0.6).wheels_read(1.2, TICK)._replace(sigma=0.2)
        observed = (Pose.planar(0.03, 0.0, 0.0), np.diag(np.square([along, 0.005, 0.002])))
        modes, _ = modes.rolled_on(0.12).compared(observed, 0.1, MOVING)
        assert modes.speed == pytest.approx(speed, abs=0.1)


def test_speed_without_wheels_is_that_which_was_measured_and_what_is_felt_since_then() -> None:
    modes = driven(0.6)
    for _ in range(50):
        modes = modes.after(TICK, -0.3, 0.05)
    assert modes.speed == pytest.approx(0.3, abs=0.01)
    assert 0.05 < modes.sigma < 0.15


def test_speed_that_is_neither_felt_nor_measured_is_soon_unknown() -> None:
    assert driven(0.6).after(0.02).sigma < 0.2
    assert driven(0.6).after(2.0).sigma == 1.0


def test_map_shows_the_speed_of_a_robot_whose_wheels_slip_and_of_no_other() -> None:
    rolls = driven(0.6)
    assert rolls.shown_by_map(0.02, 0.1, 0.01) == rolls
    slips = rolls.contradicted()._replace(sigma=0.3)
    for _ in range(20):
        slips = slips.contradicted().shown_by_map(0.02, 0.1, 0.01)
    assert slips.speed == pytest.approx(0.2, abs=0.05)


def test_sweep_that_fits_elsewhere_makes_no_robot_faster() -> None:
    """Dead reckoning goes on with that speed, and must not jump."""
    slips = driven(0.6).contradicted()
    assert slips.shown_by_map(0.4, 0.1, 0.02) == slips
    assert slips.shown_by_map(0.4, 0.1, 0.5).speed == pytest.approx(0.6, abs=0.05)


def test_wheels_that_agree_with_the_map_grip_again() -> None:
    slips = driven(0.6).contradicted()
    assert slips.shown_by_map(0.06, 0.1, 0.01).odds < slips.odds
    spins = slips.wheels_read(1.2, TICK)
    assert spins.shown_by_map(0.06, 0.1, 0.01).odds > spins.odds


def test_no_evidence_makes_slip_rarer_than_it_usually_is() -> None:
    usual = math.log(CONFIG.wheels.rates[0] / CONFIG.wheels.rates[1])
    assert driven(0.6, seconds=60.0).odds == pytest.approx(usual)


@pytest.mark.parametrize("wrong", [{"rates": (0.0, 1.4)}, {"rates": (0.014, 0.0)}, {"noise": 0.0}])
def test_rates_and_noise_of_nothing_are_refused_by_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(LocalizationError, match=r"wheels\.rates and wheels\.noise must be above 0"):
        WheelConfig(**wrong)
