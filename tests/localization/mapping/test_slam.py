from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import ate
from localization.geometry import FloatArray, wrap_angle
from localization.mapping.flat_sweep import FlatSweep
from localization.mapping.loop_closure import LoopCloser
from localization.mapping.loop_closure_types import Closure, ClosureConfig
from localization.mapping.loop_optimization import close_loops
from localization.mapping.odometry_front_end import Odometer, OdometerConfig
from localization.mapping.planar_pose import between, compose
from localization.mapping.slam import Survey, map_drive
from localization.mapping.slam_config import MappingError, SlamConfig
from localization.mapping.submap import Submap
from localization.maps.prepared_map import prepare
from localization.motion.kiss_odometry import KissOdometry, KissState, KissView, ObservedMotion
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import Health, Hint, Inertial, Pose, Reading, Scan, Sweep, WheelSpeeds
from tests.support_rooms import HALL, MOUNTS, SQUARE, TICK, Drive, Place, box

pytest.importorskip("open3d", reason="pose graphs need Open3D")

RING = Place(
    [
        *box((0.0, 0.0, 0.0), (9.0, 7.0, 2.5), inside=True),
        *box((2.0, 2.0, 0.0), (7.0, 5.0, 2.5)),
        *box((3.1, 0.0, 0.0), (3.5, 0.35, 2.5)),
        *box((8.5, 2.6, 0.0), (9.0, 3.1, 2.5)),
        *box((5.2, 6.6, 0.0), (6.1, 7.0, 2.5)),
        *box((0.0, 4.2, 0.0), (0.4, 4.9, 2.5)),
    ]
)
"""A corridor of 2 m around a block, with a pilaster on each outer wall: from nowhere is all of it seen."""

COMB = Place(
    [
        *box((-10.0, -1.0, 0.0), (10.0, 1.0, 2.5), inside=True)[2:4],
        *(
            face
            for x in np.arange(-9.5, 9.6, 1.0)
            for face in box((x, 0.7, 0.0), (x + 0.3, 1.0, 2.5))
        ),
    ]
)
"""A corridor with a pilaster every metre and no ends: each metre of it looks like the next."""


def around_the_block(rounds: float) -> FloatArray:
    """True planar poses (K, 3) every half metre of a drive around the ring's block."""
    corners = np.array([[1.0, 1.0], [8.0, 1.0], [8.0, 6.0], [1.0, 6.0]])
    poses = []
    for _ in range(int(np.ceil(rounds))):
        for k in range(4):
            a, b = corners[k], corners[(k + 1) % 4]
            n = round(float(np.hypot(*(b - a))) / 0.5)
            yaw = float(np.arctan2(*(b - a)[::-1]))
            turns = np.linspace(yaw - 0.5 * np.pi, yaw, 5)[1:]
            poses += [(*a, turn) for turn in turns]
            poses += [(*(a + (b - a) * i / n), yaw) for i in range(1, n)]
    return np.array(poses)[: round(rounds * len(poses) / np.ceil(rounds))]


def strayed(poses: FloatArray, scale: float, turn: float) -> FloatArray:
    """The same drive as odometry has it that gains a share of its way and turns by so much per metre."""
    seen = [np.zeros(3)]
    for a, b in itertools.pairwise(poses):
        step = between(a, b)
        way = float(np.hypot(step[0], step[1]))
        seen.append(compose(seen[-1], step * [1.0 + scale, 1.0 + scale, 1.0] + [0, 0, turn * way]))
    return np.array([compose(poses[0], pose) for pose in seen])


def flat(place: Place, poses: FloatArray) -> list[FlatSweep]:
    return [
        FlatSweep.of(place.sweep(Pose.planar(*pose), noise=0.01, seed=i, vertical=False), 0.0, 0.0)
        for i, pose in enumerate(poses.tolist())
    ]


def loose(poses: FloatArray) -> list[FloatArray]:
    return [np.diag(np.square([0.01, 0.01, 0.01]))] * (len(poses) - 1)


def errors(poses: FloatArray, truth: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(poses - truth)[:, :2].T))


