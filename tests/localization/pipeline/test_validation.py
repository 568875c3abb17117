from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from localization.maps.prepared_map import PreparedMap
from localization.pipeline.localizer import Localizer
from localization.pipeline.validation import ReadingValidator
from localization.types import (
    SECOND,
    Estimate,
    Hint,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)
from tests.support import a_scan, bits
from tests.support_rooms import HALL, MOUNTS, TICK, Drive

NAN, INF = float("nan"), float("inf")


def inertial(stamp: int = 1, *, gyro: object = (0, 0, 0), force: object = (0, 0, 9.81)) -> Inertial:
    return Inertial(stamp, np.array(gyro, dtype=float), np.array(force, dtype=float))


def scan(stamp: int = 1, **of: object) -> Scan:
    ranges = np.asarray(of.get("ranges", [1.0, 2.0]), dtype=float)
    n = len(ranges)
    angles = np.asarray(of.get("angles", np.linspace(0, 1, n)), dtype=float)
    offsets = np.arange(n, dtype=np.int64) * int(str(of.get("beam", 1)))
    name = str(of.get("scanner", "laser_horizontal"))
    return Scan(stamp, name, angles, ranges, np.zeros(0), offsets, 0.1, 30.0)


IMPOSSIBLE = {
    "wheels NaN": (WheelSpeeds(1, NAN, 0.0), "wheel speeds nan, 0 m/s"),
    "other wheels NaN": (WheelSpeeds(1, 0.0, NAN), "wheel speeds 0, nan m/s"),
    "wheels infinite": (WheelSpeeds(1, 0.0, -INF), "must be finite and within 20 m/s"),
    "wheels too fast": (WheelSpeeds(1, 25.0, 0.0), "must be finite and within 20 m/s"),
    "gyro NaN": (inertial(gyro=[0, 0, NAN]), "angular velocity must be finite"),
    "gyro in degrees": (inertial(gyro=[0, 90, 0]), "in rad/s"),
    "force NaN": (inertial(force=[NAN, 0, 0]), "specific force must be finite"),
    "force infinite": (inertial(force=[0, 0, INF]), "specific force must be finite"),
    "force in milli-g": (inertial(force=[0, 0, 1000]), "in m/s^2"),
    "foreign scanner": (
        scan(scanner="velodyne"),
        "unknown scanner 'velodyne'; known: laser_horizontal, laser_vertical",
    ),
    "no beams": (scan(ranges=[]), "empty scan of laser_horizontal"),
    "angles NaN": (scan(angles=[0.0, NAN]), "angles must be finite"),
    "beams over an hour": (scan(beam=1800 * SECOND), "that took 1800 s: offsets must be in nanos"),
    "points over an hour": (
        PointScan(1, "laser_horizontal", np.ones((2, 3)), np.array([0, 3600 * SECOND])),
        "that took 3600 s: offsets must be in nanoseconds",
    ),
    "no points": (
        PointScan(1, "laser_horizontal", np.zeros((0, 3)), np.zeros(0, dtype=np.int64)),
        "empty scan of laser_horizontal",
    ),
    "odometry in millimetres": (
        Odometry(1, Pose.planar(2e6, 0.0, 0.0)),
        "refused odometry: its position must be in metres",
    ),
}


