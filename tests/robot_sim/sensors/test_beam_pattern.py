"""Beams of a sweep against rotating each of them on its own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.types import Pose
from robot_sim.robot.p3at import MOUNTS
from robot_sim.sensors.beam_pattern import BeamPattern
from robot_sim.sensors.pose_history import PoseHistory, PoseRecorder
from robot_sim.sensors.scanner_config import ScannerConfig

STEP = 4_000_000


def drive(turn: float, steps: int = 40) -> PoseHistory:
    """A track of somebody who sways while driving a curve; begins at step 10."""
    stamps = STEP * np.arange(10, 10 + steps)
    poses = [
        Pose.from_euler(
            (0.7 * t, 0.1 * t, 0.0), roll=0.05 * np.sin(9.0 * t), pitch=0.1, yaw=turn * t
        )
        for t in 1e-9 * stamps
    ]
    positions = np.array([p.position for p in poses])
    return PoseHistory(stamps, positions, np.array([p.quaternion_wxyz for p in poses]))


@pytest.mark.parametrize("scanner", sorted(MOUNTS))
@given(turn=st.floats(-2.5, 2.5), late=st.integers(0, 20 * STEP))
def test_beams_start_and_point_where_the_scanner_was_at_their_times(
    scanner: str, turn: float, late: int
) -> None:
    mount, track = MOUNTS[scanner], drive(turn)
    pattern = ScannerConfig(scanner, period_ns=100_000_000).scan(0, np.zeros(541))
    start = min(10 * STEP + late, int(track.stamps[-1] - pattern.offsets[-1]))
    beams = BeamPattern(mount, pattern.angles, pattern.offsets)
    origins, directions = beams.rays(track, start)
    positions, rotations = track.at(start + pattern.offsets)
    fan = np.stack([np.cos(pattern.angles), np.sin(pattern.angles), 0.0 * pattern.angles], axis=1)
    expected = np.einsum("nij,nj->ni", rotations, fan @ mount.rotation.T)
    np.testing.assert_allclose(origins, positions + rotations @ mount.position, atol=5e-6)
    np.testing.assert_allclose(directions, expected, atol=6e-6)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-9)
    again, axes = beams.axes(track, start)
    np.testing.assert_array_equal(again, origins)
    np.testing.assert_array_equal(axes[:, :, 0], directions)
    flat, one = 0.0 * pattern.angles, 1.0 + 0.0 * pattern.angles
    left = np.stack([-np.sin(pattern.angles), np.cos(pattern.angles), flat], axis=1)
    across = np.stack([left, np.stack([flat, flat, one], axis=1)], axis=2)
    expected = rotations @ mount.rotation @ across
    np.testing.assert_allclose(axes[:, :, 1:], expected, atol=1e-5)


def test_sweep_may_end_with_the_last_step() -> None:
    track = drive(1.0, steps=20)
    offsets = np.linspace(0, 19 * STEP, 77).astype(np.int64)
    origins, _ = BeamPattern(Pose.identity(), np.zeros(77), offsets).rays(track, 10 * STEP)
    np.testing.assert_allclose(origins[[0, -1]], track.positions[[0, -1]], atol=1e-12)


def test_recorder_keeps_the_poses_that_coming_sweeps_need() -> None:
    trail = PoseRecorder(0, np.zeros(7))
    for tick in range(400):
        stamps = STEP * np.arange(5 * tick + 1, 5 * tick + 6)
        trail.extend(stamps, np.tile(1e-6 * stamps[:, None], (1, 7)))
        oldest = max(0, int(stamps[-1]) - 700 * STEP - 1)
        trail.forget(oldest)
        track = trail.track()
        assert track.stamps[0] <= oldest
        assert oldest - track.stamps[0] < STEP
        assert track.stamps[-1] == stamps[-1]
        np.testing.assert_array_equal(np.diff(track.stamps), STEP)
        np.testing.assert_array_equal(track.positions[:, 0], 1e-6 * track.stamps)
        np.testing.assert_array_equal(track.quaternions_wxyz[:, 3], 1e-6 * track.stamps)