@pytest.mark.slow
def test_loop_closure_removes_drift() -> None:
    truth = around_the_block(1.4)
    odometry = strayed(truth, 0.01, np.deg2rad(0.15))
    closed = close_loops(flat(RING, truth), odometry, np.zeros(len(truth)), loose(truth))
    before, after = errors(odometry, truth), errors(closed.poses, truth)
    assert before.max() > 0.35
    assert after.max() < 0.3 * before.max()
    assert np.sqrt(np.mean(after**2)) < 0.06
    assert len(closed.closures) >= 5
    # What was closed is true.
    for c in closed.closures:
        off = between(between(truth[c.earlier], truth[c.later]), c.motion)
        assert np.hypot(off[0], off[1]) < 0.03
        assert abs(off[2]) < np.deg2rad(1.0)


def test_drive_without_loops_follows_odometry() -> None:
    truth = around_the_block(0.6)
    odometry = strayed(truth, 0.01, np.deg2rad(0.15))
    closed = close_loops(flat(RING, truth), odometry, np.zeros(len(truth)), loose(truth))
    assert closed.closures == ()
    assert closed.poses is odometry


def far_and_back(gap: float) -> tuple[LoopCloser, FloatArray]:
    """A drive along the comb and back, and key frames that believe to be ``gap`` metres off at its end."""
    out = np.array([(x, 0.0, 0.0) for x in np.arange(-3.0, 3.1, 0.5)])
    back = np.array([(x, 0.0, 0.0) for x in np.arange(3.0, -3.1, -0.5)])
    truth = np.concatenate([out, back])
    believed = truth.copy()
    believed[len(out) :, 0] += gap
    # Long ago: on the way between, 60 m were driven elsewhere.
    way = np.concatenate([np.arange(13) * 0.5, 66.0 + np.arange(13) * 0.5])
    return LoopCloser(flat(COMB, truth), way), believed


def test_place_that_repeats_within_the_drift_closes_no_loop() -> None:
    """60 m on, drift may be 1.9 m: which of the equal pilasters these are nobody can know."""
    closer, believed = far_and_back(1.0)
    found, rejected_closures = closer.find(believed)
    assert found == []
    assert rejected_closures.ambiguous >= 3


def test_single_closure_without_support_is_rejected() -> None:
    truth = around_the_block(1.4)
    sweeps = flat(RING, truth)
    odometry = strayed(truth, 0.01, np.deg2rad(0.15))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(odometry[:, :2], axis=0).T))])
    strict = LoopCloser(sweeps, way, ClosureConfig(min_supporters=1000))
    found, rejected_closures = strict.find(odometry)
    assert found == []
    assert rejected_closures.unsupported >= 3


def test_closure_that_drift_cannot_explain_is_rejected() -> None:
    truth = np.array([(1.0, 1.0, 0.0), (1.3, 1.0, 0.0), (1.6, 1.0, 0.0)])
    closer = LoopCloser(flat(RING, truth), np.array([0.0, 0.3, 6.0]))
    right = closer.close(2, 0, truth, 6.0)
    assert isinstance(right, Closure)
    assert np.hypot(*(right.motion - between(truth[0], truth[2]))[:2]) < 0.02
    # After a way of 0.1 m odometry cannot be 0.15 m off.
    believed = truth + [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.15, 0.0, 0.0]]
    assert closer.close(2, 0, believed, 0.1) == "impossible"


def test_sweep_of_another_room_is_unexplained() -> None:
    here = np.array([(1.0, 1.0, 0.0), (1.3, 1.0, 0.0)])
    there = flat(SQUARE, np.array([(0.4, 0.3, 0.7)]))
    closer = LoopCloser([*flat(RING, here), *there], np.array([0.0, 0.3, 40.0]))
    believed = np.array([*here, (1.6, 1.0, 0.0)])
    assert closer.close(2, 0, believed, 40.0) == "unexplained"


def test_bare_corridor_leaves_its_direction_unobservable() -> None:
    bare = Place([f for f in box((-15.0, -1.0, 0.0), (15.0, 1.0, 2.5), inside=True) if f.axis != 0])
    poses = np.array([(x, 0.1, 0.02) for x in np.arange(-1.0, 1.1, 0.25)])
    sweeps = flat(bare, poses)
    submap = Submap.of([s.moved(p) for s, p in zip(sweeps, poses, strict=True)])
    found = submap.align(sweeps[0], poses[0] + [0.3, 0.05, 0.02], np.diag([0.1, 0.01, 0.01]))
    assert found.pose[1:] == pytest.approx(poses[0, 1:], abs=0.01)
    along, across = np.sqrt(np.diag(found.information))[:2]
    assert across > 1.0 / 0.01
    assert along < 1.0 / 0.3


