from __future__ import annotations

import numpy as np
import pytest

from localization.config import LocalizerConfig
from localization.filter.ekf import initial_state
from localization.monitoring.slip_detection import SlipDetector
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.types import SECOND, Pose

COVARIANCE = np.diag(np.square([0.0057, 0.0049, 0.002]))
"""What KISS-ICP's motion of one sweep is worth in an office: x, y [m], yaw [rad]."""


@pytest.mark.parametrize(
    ("before", "rolled", "seen", "slip"),
    [
        (0.016, 0.021, 0.041, False),  # pulls away, and KISS-ICP lets go of where it stood
        (-0.016, -0.021, -0.041, False),
        (0.021, 0.041, 0.021, True),  # the wheels spin up and the robot stays behind
        (0.021, 0.021, 0.041, True),  # it outruns wheels that turn evenly: they hold it back
        (0.041, 0.021, 0.041, True),  # they brake and it slides on
        (0.050, 0.050, 0.051, False),
    ],
)
def test_no_tyre_lets_a_robot_outrun_wheels_that_speed_up(
    before: float, rolled: float, seen: float, slip: bool
) -> None:
    config = LocalizerConfig()
    detector = SlipDetector(config)
    for distance, observed in ((before, before), (rolled, seen)):
        detector = detector.restarted().rolled_on(distance)
        detector = detector.observed(Pose.planar(observed, 0.0, 0.0), 0.1)
        assert detector.complete
    assert detector.contradicted(COVARIANCE, initial_state(config.ekf)) is slip


@pytest.mark.parametrize(
    ("doubted", "seen", "plausible"),
    [
        (False, 0.06, False),  # wheels that stand: people who walk past make KISS-ICP follow them
        (True, 0.06, True),  # encoders that read nothing since a moment ago: it drives on
        (True, 0.10, False),  # nothing has made it faster
        (True, -0.04, False),
    ],
)
def test_robot_may_go_on_at_the_speed_of_wheels_that_have_come_in_doubt(
    doubted: bool, seen: float, plausible: bool
) -> None:
    detector = SlipDetector(LocalizerConfig()).rolled_on(0.06)
    detector = detector.observed(Pose.planar(0.06, 0.0, 0.0), 0.1).restarted()
    if doubted:
        detector = detector.distrusted(0)
    for _ in range(3):
        detector = detector.restarted().observed(Pose.planar(seen, 0.0, 0.0), 0.1)
        assert detector.plausible(1) is plausible
        if doubted:
            detector = detector.distrusted(1)


def test_robot_that_speeds_up_while_its_wheels_are_in_doubt_is_followed_as_the_map_shows() -> None:
    """And KISS-ICP alone, which begins from its own speed then, cannot run away."""
    detector = SlipDetector(LocalizerConfig()).distrusted(0)
    alone = detector
    for speed in (0.2, 0.4, 0.6):
        way = Pose.planar(speed / 10, 0.0, 0.0)
        detector = detector.restarted().observed(way, 0.1)
        assert detector.plausible(1)
        detector = detector.shown_by_map(speed / 10, 0.1, 0.02, 1).distrusted(1)
        alone = alone.restarted().observed(way, 0.1).distrusted(1)
    assert not alone.plausible(1)
    trusted = SlipDetector(LocalizerConfig()).shown_by_map(0.06, 0.1, 0.02, 1)
    assert not trusted.observed(Pose.planar(0.06, 0.0, 0.0), 0.1).plausible(1)


