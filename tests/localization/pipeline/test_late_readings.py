from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.maps.prepared_map import PreparedMap
from localization.motion.late_readings import LateReadingsConfig
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import (
    SECOND,
    Estimate,
    Hint,
    Inertial,
    Odometry,
    Pose,
    Reading,
    Scan,
    Verdict,
    WheelSpeeds,
    end_of,
)
from tests.localization.pipeline.wheel_log import noting
from tests.support_rooms import HALL, MOUNTS, TICK, Drive, apart

START = Pose.planar(2.6, 1.6, 0.2)
EXACT = LateReadingsConfig(stamp_error=0, reuse_distance=0.0)
"""Stamps are true, and every sweep is registered again."""
SUITES = list(Motion)


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Drive(HALL, START, (0.6, 0.0, 0.0), (1.4, 0.5, 0.4), (0.6, 0.2, -0.6), seed=4)


def in_order(drive: Drive, suite: SensorConfiguration) -> list[Reading]:
    """A drive's readings in the order in which they count, with the hint that places it."""
    readings = [*drive.readings()]
    readings += [
        Odometry(r.stamp, drive.pose(r.stamp)) for r in readings if isinstance(r, Inertial)
    ]

    def key(reading: Reading) -> tuple[int, int]:
        leads = isinstance(reading, suite.leader)
        return end_of(reading), 2 if leads else 0 if isinstance(reading, Scan) else 1

    readings.sort(key=key)
    readings.insert(40, Hint(end_of(readings[39]), START, np.zeros((6, 6))))
    return readings


def delayed(readings: Sequence[Reading], seed: int, most: int) -> list[Reading]:
    """Let all readings but the first and the last second's come up to ``most`` [ns] late."""
    rng = np.random.default_rng(seed)
    last = end_of(readings[-1]) - most
    arrival = [
        end_of(r) + (int(rng.integers(0, most)) if SECOND < end_of(r) < last else 0)
        for r in readings
    ]
    return [readings[i] for i in np.argsort(arrival, kind="stable").tolist()]


def run(
    world: PreparedMap,
    suite: SensorConfiguration,
    late: LateReadingsConfig,
    readings: Sequence[Reading],
) -> Estimate:
    localizer = Localizer(world, MOUNTS, replace(LocalizerConfig.of(suite), late_readings=late))
    for reading in readings:
        estimate = localizer.add(reading)
    assert localizer.refused == 0
    assert estimate.map_from_base is not None
    return estimate


def bits(estimate: Estimate) -> tuple[object, ...]:
    pose, odom = estimate.map_from_base, estimate.odom_from_base
    assert pose is not None
    arrays = (pose.position, pose.quaternion_wxyz, odom.position, estimate.covariance)
    return (*(a.tobytes() for a in arrays), estimate.stamp, estimate.health)


@given(motion=st.sampled_from(SUITES), seed=st.integers(0, 1000), most=st.integers(TICK, SECOND))
@settings(max_examples=6)
@pytest.mark.slow
def test_readings_out_of_order_give_the_bits_of_those_in_order(
    hall: PreparedMap, drive: Drive, motion: Motion, seed: int, most: int
) -> None:
    suite = SensorConfiguration(motion, flat=motion is not Motion.WHEELS_AND_GYRO)
    readings = in_order(drive, suite)
    estimate = run(hall, suite, EXACT, readings)
    assert bits(run(hall, suite, EXACT, delayed(readings, seed, most))) == bits(estimate)


@given(seed=st.integers(0, 1000), most=st.integers(TICK, SECOND))
@settings(max_examples=4)
@pytest.mark.slow
def test_sweeps_that_keep_their_match_make_no_relevant_difference(
    hall: PreparedMap, drive: Drive, seed: int, most: int
) -> None:
    readings = in_order(drive, SensorConfiguration())
    estimate = run(hall, SensorConfiguration(), LateReadingsConfig(), readings).map_from_base
    again = run(
        hall, SensorConfiguration(), LateReadingsConfig(), delayed(readings, seed, most)
    ).map_from_base
    assert estimate is not None
    assert again is not None
    distance, angle = apart(estimate, again)
    assert distance < 0.001
    assert angle < np.deg2rad(0.02)


@pytest.mark.parametrize("motion", SUITES)
def test_taking_readings_again_changes_nothing_that_is_in_order(
    hall: PreparedMap, drive: Drive, motion: Motion
) -> None:
    suite = SensorConfiguration(motion)
    readings = in_order(drive, suite)
    kept = run(hall, suite, LateReadingsConfig(), readings)
    assert bits(kept) == bits(run(hall, suite, LateReadingsConfig(horizon=0), readings))


