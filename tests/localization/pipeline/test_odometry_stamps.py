"""Stamps that a logger wrote when it found the time: the poses that wheels counted are as good as ever."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap
from localization.types import SECOND, Health
from tests.localization.pipeline.wheel_log import (
    BEGIN,
    LAP_START,
    MOMENT,
    OFFICE,
    Followed,
    Moment,
    Wheels,
    follow,
    lap,
    moments,
    summary,
)
from tests.support_rooms import Drive

pytestmark = pytest.mark.slow


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Logged:
    """A drive round a corner or two of the office, with the map that it is in."""

    world: PreparedMap
    drive: Drive
    log: list[Moment]

    def follow(self, stamps: list[int] | None = None, *, twice: bool = False) -> Followed:
        return follow(self.world, self.drive, self.log, stamps, twice=twice)


@pytest.fixture(scope="module")
def logged(grid: PreparedMap) -> Logged:
    drive = Drive(OFFICE, LAP_START, *lap(), begin=BEGIN)
    return Logged(grid, drive, moments(OFFICE, drive, Wheels()))


@pytest.fixture(scope="module")
def even(logged: Logged) -> Followed:
    """The drive as followed with true stamps."""
    return logged.follow()


def stalled(log: list[Moment], longest: int, seed: int = 1) -> list[int]:
    """Stamps of a logger that stalls, and then writes what has waited within a few milliseconds."""
    rng, stamps = np.random.default_rng(seed), list[int]()
    while len(stamps) < len(log):
        waiting = min(int(rng.choice([1, 1, 2, 3, longest])), len(log) - len(stamps))
        last = log[len(stamps) + waiting - 1].true
        stamps += [last - (waiting - 1 - i) * 400_000 for i in range(waiting)]
    return stamps


def in_bursts(log: list[Moment], stamps: list[int]) -> float:
    """Share of the scans that are stamped within 30 ms of the one before."""
    of_scans = [s for m, s in zip(log, stamps, strict=True) if m.scan is not None]
    return float(np.mean(np.diff(of_scans) < 30_000_000))


def test_true_stamps_give_the_error_of_the_map(even: Followed) -> None:
    assert even.off.max() < 0.08, summary(even)
    assert np.sqrt(np.mean(even.ratio**2)) < 1.5, summary(even)


def test_bursts_of_stamps_neither_move_the_estimate_nor_make_it_sure(
    logged: Logged, even: Followed
) -> None:
    stamps = stalled(logged.log, 8)
    assert in_bursts(logged.log, stamps) > 0.41
    burst = logged.follow(stamps)
    assert burst.off.max() < 0.08, summary(burst)
    assert burst.refused == 0
    assert np.sqrt(np.mean(burst.ratio**2)) < 1.5, summary(burst)
    assert burst.ratio.max() < 3.0, summary(burst)
    assert burst.off.mean() == pytest.approx(even.off.mean(), rel=0.1, abs=0.005)


def test_a_backlog_after_stalls_of_more_than_a_second_is_followed_as_well(logged: Logged) -> None:
    stamps = stalled(logged.log, 15)
    late = logged.follow(stamps)
    assert late.off.max() < 0.08, summary(late)
    assert late.ratio.max() < 3.0, summary(late)
    assert late.refused == 0
    # Nor is a stall of the logger a silence of the scanner.
    assert late.share(Health.SUSPECT, Health.LOST, Health.RELOCALISING) == 0.0


@pytest.mark.parametrize("overtaking", [False, True])
def test_stamps_shaken_by_50_ms_give_the_same_error_and_the_same_sigma(
    logged: Logged, even: Followed, overtaking: bool
) -> None:
    rng = np.random.default_rng(3)
    shaken = [m.true + round(50e6 * rng.standard_normal()) for m in logged.log]
    assert np.mean(np.diff(shaken) < 0) > 0.05
    shaken = shaken if overtaking else sorted(shaken)
    assert min(np.diff(shaken)) < 5_000_000
    followed = logged.follow(shaken)
    assert followed.refused == 0
    for name in ("off", "turned"):
        mean = getattr(even, name).mean()
        assert getattr(followed, name).mean() == pytest.approx(mean, rel=0.1, abs=0.005), name
    assert followed.sigma.mean() == pytest.approx(even.sigma.mean(), rel=0.1)


def test_stamps_within_a_burst_shaken_by_50_ms_are_followed_as_they_came(
    logged: Logged, even: Followed
) -> None:
    rng = np.random.default_rng(5)
    stamps = [t + int(rng.integers(-50_000_000, 50_000_000)) for t in stalled(logged.log, 8)]
    assert np.mean(np.diff(stamps) < 0) > 0.2
    followed = logged.follow(stamps)
    assert followed.off.max() < 0.08, summary(followed)
    assert followed.share(Health.SLIPPING, Health.SUSPECT, Health.LOST) == 0.0, summary(followed)
    assert followed.off.mean() == pytest.approx(even.off.mean(), rel=0.1, abs=0.005)
    assert followed.refused == 0


def test_odometry_written_before_and_after_the_scan_of_one_instant_is_not_refused(
    logged: Logged, even: Followed
) -> None:
    followed = logged.follow(twice=True)
    assert followed.refused == 0
    np.testing.assert_allclose(followed.off, even.off, atol=1e-9)
    np.testing.assert_allclose(followed.ratio, even.ratio, atol=1e-6)


def test_a_pause_of_three_seconds_with_a_turn_of_80_degrees_is_carried_by_the_odometry(
    logged: Logged,
) -> None:
    headings = np.unwrap([logged.drive.pose(m.true).yaw for m in logged.log])
    length = 3 * SECOND // MOMENT
    first = int(np.argmax(np.abs(headings[length:] - headings[:-length])))
    assert np.rad2deg(abs(headings[first + length] - headings[first])) > 75.0
    kept = [*logged.log[: first + 1], *logged.log[first + length :]]
    followed = follow(logged.world, logged.drive, kept)
    assert followed.off.max() < 0.15, summary(followed)
    assert np.rad2deg(followed.turned.max()) < 5.0, summary(followed)
    after = followed.true > (kept[first + 1].true - BEGIN) / SECOND + 2.0
    assert followed.off[after].max() < 0.08, summary(followed)
    assert followed.searched == 0
