from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from localization.evaluation.fault_injection import Span, slipping
from localization.filter.pose_error import difference
from localization.maps.prepared_map import PreparedMap
from localization.motion.kiss_odometry import KissState
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Health, Hint, Inertial, Pose, Reading, Scan, end_of
from tests.support_rooms import HALL, MOUNTS, TICK, Drive

START = Pose.planar(2.6, 1.6, 0.2)
ORDERS = ((0.5, 0.0, 0.0), (3.0, 0.4, 0.3), (2.5, 0.2, -0.6))


def readings_at(drive: Drive, rate: int) -> list[Reading]:
    """A drive's readings with so many scans of each scanner a second."""
    readings: list[Reading] = [r for r in drive.readings() if not isinstance(r, Scan)]
    period = SECOND // rate
    for begin in range(4 * TICK, drive.end - 2 * TICK, period):
        readings += [drive.scan(name, begin) for name in MOUNTS]
    return sorted(readings, key=lambda r: (end_of(r), isinstance(r, Inertial)))


@dataclass(frozen=True, slots=True)
class Fare:
    """How it went after the robot had settled."""

    errors: list[float]
    """[m]"""
    sigma: float
    """Mean [m]."""
    nees: float
    """Mean, of 6."""
    states: list[Health]


def fare(world: PreparedMap, rate: int, slip: tuple[Span, ...] = ()) -> Fare:
    drive = Drive(HALL, START, *ORDERS, seed=4)
    localizer = Localizer(world, MOUNTS)
    errors, sigmas, nees, states = [], [], [], []
    for i, reading in enumerate(slipping(readings_at(drive, rate), slip)):
        if i == 20:
            localizer.add(Hint(reading.stamp, START, np.zeros((6, 6))))
        estimate = localizer.add(reading)
        if reading.stamp < 75 * TICK or not isinstance(reading, Inertial):
            continue
        assert estimate.map_from_base is not None
        off = difference(estimate.map_from_base, drive.pose(reading.stamp))
        errors.append(float(np.hypot(off[0], off[1])))
        sigmas.append(float(np.sqrt(np.trace(estimate.covariance[:2, :2]))))
        nees.append(float(off @ np.linalg.solve(estimate.covariance, off)))
        states.append(estimate.health)
    return Fare(errors, float(np.mean(sigmas)), float(np.mean(nees)), states)


@pytest.fixture
def restarts(monkeypatch: pytest.MonkeyPatch) -> list[KissState]:
    """The states of laser odometry whose local maps were given up."""
    given_up: list[KissState] = []
    restarted = KissState.restarted

    def noted(state: KissState) -> KissState:
        given_up.append(state)
        return restarted(state)

    monkeypatch.setattr(KissState, "restarted", noted)
    return given_up


@pytest.mark.slow
def test_more_sweeps_a_second_do_not_make_the_robot_surer_of_itself(
    hall: PreparedMap, restarts: list[KissState]
) -> None:
    """The map's errors, which all sweeps share, stay."""
    slow = fare(hall, 10)
    restarts.clear()
    fast = fare(hall, 50)
    assert fast.sigma > 0.85 * slow.sigma
    assert np.mean(fast.errors) < 0.01
    # Six degrees of freedom. The rooms have neither map nor mount errors, which the filter expects: it is
    # conservative in them, but neither by any amount nor less and less.
    assert 0.02 < fast.nees < 1.0
    assert set(fast.states) <= {Health.TRACKING, Health.DEGRADED}
    # A robot that sets off after standing for so many sweeps can hold KISS-ICP back once.
    assert len(restarts) <= 1


@pytest.mark.slow
def test_slip_is_noticed_and_survived_though_the_scanners_are_fast(hall: PreparedMap) -> None:
    slip = Span(3 * SECOND, 3 * SECOND + SECOND // 2)
    estimate = fare(hall, 50, (slip,))
    assert max(estimate.errors) < 0.05
    during = estimate.states[3 * 50 - 75 + 10 : 3 * 50 - 75 + 25]
    assert set(during) == {Health.SLIPPING}
    assert estimate.states.count(Health.SLIPPING) < 75, "and is over a second after its end"