# The whole of it, in a hall.

START = Pose.from_euler([4.0, 1.4, 0.0])
ORDERS = ((0.6, 0.0, 0.0), (28.0, 0.5, 1.0 / 3.0))
"""Half a second of rest, and one and a half circles of 1.5 m about the hall's middle."""


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Drive(HALL, START, *ORDERS, seed=3)


@pytest.fixture(scope="module")
def readings(drive: Drive) -> list[Reading]:
    return drive.readings()


LEVEL = SlamConfig.of(SensorConfiguration())


@pytest.fixture(scope="module")
def survey(readings: list[Reading]) -> Survey:
    return map_drive(readings, MOUNTS, LEVEL, start=START)


@pytest.fixture(scope="module")
def beginning(readings: list[Reading]) -> list[Reading]:
    return readings[: len(readings) // 3]


@pytest.fixture(scope="module")
def here(beginning: list[Reading]) -> Survey:
    """The survey of the drive's beginning that starts at the map's origin."""
    return map_drive(beginning, MOUNTS, LEVEL)


def truth_of(drive: Drive) -> Trajectory:
    stamps = range(TICK, drive.end + 1, TICK)
    return Trajectory.from_poses((stamp, drive.pose(stamp)) for stamp in stamps)


@pytest.mark.slow
def test_drive_is_tracked_without_a_map(drive: Drive, survey: Survey) -> None:
    error = ate(survey.trajectory, truth_of(drive))
    assert error.horizontal.rmse < 0.02
    assert error.horizontal.max < 0.05
    assert error.heading.max < np.deg2rad(0.6)
    assert survey.distance == pytest.approx(13.6, rel=0.03)
    assert survey.rejected_readings == 0


@pytest.mark.slow
def test_map_of_a_drive_localises_the_robot_on_another(survey: Survey) -> None:
    cloud = survey.cloud("hall")
    assert cloud.name == "hall"
    again = Drive(HALL, Pose.planar(2.4, 2.6, 0.8), (0.5, 0.0, 0.0), (5.0, 0.4, 0.3), seed=9)
    localizer = Localizer(
        prepare(cloud), MOUNTS, LocalizerConfig.of(SensorConfiguration(flat=True))
    )
    localizer.add(Hint(0, Pose.planar(2.8, 2.9, 0.95), np.zeros((6, 6))))
    estimate = None
    for reading in again.readings():
        estimate = localizer.add(reading)
    assert estimate is not None
    assert estimate.map_from_base is not None
    assert estimate.health is Health.TRACKING
    off = again.pose(estimate.stamp).inverse() @ estimate.map_from_base
    assert np.hypot(*off.position[:2]) < 0.03
    assert abs(off.yaw) < np.deg2rad(0.5)


@pytest.mark.slow
def test_map_begins_at_its_origin_by_default(
    beginning: list[Reading], here: Survey, survey: Survey
) -> None:
    first = here.trajectory.pose(0)
    assert np.hypot(*first.position[:2]) < 1e-6
    assert abs(first.yaw) < 1e-6
    there = map_drive(beginning, MOUNTS, LEVEL, start=START)
    step = START.inverse() @ there.trajectory.pose(len(there.steps) - 1)
    same = here.trajectory.pose(len(here.steps) - 1)
    assert step.position == pytest.approx(same.position, abs=1e-6)
    assert survey.trajectory.pose(0).position[:2] == pytest.approx(START.position[:2], abs=1e-6)


@pytest.mark.slow
def test_same_readings_give_the_same_bits(beginning: list[Reading], here: Survey) -> None:
    again = map_drive(beginning, MOUNTS, LEVEL).trajectory
    assert here.trajectory.positions.tobytes() == again.positions.tobytes()
    assert here.trajectory.quaternions_wxyz.tobytes() == again.quaternions_wxyz.tobytes()


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("motion", [Motion.WHEELS, Motion.GYRO, Motion.SCANNER])
def test_drive_is_followed_with_fewer_sensors(
    motion: Motion, drive: Drive, readings: list[Reading]
) -> None:
    part = readings[: len(readings) // 2]
    survey = map_drive(part, MOUNTS, SlamConfig.of(SensorConfiguration(motion)), start=START)
    error = ate(survey.trajectory, truth_of(drive))
    assert error.horizontal.max < 0.15


@pytest.mark.slow
def test_invalid_readings_are_skipped(readings: list[Reading]) -> None:
    bad = Inertial(5 * TICK, np.array([np.nan, 0.0, 0.0]), np.array([0.0, 0.0, 9.81]))
    survey = map_drive([*readings[:900], bad, *readings[900:1500]], MOUNTS, LEVEL)
    assert survey.rejected_readings == 1
    assert np.isfinite(survey.trajectory.positions).all()


def test_log_without_scans_makes_no_map(readings: list[Reading]) -> None:
    blind = [r for r in readings if not isinstance(r, Scan)]
    with pytest.raises(MappingError, match="no sweeps of a horizontal scanner"):
        map_drive(blind, MOUNTS, LEVEL)


def test_vertical_scanner_alone_makes_no_map(readings: list[Reading]) -> None:
    only = [r for r in readings if not (isinstance(r, Scan) and r.scanner == "laser_horizontal")]
    with pytest.raises(MappingError, match="no sweeps of a horizontal scanner"):
        map_drive(only[:2000], MOUNTS, LEVEL)


def test_robot_that_hardly_moved_makes_no_map(readings: list[Reading]) -> None:
    with pytest.raises(
        MappingError, match=r"moved only 0\.\d m; a map needs a drive of at least 2 m"
    ):
        map_drive(readings[:250], MOUNTS, LEVEL)


@pytest.mark.parametrize("twist", [0.3, 3.0])
def test_scanner_that_turns_otherwise_than_the_gyro_does_not_bend_the_drive(
    twist: float, drive: Drive, readings: list[Reading], monkeypatch: pytest.MonkeyPatch
) -> None:
    """For two seconds KISS-ICP turns by some tenths of a degree, or by degrees, too much with each sweep."""
    honest = KissOdometry.add

    def twisted(
        self: KissOdometry, state: KissState, sweep: Sweep, motion: Pose
    ) -> tuple[KissState, ObservedMotion | None, KissView | None]:
        state, observed, view = honest(self, state, sweep, motion)
        if observed is not None and 4_000_000_000 < sweep.stamp < 6_000_000_000:
            seen, covariance = observed
            observed = (seen @ Pose.planar(0.0, 0.0, np.deg2rad(twist)), covariance)
        return state, observed, view

    monkeypatch.setattr(KissOdometry, "add", twisted)
    odometer = Odometer(MOUNTS, OdometerConfig(sensors=SensorConfiguration(flat=True)))
    part = [r for r in readings if r.stamp < 8_000_000_000]
    steps = [step for r in part if (step := odometer.add(r)) is not None]
    first = drive.pose(steps[0].sweep.stamp)
    true = first.inverse() @ drive.pose(steps[-1].sweep.stamp)
    assert abs(wrap_angle(float(steps[-1].at[2]) - true.yaw)) < np.deg2rad(1.5)
    assert np.hypot(*(steps[-1].at[:2] - true.position[:2])) < 0.08


def test_slipping_wheels_do_not_mislead_the_odometer(drive: Drive, readings: list[Reading]) -> None:
    """For a second the wheels turn at twice the speed; the scanner sees that the robot does not."""
    spun = [
        replace(r, left=2.0 * r.left, right=2.0 * r.right)
        if isinstance(r, WheelSpeeds) and 4_000_000_000 < r.stamp < 5_000_000_000
        else r
        for r in readings[: len(readings) // 2]
    ]
    odometer = Odometer(MOUNTS, OdometerConfig(sensors=SensorConfiguration(flat=True)))
    steps = [step for r in spun if (step := odometer.add(r)) is not None]
    first = drive.pose(steps[0].sweep.stamp)
    for step in steps:
        true = first.inverse() @ drive.pose(step.sweep.stamp)
        assert np.hypot(*(step.pose.position - true.position)[:2]) < 0.06