def test_late_scan_is_registered_once_and_the_others_keep_their_match(
    hall: PreparedMap, drive: Drive
) -> None:
    readings = in_order(drive, SensorConfiguration())
    scans = [r for r in readings if isinstance(r, Scan) and r.scanner == "laser_vertical"]
    late = next(s for s in scans if s.stamp > 1.2 * SECOND)
    calls: list[str] = []
    rest = [r for r in readings if r is not late]
    at = next(i for i, r in enumerate(rest) if end_of(r) > late.end_stamp + SECOND // 2)
    localizer = Localizer(hall, MOUNTS, stage=noting(calls))
    for reading in rest[:at]:
        now = localizer.add(reading).stamp
    calls.clear()
    estimate = localizer.add(late)
    assert calls.count("registration") == calls.count("deskew") == 1
    assert (estimate.stamp, estimate.sweep) == (now, None)
    news = [localizer.add(reading) for reading in rest[at:]]
    advanced = next(e for e in news if e.stamp > now)
    assert advanced.sweep is not None, "it is estimate with the reading that moves time on next"
    ran = run(hall, SensorConfiguration(), LateReadingsConfig(), readings).map_from_base
    ended = news[-1].map_from_base
    assert ran is not None
    assert ended is not None
    assert apart(ran, ended)[0] < 0.001


def test_sweep_of_late_scans_is_reported_where_the_robot_is_by_then(
    hall: PreparedMap, drive: Drive
) -> None:
    readings = in_order(drive, SensorConfiguration())
    delay = SECOND // 4
    arrival = [end_of(r) + delay * isinstance(r, Scan) for r in readings]
    localizer = Localizer(hall, MOUNTS)
    count = 0
    for i in np.argsort(arrival, kind="stable").tolist():
        estimate = localizer.add(readings[i])
        if estimate.sweep is None or estimate.map_from_base is None or estimate.match is None:
            continue
        count += 1
        assert estimate.sweep.stamp == estimate.stamp
        points = estimate.map_from_base.apply(estimate.sweep.points)
        walls = np.abs(points[:, :2] - np.clip(points[:, :2], [0.02, 0.02], [7.98, 5.98])).max(
            axis=1
        )
        assert np.quantile(walls, 0.99) < 0.06
    assert count > 10


def test_late_hint_is_brought_forward_to_where_the_robot_has_driven(
    hall: PreparedMap, drive: Drive
) -> None:
    readings = [r for r in in_order(drive, SensorConfiguration()) if not isinstance(r, Hint)]
    then = SECOND
    hint = Hint(then, drive.pose(then), np.diag([0.01] * 6))
    at = next(i for i, r in enumerate(readings) if r.stamp > then + SECOND)
    localizer = Localizer(hall, MOUNTS)
    estimates = [localizer.add(r) for r in (*readings[:at], hint, *readings[at:])]
    assert [e.verdict.verdict for e in estimates if e.verdict] == [Verdict.ACCEPTED]
    estimate = estimates[-1]
    assert estimate.map_from_base is not None
    assert apart(estimate.map_from_base, drive.pose(estimate.stamp))[0] < 0.02


@pytest.mark.slow
def test_hint_is_answered_once_though_readings_come_late_while_it_is_looked_for(
    hall: PreparedMap, drive: Drive
) -> None:
    readings = in_order(drive, SensorConfiguration())
    localizer = Localizer(hall, MOUNTS)
    estimates = [localizer.add(reading) for reading in delayed(readings, 3, SECOND // 2)]
    assert sum(estimate.verdict is not None for estimate in estimates) == 1


def test_reading_later_than_the_horizon_is_refused_with_how_late_it_is(
    hall: PreparedMap, drive: Drive
) -> None:
    readings = in_order(drive, SensorConfiguration())
    localizer = Localizer(
        hall, MOUNTS, replace(LocalizerConfig(), late_readings=LateReadingsConfig(SECOND))
    )
    for reading in readings[:-40]:
        localizer.add(reading)
    now = localizer.add(readings[-40]).stamp
    estimate = localizer.add(WheelSpeeds(now - 3 * SECOND // 2 + 1, 0.1, 0.1))
    assert estimate.reasons[0] == "refused wheel speeds: 1.5 s late, with 1.0 s to come in"


@pytest.mark.parametrize(
    "wrong", [{"horizon": -1}, {"reuse_distance": -0.1}, {"reuse_angle": -0.1}]
)
def test_settings_below_zero_are_rejected(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="settings of late readings must be >= 0"):
        LateReadingsConfig(**wrong)  # type: ignore[arg-type]
