from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from localization.errors import LocalizationError
from localization.motion.kiss_icp import KissConfig
from localization.motion.kiss_odometry import KissOdometry, KissState, KissView
from localization.types import Pose, Sweep
from tests.support import bits, floats
from tests.support_rooms import CORRIDOR, HALL, Place, apart

RIGHT = Pose.identity()
ROOT = Path(__file__).parents[3]


def still(points: np.ndarray) -> Sweep:
    n = len(points)
    return Sweep(0, points, np.zeros((n, 3)), np.ones(n, dtype=bool))


class Odometry:
    """Laser odometry that keeps its newest state."""

    def __init__(self, config: KissConfig = KissConfig()) -> None:  # noqa: B008  (frozen)
        self.steps, self.state = KissOdometry(config), KissState()
        self.view: KissView | None = None

    def add(self, sweep: Sweep, motion: Pose) -> tuple[Pose, np.ndarray] | None:
        self.state, observed, self.view = self.steps.add(self.state, sweep, motion)
        return observed


def walk(
    odometry: Odometry, place: Place, poses: list[Pose], *, wrong: Pose = RIGHT
) -> Iterator[tuple[Pose, Pose, np.ndarray]]:
    """Yield true and observed motion between the poses, seeded with the true one times a wrong one."""
    before = poses[0]
    assert odometry.add(place.sweep(before), Pose.identity()) is None
    for i, pose in enumerate(poses[1:]):
        motion = before.inverse() @ pose
        seen = odometry.add(place.sweep(pose, noise=0.01, seed=i), motion @ wrong)
        assert seen is not None
        yield motion, *seen
        before = pose


def arc(n: int = 25) -> list[Pose]:
    return [
        Pose.planar(3.0 + 2.0 * np.sin(0.04 * i), 3.5 - 2.0 * np.cos(0.04 * i), 0.04 * i)
        for i in range(n)
    ]


def test_known_motion_is_followed() -> None:
    here = there = arc()[0]
    for true, seen, covariance in walk(Odometry(), HALL, arc()):
        here, there = here @ true, there @ seen
        assert apart(true, seen)[0] < 0.03
        assert apart(true, seen)[1] < np.deg2rad(0.8)
        assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    assert np.linalg.norm(here.position - arc()[0].position) > 1.5
    distance, turn = apart(here, there)
    assert distance < 0.05
    assert turn < np.deg2rad(1.0)


def test_wrong_seed_is_corrected() -> None:
    wrong = Pose.planar(0.08, -0.05, np.deg2rad(2.0))
    for true, seen, _ in walk(Odometry(), HALL, arc(8), wrong=wrong):
        assert apart(true, seen)[0] < 0.04
        assert apart(true, seen)[1] < np.deg2rad(1.0)


def test_motion_is_planar_whatever_the_seed() -> None:
    tilted = Pose.from_euler([0.0, 0.0, 0.2], roll=0.02, pitch=-0.03)
    for _, seen, _ in walk(Odometry(), HALL, arc(4), wrong=tilted):
        roll, pitch, _ = seen.euler
        assert (seen.position[2], roll, pitch) == (0.0, 0.0, 0.0)


def test_covariance_covers_the_error() -> None:
    squares = []
    for true, seen, covariance in walk(Odometry(), HALL, arc()):
        step = true.inverse() @ seen
        e = np.array([*step.position[:2], step.yaw])
        squares.append(e @ np.linalg.solve(covariance, e))
    # Three degrees of freedom: 3 is consistent, more is overconfident, less is conservative.
    assert 0.3 < np.mean(squares) < 6.0


