from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Iterator

import numpy as np
import pytest

from localization.maps.prepared_map import PreparedMap, prepare
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Inertial,
    Mounts,
    Pose,
    Reading,
    Scan,
    Twist,
    Verdict,
    WheelSpeeds,
)
from robot_sim.simulation import Simulation
from robot_sim.worlds.loading import parse_world
from tests.localization.pipeline.wheel_log import noting
from tests.support_rooms import CORRIDOR, HALL, MOUNTS, TICK, Drive, Place, apart, box

START = Pose.planar(2.6, 1.6, 0.2)
LOOP = ((1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (2.0, 0.0, 0.8), (3.0, 0.4, -0.3), (1.0, 0.0, 0.0))
HINT_AT = 25


def hint(pose: Pose, stamp: int = 0, *, sigma: float | None = None) -> Hint:
    covariance = np.zeros((6, 6))
    if sigma is not None:
        covariance = np.diag(np.square([sigma, sigma, 0.0, 0.0, 0.0, 0.3]))
    return Hint(stamp, pose, covariance)


def feed(localizer: Localizer, readings: list[Reading]) -> Iterator[Estimate]:
    """The estimates after each inertial reading."""
    for reading in readings:
        estimate = localizer.add(reading)
        if isinstance(reading, Inertial):
            yield estimate


def hinted(readings: list[Reading], pose: Pose, at: int = HINT_AT) -> list[Reading]:
    return [*readings[:at], hint(pose, readings[at - 1].stamp), *readings[at:]]


def under_way(
    world: PreparedMap,
    place: Place = HALL,
    start: Pose = START,
    *,
    mounts: Mounts = MOUNTS,
    config: LocalizerConfig | None = None,
    scanners: tuple[str, ...] = tuple(MOUNTS),
) -> Localizer:
    """A localiser that tracks a robot which has stood at ``start`` for a second."""
    drive = Drive(place, start, (1.0, 0.0, 0.0), scanners=scanners)
    localizer = Localizer(world, mounts, config or LocalizerConfig())
    estimates = list(feed(localizer, hinted(drive.readings(), start)))
    assert estimates[-1].map_from_base is not None
    return localizer


def off(estimate: Estimate, true: Pose) -> tuple[float, float]:
    """Horizontal distance [m] and turn [rad] of an estimate from the truth."""
    assert estimate.map_from_base is not None
    step = true.inverse() @ estimate.map_from_base
    return float(np.hypot(*step.position[:2])), abs(step.yaw)


@pytest.fixture(scope="module")
def loop() -> Drive:
    return Drive(HALL, START, *LOOP, noise=0.012, seed=4)


@pytest.fixture(scope="module")
def estimates(hall: PreparedMap, loop: Drive) -> list[Estimate]:
    wrong = START @ Pose.planar(0.4, -0.3, 0.2)
    return list(feed(Localizer(hall, MOUNTS), hinted(loop.readings(), wrong)))


# A whole story


@pytest.mark.slow
def test_robot_waits_is_hinted_at_and_tracked_to_centimetres(
    loop: Drive, estimates: list[Estimate]
) -> None:
    assert (estimates[0].health, estimates[0].map_from_base) == (Health.WAITING, None)
    assert estimates[0].reasons == (
        "no pose yet: give a hint; without one the whole map is searched after 5 s",
    )
    placed = next(i for i, e in enumerate(estimates) if e.map_from_base is not None)
    states = [e.health for e in estimates]
    assert set(states[:placed]) == {Health.WAITING, Health.RELOCALISING}
    (verdict,) = [e.verdict for e in estimates if e.verdict is not None]
    assert verdict.verdict is Verdict.ACCEPTED
    assert any("placed anew" in reason for reason in estimates[placed].reasons)

    distances, turns = zip(
        *(off(e, loop.pose(e.stamp)) for e in estimates[placed + 25 :]), strict=True
    )
    assert np.linalg.norm(loop.pose(loop.end).position - START.position) > 1.0
    assert max(distances) < 0.04
    assert max(turns) < np.deg2rad(1.0)
    assert set(states[placed + 25 :]) <= {Health.TRACKING, Health.DEGRADED}


@pytest.mark.slow
def test_scanner_that_hangs_upside_down_localises_the_robot(hall: PreparedMap, loop: Drive) -> None:
    name = "laser_horizontal"
    hung = {**MOUNTS, name: MOUNTS[name] @ Pose.from_euler([0.0, 0.0, 0.0], roll=np.pi)}
    readings = [
        dataclasses.replace(r, angles=-r.angles) if isinstance(r, Scan) and r.scanner == name else r
        for r in loop.readings()
    ]
    last = list(feed(Localizer(hall, hung), hinted(readings, START)))[-1]
    assert last.health is Health.TRACKING, last.reasons
    assert off(last, loop.pose(last.stamp))[0] < 0.04


def test_covariance_is_consistent_with_the_errors(loop: Drive, estimates: list[Estimate]) -> None:
    squares = []
    for e in estimates[-400::5]:
        assert e.map_from_base is not None
        true = loop.pose(e.stamp)
        error = np.array(
            [
                *(true.position - e.map_from_base.position)[:2],
                (e.map_from_base.inverse() @ true).yaw,
            ]
        )
        p = e.covariance[np.ix_([0, 1, 5], [0, 1, 5])]
        squares.append(error @ np.linalg.solve(p, error))
    # Three degrees of freedom. The rooms have neither map nor mount errors, which the filter expects: it is
    # conservative in them, but not by any amount.
    assert 0.03 < np.mean(squares) < 1.0


def test_sweeps_and_matches_come_ten_times_a_second(estimates: list[Estimate]) -> None:
    sweeps = [e for e in estimates if e.sweep is not None]
    assert len(sweeps) == pytest.approx(len(estimates) / 5, abs=3)
    matched = [e for e in estimates if e.match is not None]
    assert len(matched) > 90
    for e in matched:
        assert e.match is not None
        assert e.sweep is not None
        assert e.nis is not None
        assert len(e.match.distances) == len(e.sweep.points)


def test_odometry_does_not_jump_when_the_map_pose_does(
    loop: Drive, estimates: list[Estimate]
) -> None:
    poses = [e.odom_from_base for e in estimates]
    steps = [apart(a, b) for a, b in itertools.pairwise(poses)]
    assert max(d for d, _ in steps) < 0.015
    assert max(t for _, t in steps) < 0.02
    moved = estimates[0].odom_from_base.inverse() @ estimates[-1].odom_from_base
    true = loop.pose(estimates[0].stamp).inverse() @ loop.pose(estimates[-1].stamp)
    assert apart(moved, true)[0] < 0.05


def test_stages_are_named_around_their_work(hall: PreparedMap) -> None:
    seen: list[str] = []
    localizer = Localizer(hall, MOUNTS, stage=noting(seen))
    readings = hinted(Drive(HALL, START, (0.8, 0.0, 0.0)).readings(), START, 15)
    assert len(list(feed(localizer, readings))) == 40
    wanted = {
        "predict",
        "deskew",
        "kiss odometry",
        "ekf",
        "registration",
        "scan consistency",
        "search",
    }
    assert wanted <= set(seen) <= wanted | {"mounts"}


# Hints


def test_hint_is_answered_whatever_it_says(hall: PreparedMap) -> None:
    localizer = under_way(hall)
    drive = Drive(HALL, START, (2.0, 0.0, 0.0), begin=SECOND)
    readings = drive.readings()
    given = [hint(START), hint(Pose.planar(90.0, 0.0, 0.0)), hint(Pose.planar(6.0, 1.0, 2.0))]
    for i, h in enumerate(given):
        readings.insert(20 + 5 * i, h)
    answers = [e.verdict for e in feed(localizer, readings) if e.verdict is not None]
    assert {id(a.hint) for a in answers} == {id(h) for h in given}
    assert len(answers) == len(given)
    assert all(a.reason for a in answers)


# Kidnapping


@pytest.fixture(scope="module")
def kidnapped(hall: PreparedMap) -> list[Estimate]:
    """A robot at rest is carried off between two readings."""
    elsewhere = Drive(HALL, Pose.planar(5.4, 3.6, -2.0), (4.0, 0.0, 0.0), begin=SECOND)
    return list(feed(under_way(hall), elsewhere.readings()))


def test_kidnapped_robot_is_lost_within_two_seconds_and_never_claims_to_track_where_it_is_not(
    kidnapped: list[Estimate],
) -> None:
    true = Pose.planar(5.4, 3.6, -2.0)
    lost = [e for e in kidnapped if e.health in (Health.LOST, Health.RELOCALISING)]
    assert lost
    assert lost[0].stamp <= 3 * SECOND
    late = [e for e in kidnapped if e.stamp > 3 * SECOND]
    assert len(late) == 2 * SECOND // TICK
    for e in late:
        believed = e.health in (Health.TRACKING, Health.DEGRADED, Health.SLIPPING)
        assert not believed or off(e, true)[0] < 0.2, (e.stamp, e.health)


def test_loss_has_reasons_in_words(kidnapped: list[Estimate]) -> None:
    """A robot that was carried off in the dark does not know its place at once."""
    unsure = (Health.SUSPECT, Health.LOST, Health.RELOCALISING)
    doubted = [e for e in kidnapped if e.health in unsure]
    assert Health.RELOCALISING in {e.health for e in doubted}
    assert any(e.stamp > 3 * SECOND for e in doubted)
    for e in doubted:
        assert e.reasons
        assert all(len(reason.split()) > 1 for reason in e.reasons)
    assert any("explains" in reason for e in doubted for reason in e.reasons)


@pytest.mark.slow
def test_lost_robot_is_found_again_by_a_hint(hall: PreparedMap, kidnapped: list[Estimate]) -> None:
    true = Pose.planar(5.4, 3.6, -2.0)
    readings = Drive(HALL, true, (5.0, 0.0, 0.0), begin=SECOND).readings()
    near = true @ Pose.planar(0.4, -0.4, 0.25)
    estimates = list(feed(under_way(hall), hinted(readings, near, len(readings) * 3 // 5)))
    verdicts = [e.verdict for e in estimates if e.verdict is not None]
    assert [v.verdict for v in verdicts] in ([Verdict.ACCEPTED], [Verdict.KEPT])
    assert off(estimates[-1], true)[0] < 0.05
    assert estimates[-1].health is Health.TRACKING
    assert any(e.health in (Health.LOST, Health.RELOCALISING) for e in kidnapped)


# Sensors that fail


@pytest.mark.parametrize("name", ["laser_horizontal", "laser_vertical", "wheels"])
def test_silence_of_a_sensor_is_reported_and_its_return_too(hall: PreparedMap, name: str) -> None:
    localizer = under_way(hall)
    readings = Drive(HALL, START, (2.4, 0.0, 0.0), begin=SECOND).readings()
    cut = 2 * SECOND + SECOND // 2

    def source(reading: Reading) -> str:
        if isinstance(reading, Scan):
            return reading.scanner
        return "wheels" if isinstance(reading, WheelSpeeds) else "gyro"

    silent = [r for r in readings if r.stamp <= cut and source(r) != name]
    estimates = list(feed(localizer, silent))
    assert estimates[-1].health is Health.DEGRADED
    assert f"nothing from {name}" in estimates[-1].reasons
    assert f"nothing from {name}" not in estimates[10].reasons
    assert off(estimates[-1], START)[0] < 0.05
    back = list(feed(localizer, [r for r in readings if r.stamp > cut]))
    assert f"nothing from {name}" not in back[-1].reasons


@pytest.mark.parametrize(
    ("mounted", "said"),
    [
        (("laser_horizontal",), r"unobservable: .*up"),
        (tuple(MOUNTS), "nothing from laser_vertical"),
    ],
)
def test_robot_without_scans_of_a_vertical_scanner_is_tracked_and_says_what_it_lacks(
    hall: PreparedMap, mounted: tuple[str, ...], said: str
) -> None:
    only = ("laser_horizontal",)
    mounts = {name: MOUNTS[name] for name in mounted}
    localizer = under_way(hall, mounts=mounts, scanners=only)
    drive = Drive(HALL, START, *LOOP[1:3], begin=SECOND, scanners=only)
    estimates = list(feed(localizer, drive.readings()))
    assert max(off(e, drive.pose(e.stamp))[0] for e in estimates) < 0.06
    assert any(re.match(said, reason) for reason in estimates[-1].reasons)
    # A wheeled robot on a floor needs neither height nor tilt.
    silent = len(mounted) > 1
    assert estimates[-1].health is (Health.DEGRADED if silent else Health.TRACKING)


def test_scans_without_returns_end_in_doubt_not_in_a_fall(hall: PreparedMap) -> None:
    localizer = under_way(hall)
    nowhere = Drive(Place([]), START, (2.0, 0.0, 0.0), begin=SECOND).readings()
    readings = hinted(nowhere, START)
    estimates = list(feed(localizer, readings))
    assert estimates[-1].health in (Health.LOST, Health.RELOCALISING)
    assert any("explains only 0%" in reason for reason in estimates[-1].reasons)
    (answer,) = [e.verdict for e in estimates if e.verdict is not None]
    assert answer.verdict is Verdict.REJECTED


def test_pause_of_all_sensors_is_survived(hall: PreparedMap) -> None:
    localizer = under_way(hall)
    later = Drive(HALL, START, (1.0, 0.0, 0.0), begin=11 * SECOND)
    estimates = list(feed(localizer, later.readings()))
    assert off(estimates[-1], START)[0] < 0.05
    assert np.isfinite(estimates[-1].covariance).all()


# Wheels that lie


def spun(readings: list[Reading], since: int, until: int, factor: float) -> list[Reading]:
    """Both sides' wheels turn ``factor`` times as fast as the robot goes, for a while."""
    return [
        WheelSpeeds(r.stamp, factor * r.left, factor * r.right)
        if isinstance(r, WheelSpeeds) and since <= r.stamp < until
        else r
        for r in readings
    ]


@pytest.mark.parametrize("factor", [0.0, 2.5])
def test_wheels_that_spin_or_block_are_reported_and_mislead_by_little(
    hall: PreparedMap, factor: float
) -> None:
    localizer = under_way(hall)
    drive = Drive(HALL, START, (3.5, 0.6, 0.2), begin=SECOND)
    estimates = list(feed(localizer, spun(drive.readings(), 5 * SECOND // 2, 3 * SECOND, factor)))
    assert max(off(e, drive.pose(e.stamp))[0] for e in estimates) < 0.15
    assert off(estimates[-1], drive.pose(estimates[-1].stamp))[0] < 0.04
    slipping = [e.stamp for e in estimates if e.health is Health.SLIPPING]
    assert slipping
    assert min(slipping) > 2.4 * SECOND
    assert estimates[-1].health is Health.TRACKING


def test_one_side_that_spins_is_seen_at_once(hall: PreparedMap) -> None:
    localizer = under_way(hall)
    readings: list[Reading] = [
        WheelSpeeds(r.stamp, r.left, r.right + 0.2 * (r.stamp > 2 * SECOND))
        if isinstance(r, WheelSpeeds)
        else r
        for r in Drive(HALL, START, (1.5, 0.0, 0.0), begin=SECOND).readings()
    ]
    estimates = list(feed(localizer, readings))
    first = next(e.stamp for e in estimates if e.health is Health.SLIPPING)
    assert first <= 2 * SECOND + 2 * TICK
    assert off(estimates[-1], START)[0] < 0.05


# Where the map does not hold the robot


def test_robot_in_a_corridor_without_ends_is_not_placed_by_a_guess(corridor: PreparedMap) -> None:
    start = Pose.planar(0.0, 0.1, 0.0)
    localizer = Localizer(corridor, MOUNTS)
    drive = Drive(CORRIDOR, start, (1.0, 0.0, 0.0), (2.0, 0.5, 0.0))
    estimates = list(feed(localizer, hinted(drive.readings(), start)))
    (answer,) = [e.verdict for e in estimates if e.verdict is not None]
    assert answer.verdict is Verdict.AMBIGUOUS
    assert len(answer.candidates) > 1
    assert estimates[-1].map_from_base is None
    assert estimates[-1].health is Health.RELOCALISING
    assert len(estimates[-1].hypotheses) > 1


def behind_somebody(scan: Scan, seconds: float) -> Scan:
    """What a scan becomes when somebody carries a door past, ever again, a metre a second."""
    near = (1.6 - 0.9 * (seconds % 1.0)) / np.maximum(np.cos(0.8 * scan.angles), 0.2)
    before = np.abs(scan.angles) < np.deg2rad(100.0)
    return dataclasses.replace(
        scan, ranges=np.where(before, np.minimum(scan.ranges, near), scan.ranges)
    )


def test_what_moves_before_the_scanner_is_not_taken_for_slipping_wheels(hall: PreparedMap) -> None:
    start = Pose.planar(1.5, 2.6, 0.0)
    drive = Drive(HALL, start, (1.0, 0.0, 0.0), (5.0, 0.5, 0.0), noise=0.012, seed=4)
    passing = range(int(2.5e9), int(5e9))
    seen = [
        behind_somebody(r, (r.stamp - passing.start) / SECOND)
        if isinstance(r, Scan) and r.scanner == "laser_horizontal" and r.stamp in passing
        else r
        for r in drive.readings()
    ]
    estimates = list(feed(Localizer(hall, MOUNTS), hinted(seen, start)))
    among = [
        e for e in estimates if e.stamp - passing.start > SECOND // 4 and e.stamp < passing.stop
    ]
    assert {e.health for e in among} <= {Health.TRACKING, Health.DEGRADED, Health.SUSPECT}
    assert max(off(e, drive.pose(e.stamp))[0] for e in among) < 0.006
    assert max(off(e, drive.pose(e.stamp))[0] for e in estimates[100:]) < 0.08


# A robot with physics

ROOM = """
bounds = [0.0, 0.0, 8.0, 6.0]
height = 2.5
spawn = [3.0, 2.0, 17.0]
[[wall]]
name = "south"
from = [0.0, -0.1]
to = [8.0, -0.1]
thickness = 0.2
[[wall]]
name = "east"
from = [8.1, 0.0]
to = [8.1, 6.0]
thickness = 0.2
[[wall]]
name = "north"
from = [0.0, 6.1]
to = [8.0, 6.1]
thickness = 0.2
[[wall]]
name = "west"
from = [-0.1, 0.0]
to = [-0.1, 6.0]
thickness = 0.2
"""


@pytest.mark.slow
def test_simulated_robot_is_tracked_through_a_room() -> None:
    world = Place(box((0.0, 0.0, 0.0), (8.0, 6.0, 2.5), inside=True)).prepared()
    simulation = Simulation(parse_world(ROOM, name="room"), seed=5)
    localizer = Localizer(world, simulation.mounts)
    distances, turns = [], []
    for tick in range(50 * 10):
        readings = simulation.step()
        if tick == 25:
            localizer.add(hint(Pose.planar(3.3, 1.8, 0.45), simulation.stamp))
        if tick == 60:
            simulation.command(Twist.planar(0.5, 0.4))
        for reading in readings:
            estimate = localizer.add(reading)
        if tick > 100:
            distance, turn = off(estimate, simulation.truth().map_from_base)
            distances.append(distance)
            turns.append(turn)
    assert np.linalg.norm(simulation.truth().map_from_base.position[:2] - [3.0, 2.0]) > 1.0
    assert max(distances) < 0.06
    assert max(turns) < np.deg2rad(1.0)
    assert estimate.health in (Health.TRACKING, Health.DEGRADED)
    assert localizer.refused == 0


def test_scan_from_the_future_is_refused_and_shuts_no_true_scan_out(hall: PreparedMap) -> None:
    localizer = under_way(hall)
    drive = Drive(HALL, START, (1.5, 0.0, 0.0))
    later = [r for r in drive.readings() if r.stamp > 1_100_000_000]
    real = next(r for r in later if isinstance(r, Scan))
    early = dataclasses.replace(real, stamp=real.stamp + 30 * SECOND)
    assert "ahead of the inertial readings" in localizer.add(early).reasons[0]
    assert any(e.match is not None for e in feed(localizer, later))


def test_scan_that_comes_too_late_is_dropped_with_a_reason(hall: PreparedMap) -> None:
    localizer = under_way(hall)
    drive = Drive(HALL, START, (5.0, 0.0, 0.0))
    later = [r for r in drive.readings() if r.stamp > 1_100_000_000]
    held = next(r for r in later if isinstance(r, Scan))
    now: list[Reading] = [r for r in later if not isinstance(r, Scan)]
    list(feed(localizer, now))
    localizer.add(held)
    estimates = list(
        feed(localizer, [Inertial(now[-1].stamp + TICK, np.zeros(3), np.array([0, 0, 9.81]))])
    )
    assert any("s late" in reason for reason in estimates[-1].reasons)


@pytest.mark.slow
def test_map_that_states_its_own_error_is_covered_and_followed_as_any_other(
    hall: PreparedMap,
) -> None:
    """The map was made without truth, and lies 3 cm and 0.4 degrees beside it."""
    askew = Pose.planar(0.024, -0.018, np.deg2rad(0.4))
    cloud, drive = hall.cloud, Drive(HALL, START, *LOOP)
    moved = dataclasses.replace(
        cloud, points=askew.apply(cloud.points), normals=cloud.normals @ askew.rotation.T
    )
    stated = dataclasses.replace(moved, position_noise=0.03, heading_noise=np.deg2rad(0.3))
    readings = hinted(drive.readings(), START)
    silent, honest = (list(feed(Localizer(prepare(c), MOUNTS), readings)) for c in (moved, stated))
    errors = []
    for before, after in zip(silent[100:], honest[100:], strict=True):
        assert before.map_from_base is not None
        assert after.map_from_base is not None
        # What the map says of itself changes no pose, no state, and nothing between two poses.
        np.testing.assert_array_equal(before.map_from_base.position, after.map_from_base.position)
        assert before.health is after.health
        step = drive.pose(after.stamp).inverse() @ after.map_from_base
        off = np.array([*(drive.pose(after.stamp).rotation @ step.position)[:2], step.yaw])
        axes = np.ix_([0, 1, 5], [0, 1, 5])
        errors.append([off @ np.linalg.solve(e.covariance[axes], off) for e in (before, after)])
    overconfident, covered = np.array(errors).T
    assert overconfident.min() > 20.0
    assert covered.max() < 7.81  # chi-square, 3 degrees of freedom, 95 %