@pytest.mark.parametrize(("reading", "why"), IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_reading_that_cannot_be_true_is_refused_in_one_line(reading: Reading, why: str) -> None:
    validator = ReadingValidator(MOUNTS)
    refusal = validator.refusal(reading)
    assert refusal is not None
    assert refusal.startswith("refused")
    assert why in refusal
    assert "\n" not in refusal
    assert validator.refused == 1


WELCOME = {
    "wheels": WheelSpeeds(1, -2.0, 2.0),
    "inertial": inertial(),
    "scan": scan(),
    "scan without returns": scan(ranges=[NAN, INF]),
    "hint": Hint(1, Pose.identity(), np.zeros((6, 6))),
}


@pytest.mark.parametrize("reading", WELCOME.values(), ids=WELCOME)
def test_reading_that_can_be_true_is_welcome(reading: Reading) -> None:
    validator = ReadingValidator(MOUNTS)
    assert validator.refusal(reading) is None
    assert validator.refused == 0


def made(kind: str, stamp: int) -> Reading:
    match kind:
        case "wheel speeds":
            return WheelSpeeds(stamp, 0.0, 0.0)
        case "inertial reading":
            return inertial(stamp)
        case _:
            return a_scan(stamp, kind.removeprefix("scan of "))


KINDS = ["wheel speeds", "inertial reading", "scan of laser_horizontal", "scan of laser_vertical"]


@pytest.mark.parametrize("kind", KINDS)
def test_without_a_horizon_stamps_of_a_source_must_increase(kind: str) -> None:
    validator = ReadingValidator(MOUNTS, horizon=0)
    assert validator.refusal(made(kind, 5 * SECOND)) is None
    for late in (5 * SECOND, 3 * SECOND):
        why = validator.refusal(made(kind, late))
        assert why == (
            f"refused {kind} stamped {late / SECOND:.3f} s, not after 5.000 s: stamps must increase"
        )
    assert validator.refusal(made(kind, 5 * SECOND + 1)) is None


@pytest.mark.parametrize("kind", KINDS)
def test_same_stamp_again_is_refused_in_order_and_out_of_it(kind: str) -> None:
    validator = ReadingValidator(MOUNTS)
    for stamp in (5 * SECOND, 6 * SECOND, 5 * SECOND + 7):
        assert validator.refusal(made(kind, stamp), 6 * SECOND) is None
    for stamp in (5 * SECOND, 5 * SECOND + 7, 6 * SECOND):
        why = validator.refusal(made(kind, stamp), 6 * SECOND)
        assert why == (
            f"refused {kind} stamped {stamp / SECOND:.3f} s again: each must have a stamp of its own"
        )


@pytest.mark.parametrize("kind", KINDS)
def test_reading_later_than_the_horizon_is_refused_with_its_delay(kind: str) -> None:
    validator = ReadingValidator(MOUNTS)
    assert validator.refusal(made(kind, 10 * SECOND), 10 * SECOND) is None
    assert validator.refusal(made(kind, 8 * SECOND), 10 * SECOND) is None
    why = validator.refusal(made(kind, 7 * SECOND), 10 * SECOND)
    assert why == f"refused {kind}: 3.0 s late, with 2.0 s to come in"
    why = validator.refusal(made(kind, 0), 100 * SECOND)
    assert why is not None
    assert why.endswith("start a new localiser after a reset of the clock")


def test_leap_of_what_moves_time_on_is_believed_when_the_next_reading_follows_it() -> None:
    validator = ReadingValidator(MOUNTS)
    now = 5 * SECOND
    assert validator.refusal(inertial(now), 0) is None
    why = validator.refusal(inertial(now + 30 * SECOND), now)
    assert why == (
        "refused inertial reading stamped 30.0 s after the one before: "
        "the next ones are taken if they follow it"
    )
    assert validator.refusal(inertial(now + TICK), now) is None, "it was one bad stamp"
    now += TICK
    assert validator.refusal(inertial(now + 20 * SECOND), now) is not None
    assert validator.refusal(inertial(now + 20 * SECOND + TICK), now) is None, "it was a pause"


def test_leap_of_the_clock_is_refused_with_what_to_do() -> None:
    validator = ReadingValidator(MOUNTS)
    assert validator.refusal(inertial(SECOND)) is None
    for leap in (61, 62):
        why = validator.refusal(inertial((1 + leap) * SECOND), SECOND)
        assert why is not None
        assert f"{leap} s after the one before: start a new localiser" in why
    for kind in set(KINDS) - {"inertial reading"}:
        why = validator.refusal(made(kind, 62 * SECOND), SECOND)
        assert why is not None
        assert "ahead of the inertial readings: all sensors must share one clock" in why


def refusals(arrivals: Iterable[tuple[str, float]]) -> list[str]:
    """What is refused of scans and odometry that arrive with some stamps [s], where odometry advances time."""
    validator, now, found = ReadingValidator(MOUNTS, leader=(Odometry,)), 0, []
    for kind, seconds in arrivals:
        stamp = round(seconds * SECOND)
        reading = (
            Odometry(stamp, Pose.planar(0.1 * seconds, 0.0, 0.0))
            if kind == "odometry"
            else a_scan(stamp, kind)
        )
        if validator.repeats(reading):
            continue
        why = validator.refusal(reading, now)
        if why is not None:
            found.append(why)
        elif isinstance(reading, Odometry):
            now = max(now, stamp)
    return found


LASER, OTHER = "laser_horizontal", "laser_vertical"
SPARSE = {
    "scan first": [(LASER, 0.0), ("odometry", 0.0)],
    "odometry first": [("odometry", 0.0), (LASER, 0.0)],
    "odometry before and after": [("odometry", 0.0), (LASER, 0.0), ("odometry", 0.0)],
    "two scanners first": [(LASER, 0.0), (OTHER, 0.0), ("odometry", 0.0)],
    "a scanner before, another after": [(LASER, 0.0), ("odometry", 0.0), (OTHER, 0.0)],
    "odometry with less latency": [(LASER, 0.0), ("odometry", -0.2)],
}


@pytest.mark.parametrize("order", SPARSE.values(), ids=SPARSE)
@pytest.mark.parametrize("period", [0.9, 1.2, 2.0, 5.0, 9.5])
def test_scans_of_which_each_comes_with_its_odometry_are_taken_however_rare_they_are(
    order: list[tuple[str, float]], period: float
) -> None:
    stamps = [10.0 + period * i for i in range(20)]
    assert refusals((kind, at + off) for at in stamps for kind, off in order) == []


def test_scans_between_rare_poses_are_taken() -> None:
    cycle = [(LASER, 1.2), (LASER, 2.4), ("odometry", 2.4)]
    arrivals = [(kind, 10.0 + 2.4 * i + at) for i in range(20) for kind, at in cycle]
    assert refusals([("odometry", 10.0), *arrivals]) == []


def test_of_two_scans_before_each_rare_pose_one_is_refused_at_first_and_none_later() -> None:
    cycle = [(LASER, 1.5), (LASER, 2.0), ("odometry", 2.0)]
    arrivals = [(kind, 10.0 + 2.0 * i + at) for i in range(20) for kind, at in cycle]
    assert len(refusals([("odometry", 10.0), *arrivals])) == 1


@pytest.mark.parametrize("offset", [1.1, 1.5, 5.0, 59.0, 3600.0])
@pytest.mark.parametrize(("odometry", "scans"), [(0.05, 0.1), (0.1, 2.0), (0.2, 5.0), (1.0, 1.0)])
def test_scans_of_a_clock_that_runs_ahead_are_refused_from_the_second_on(
    offset: float, odometry: float, scans: float
) -> None:
    poses = [("odometry", 10.0 + odometry * i) for i in range(round(20.0 / odometry))]
    seen = [
        (LASER, 10.5 + scans * i, 10.5 + scans * i + offset) for i in range(round(18.0 / scans))
    ]
    arrivals = [(at, kind, at) for kind, at in poses] + [
        (at, kind, stamp) for kind, at, stamp in seen
    ]
    why = refusals((kind, stamp) for _, kind, stamp in sorted(arrivals))
    assert len(why) >= len(seen) - 1
    assert all("ahead of the odometry: all sensors must share one clock" in line for line in why)


def test_scans_of_silent_odometry_are_refused_from_the_second_on_beyond_a_second() -> None:
    arrivals = [("odometry", 10.0), *((LASER, 10.05 + 0.1 * i) for i in range(40))]
    assert len(refusals(arrivals)) == 29


@given(order=st.permutations(KINDS))
def test_sources_do_not_wait_for_each_other(order: list[str]) -> None:
    validator = ReadingValidator(MOUNTS)
    for i, kind in enumerate(order):
        assert validator.refusal(made(kind, (9 - i) * SECOND)) is None


def test_hints_may_come_in_any_order() -> None:
    validator = ReadingValidator(MOUNTS)
    for stamp in (5, 3, 3, 0):
        assert validator.refusal(Hint(stamp * SECOND, Pose.identity(), np.zeros((6, 6)))) is None


def test_refused_reading_does_not_count_as_the_last() -> None:
    validator = ReadingValidator(MOUNTS)
    assert validator.refusal(WheelSpeeds(SECOND, 0.0, 0.0)) is None
    assert validator.refusal(WheelSpeeds(9 * SECOND, NAN, 0.0)) is not None
    assert validator.refusal(WheelSpeeds(2 * SECOND, 0.0, 0.0)) is None


# Nothing that is refused leaves a trace in the filter.


@pytest.fixture(scope="module")
def good() -> list[Reading]:
    start = Pose.planar(3.0, 2.0, 0.3)
    drive = Drive(HALL, start, (0.6, 0.0, 0.0), (1.4, 0.5, 0.4))
    readings = drive.readings()
    readings.insert(20, Hint(8 * TICK, start, np.zeros((6, 6))))
    return readings


def essence(estimate: Estimate) -> object:
    pose = estimate.map_from_base
    match = estimate.match
    return (
        estimate.stamp,
        None if pose is None else bits(pose),
        bits(estimate.odom_from_base),
        bits(estimate.covariance),
        bits(estimate.twist.linear),
        estimate.health,
        estimate.nis,
        None if match is None else (bits(match.map_from_base), bits(match.information)),
        None if estimate.verdict is None else estimate.verdict.verdict,
    )


@pytest.fixture(scope="module")
def undisturbed(hall: PreparedMap, good: list[Reading]) -> list[object]:
    localizer = Localizer(hall, MOUNTS)
    estimate = [essence(localizer.add(reading)) for reading in good]
    last = localizer.add(inertial(3 * SECOND))
    assert last.map_from_base is not None, "the drive is to be under way"
    return estimate


def garbage(kind: int, now: int) -> Reading:
    """Something impossible at about ``now``."""
    match kind:
        case 0:
            return WheelSpeeds(now + 1, NAN, 0.3)
        case 1:
            return inertial(now + 1, gyro=[NAN, 0, 0])
        case 2:
            return inertial(now + 1, force=[0, INF, 0])
        case 3:
            return scan(now + 1, angles=[NAN, 1.0])
        case 4:
            return scan(now + 1, scanner="another")
        case 5:
            return inertial(TICK)
        case 6:
            return WheelSpeeds(TICK, 1.0, 1.0)
        case 7:
            return inertial(now + 100 * SECOND)
        case 8:
            return inertial(now + 30 * SECOND)
        case 9:
            return WheelSpeeds(now + 2 * SECOND, 0.5, 0.5)
        case 10:
            return scan(now + 5 * SECOND)
        case 11:
            return scan(now + 1, beam=10 * SECOND)
        case _:
            return scan(now + 1, ranges=[])


@pytest.mark.slow
@given(
    thrown=st.lists(st.tuples(st.integers(5, 10_000), st.integers(0, 12)), min_size=1, max_size=40)
)
@settings(max_examples=8)
def test_garbage_in_between_leaves_every_estimate_as_it_was_to_the_last_bit(
    hall: PreparedMap,
    good: list[Reading],
    undisturbed: list[object],
    thrown: list[tuple[int, int]],
) -> None:
    places: dict[int, list[int]] = {}
    for at, kind in thrown:
        places.setdefault(5 + at % (len(good) - 5), []).append(kind)
    localizer = Localizer(hall, MOUNTS)
    for i, reading in enumerate(good):
        for kind in places.get(i, ()):
            estimate = localizer.add(garbage(kind, good[i - 1].stamp))
            assert estimate.reasons[0].startswith("refused")
            assert (estimate.match, estimate.sweep, estimate.verdict) == (None, None, None)
        assert essence(localizer.add(reading)) == undisturbed[i]
    assert localizer.refused == len(thrown)


def test_clock_that_is_set_back_is_refused_with_the_remedy(
    hall: PreparedMap, good: list[Reading]
) -> None:
    localizer = Localizer(hall, MOUNTS)
    shift = 100 * SECOND
    for reading in good:
        estimate = localizer.add(replace(reading, stamp=reading.stamp + shift))
    again = [localizer.add(reading) for reading in good if not isinstance(reading, Hint)]
    assert localizer.refused == len(again)
    assert all(e.stamp == estimate.stamp for e in again)
    assert all("start a new localiser after a reset of the clock" in e.reasons[0] for e in again)


def test_next_estimate_says_what_was_refused_once(hall: PreparedMap) -> None:
    localizer = Localizer(hall, MOUNTS)
    localizer.add(inertial(TICK))
    localizer.add(WheelSpeeds(2 * TICK, NAN, 0.0))
    estimate = localizer.add(inertial(2 * TICK)).reasons
    assert sum("wheel speeds nan" in reason for reason in estimate) == 1
    assert not any("refused" in r for r in localizer.add(inertial(3 * TICK)).reasons)