@given(yaw=floats(-3.1, 3.1))
@settings(max_examples=15)
def test_covariance_is_large_along_a_corridors_axis_only(yaw: float) -> None:
    poses = [Pose.planar(0.1 * i, 0.2, yaw) for i in range(3)]
    for _, _, covariance in walk(Odometry(), CORRIDOR, poses):
        along = np.array([np.cos(yaw), -np.sin(yaw), 0.0])
        across = np.array([np.sin(yaw), np.cos(yaw), 0.0])
        assert np.sqrt(along @ covariance @ along) > 1.0
        # What is left once the wheels say how far the robot went along it, to 2 cm.
        joint = np.linalg.inv(np.linalg.inv(covariance) + np.outer(along, along) / 0.02**2)
        assert np.sqrt(across @ joint @ across) < 0.01
        assert np.sqrt(joint[2, 2]) < np.deg2rad(0.5)


@pytest.mark.parametrize("n", [0, 1, 29])
def test_too_few_points_are_no_motion_but_the_seed_is_kept(n: int) -> None:
    odometry = Odometry()
    poses = [Pose.planar(3.0 + 0.1 * i, 3.0, 0.0) for i in range(3)]
    step = Pose.planar(0.1, 0.0, 0.0)
    odometry.add(HALL.sweep(poses[0]), Pose.identity())
    assert odometry.add(still(np.ones((n, 3))), step) is None
    seen = odometry.add(HALL.sweep(poses[2]), step)
    assert seen is not None
    assert apart(seen[0], step)[0] < 0.02


def test_points_of_the_vertical_scanner_do_not_count() -> None:
    sweep = HALL.sweep(Pose.planar(3.0, 3.0, 0.0))
    blind = Sweep(0, sweep.points, sweep.origins, np.zeros(len(sweep.points), dtype=bool))
    odometry = Odometry()
    assert odometry.add(sweep, Pose.identity()) is None
    assert odometry.add(blind, Pose.identity()) is None
    assert odometry.add(sweep, Pose.identity()) is not None


DEGENERATE = {
    "none": np.zeros((0, 3)),
    "all alike": np.ones((100, 3)),
    "all at the robot": np.zeros((100, 3)),
    "in a line": np.linspace([1.0, 0.0, 0.0], [5.0, 0.0, 0.0], 100),
    "far away": np.full((100, 3), 1e4),
    "far apart": np.linspace([-900.0, 40.0, 0.0], [900.0, 40.0, 0.0], 50),
}


@pytest.mark.parametrize("points", DEGENERATE.values(), ids=DEGENERATE)
def test_degenerate_sweeps_give_finite_answers(points: np.ndarray) -> None:
    odometry = Odometry()
    for _ in range(3):
        seen = odometry.add(still(points), Pose.planar(0.1, 0.0, 0.1))
        if seen is not None:
            assert np.isfinite(seen[1]).all()
            assert (np.linalg.eigvalsh(seen[1]) > 0.0).all()


STORY = """
from localization.matching.kiss_matcher import KissMatcher
from localization.motion.kiss_odometry import KissOdometry, KissState
from localization.types import Pose
from tests.support_rooms import HALL
odometry, state, matcher = KissOdometry(), KissState(), KissMatcher(HALL.cloud())
for i in range(12):
    pose = Pose.planar(3.0 + 0.1 * i, 3.0, 0.05 * i)
    sweep = HALL.sweep(pose, noise=0.01, seed=i)
    state, seen, _ = odometry.add(state, sweep, Pose.planar(0.07, 0.01, 0.03))
    other = matcher.locate(sweep, pose @ Pose.planar(0.1, 0.05, 0.03))
    print(other.position.tobytes().hex(), other.quaternion_wxyz.tobytes().hex())
    if seen:
        print(seen[0].position.tobytes().hex(), seen[1].tobytes().hex())
"""