@pytest.mark.parametrize(
    ("rolling", "still"),
    [
        (0.0, True),  # encoders that read nothing
        (0.55, False),  # the wheels grip again
        (1.2, True),  # they still spin
    ],
)
def test_wheels_are_distrusted_for_as_long_as_the_map_contradicts_them(
    rolling: float, still: bool
) -> None:
    config = LocalizerConfig()
    detector, memory = SlipDetector(config).distrusted(0), config.slip_memory
    # Wheels that spin up as fast as this are a sign of slip themselves: here they did so before.
    detector = detector.wheels_read(rolling, 1.0, 1)
    for now in range(0, 4 * memory, memory // 5):
        detector = detector.shown_by_map(0.06, 0.1, 0.02, now)
    assert detector.slipping(4 * memory) is still
    assert not detector.slipping(6 * memory)


@pytest.mark.parametrize(("stalled", "slips"), [(2, False), (5, True)])
def test_displacements_that_stall_and_catch_up_are_no_slip(stalled: int, slips: bool) -> None:
    config = LocalizerConfig.of(SensorConfiguration(Motion.ODOMETRY))
    detector, step = SlipDetector(config), config.slip_memory // 4
    for k in range(1, stalled + 1):
        detector = detector.distrusted(k * step)
    now = stalled * step
    assert detector.slipping(now)
    assert detector.shows(now) is slips
    assert not detector.shows(now + config.slip_memory)


def test_map_that_shows_centimetres_to_and_fro_does_not_contradict_the_wheels() -> None:
    config = LocalizerConfig()
    detector = SlipDetector(config).wheels_read(0.6, 1.0, 0).distrusted(0)
    for k in range(6):
        now = k * config.slip_memory // 5
        detector = detector.shown_by_map(0.06 + (-1) ** k * 0.04, 0.1, 0.02, now)
    assert not detector.slipping(config.slip_memory)


def test_wheels_that_have_not_come_in_doubt_stay_trusted_whatever_the_map_shows() -> None:
    assert not SlipDetector(LocalizerConfig()).shown_by_map(0.06, 0.1, 0.02, 1).slipping(1)


def test_speed_to_go_on_with_is_that_of_trusted_wheels_where_kiss_icp_sees_nothing() -> None:
    """Not the one that KISS-ICP saw seconds ago, while one of the scanners was still alive."""
    detector = SlipDetector(LocalizerConfig())
    detector = (
        detector.observed(Pose.planar(0.06, 0.0, 0.0), 0.1).confirmed(COVARIANCE, 1).restarted()
    )
    assert detector.speed == pytest.approx(0.6)
    for _ in range(3):
        detector = detector.rolled_on(0.02).unobserved(0.1, 1)
    assert detector.speed == pytest.approx(0.2)
    slipping = detector.distrusted(2).rolled_on(0.12).unobserved(0.1, 3)
    assert slipping.speed == pytest.approx(0.2)
    assert slipping.shown_by_map(0.01, 0.1, 0.02, 4).unobserved(0.1, 5).speed == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("after", "later", "slip"), [(0.7, 1, False), (0.0, 1, True), (0.7, 9, True)]
)
def test_wheels_that_come_back_from_slip_to_the_speed_of_before_are_trusted(
    after: float, later: int, slip: bool
) -> None:
    """They had been trusted again for a while, as nothing between walls contradicts them."""
    config = LocalizerConfig()
    step, memory = SECOND // 50, config.slip_memory
    detector = SlipDetector(config).wheels_read(0.7, 1.0, 0)
    detector = detector.rolled_on(0.07).unobserved(0.1, step)
    detector = detector.wheels_read(1.4, 0.02, 2 * step)
    assert detector.slipping(2 * step)
    end = 2 * step + later * memory + memory // 4
    detector = detector.wheels_read(1.4, 0.02, end)
    assert not detector.slipping(end)
    assert detector.wheels_read(after, 0.02, end + step).slipping(end + step) is slip


@pytest.mark.parametrize(
    ("push", "after", "slip"),
    [
        (0.0, 0.4, True),  # nothing pushes the robot to the speed of its wheels
        (0.0, 1.5, True),
        (0.0, 5.0, False),  # by then a speed that was only felt is worth nothing
        (0.5, 1.8, False),  # the wheels grip, and the robot speeds up to theirs
    ],
)
def test_wheels_that_spin_up_are_distrusted_until_the_robot_is_felt_to_be_as_fast(
    push: float, after: float, slip: bool
) -> None:
    tick, now = 0.02, 1
    detector = SlipDetector(LocalizerConfig()).wheels_read(0.6, 1.0, now)
    detector = detector.rolled_on(0.06).unobserved(0.1, now)
    for i in range(round(after / tick)):
        now += SECOND // 50
        detector = detector.wheels_read(1.2, tick, now)
        detector = detector.felt(push if i * tick < 1.2 else 0.0, 0.05, tick, now)
    assert detector.slipping(now) is slip


def test_kiss_icp_that_sees_nothing_along_a_corridor_confirms_no_speed() -> None:
    config = LocalizerConfig()
    for along, speed in ((0.005, 0.3), (3.0, 0.6)):
        detector = SlipDetector(config).wheels_read(0.6, 1.0, 1).wheels_read(1.2, 0.02, 2)
        detector = detector.rolled_on(0.12).observed(Pose.planar(0.03, 0.0, 0.0), 0.1)
        covariance = np.diag(np.square([along, 0.005, 0.002]))
        assert detector.confirmed(covariance, 3).speed == pytest.approx(speed, abs=0.15)


def test_sweep_that_fits_elsewhere_makes_no_robot_faster_than_its_wheels() -> None:
    """Dead reckoning goes on with that speed, and must not jump."""
    config = LocalizerConfig()
    detector = SlipDetector(config).wheels_read(0.6, 1.0, 0).distrusted(0)
    detector = detector.shown_by_map(0.4, 0.1, 0.5, 1).unobserved(0.1, 2)
    assert detector.speed == pytest.approx(0.6 + config.overspeed_margin)
    back = SlipDetector(config).wheels_read(0.6, 1.0, 0).distrusted(0)
    assert back.shown_by_map(-0.4, 0.1, 0.5, 1).unobserved(0.1, 2).speed == pytest.approx(-0.3)