def printed(**environment: str) -> str:
    """What a fresh process makes of the story, bit by bit."""
    ran = subprocess.run(
        [sys.executable, "-c", STORY],
        cwd=ROOT,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert len(ran.stdout.split()) == 12 * 2 + 11 * 2
    return ran.stdout


@pytest.fixture(scope="module")
def usual() -> str:
    return printed()


@pytest.mark.slow
def test_environment_does_not_configure_kiss(usual: str) -> None:
    settings = {
        "kiss_icp_data": '{"max_range": 1.0, "deskew": true}',
        "kiss_icp_mapping": '{"voxel_size": 3.0}',
        "kiss_icp_registration": '{"max_num_iterations": 1, "max_num_threads": 4}',
    }
    assert printed(**settings) == usual


def test_settings_are_those_of_the_configuration() -> None:
    """One iteration from a poor seed does not get there; so the configuration does reach KISS-ICP."""
    wrong = Pose.planar(0.15, -0.1, 0.03)
    results = {}
    for iterations in (1, 60):
        odometry = Odometry(KissConfig(iterations=iterations))
        ((true, seen, _),) = walk(odometry, HALL, arc(2), wrong=wrong)
        results[iterations] = apart(true, seen)[0]
    assert results[60] < 0.04 < results[1]


@pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
def test_near_walls_of_a_corridor_say_nothing_of_the_way_along_it(step: float) -> None:
    odometry, seen = Odometry(), None
    angles = np.deg2rad(np.arange(-135.0, 135.1, step))
    for i in range(3):
        noise = 0.012 * np.random.default_rng(i).standard_normal(len(angles))
        far = np.minimum(1.1 / np.maximum(np.abs(np.sin(angles)), 1e-9), 30.0)
        far = (far + noise)[far < 20.0]
        bearing = angles[np.abs(np.sin(angles)) > 1.1 / 20.0][: len(far)]
        points = np.stack([far * np.cos(bearing), far * np.sin(bearing), 0.0 * far], axis=1)
        sweep = Sweep(i, points, np.zeros_like(points), np.ones(len(points), dtype=bool))
        seen = odometry.add(sweep, Pose.planar(0.06, 0.0, 0.0))
    assert seen is not None
    forward, side, yaw = np.sqrt(np.diag(seen[1]))
    assert forward > 1.0
    assert side < 0.03
    assert yaw < np.deg2rad(1.0)


def test_odometry_goes_on_from_an_earlier_state_bit_for_bit() -> None:
    """Also where another local map has been built since, and one with many layers."""
    poses, odometry = arc(30), Odometry()
    sweeps = [HALL.sweep(pose, noise=0.01, seed=i) for i, pose in enumerate(poses)]
    step = poses[0].inverse() @ poses[1]
    states, wanted = [], []
    for sweep in sweeps:
        states.append(odometry.state)
        wanted.append(odometry.add(sweep, step))
    for begin in (4, 17, 11):
        odometry.state = states[begin]
        for sweep, expected in zip(sweeps[begin : begin + 13], wanted[begin:], strict=False):
            observed = odometry.add(sweep, step)
            assert observed is not None
            assert expected is not None
            assert bits(observed[0]) == bits(expected[0])
            assert bits(observed[1]) == bits(expected[1])


def test_sweep_that_is_repeated_is_observed_as_before_and_in_its_own_map_only() -> None:
    poses, odometry = arc(14), Odometry()
    step = poses[0].inverse() @ poses[1]
    views, seen = [], []
    begun = odometry.state
    for i, pose in enumerate(poses):
        seen.append(odometry.add(HALL.sweep(pose, noise=0.01, seed=i), step))
        views.append(odometry.view)
    ended, state = odometry.state, begun
    for view, expected in zip(views, seen, strict=True):
        assert view is not None
        state, observed = odometry.steps.repeat(state, view)
        assert (observed is None) == (expected is None)
        if observed is not None and expected is not None:
            assert bits(observed[0]) == bits(expected[0])
    assert bits(state.pose) == bits(ended.pose)
    assert views[-1] is not None
    with pytest.raises(LocalizationError, match="its own local map only"):
        odometry.steps.repeat(state.restarted(), views[-1])
