"""Logs of other people's robots, mapped from the command line and localised in their own maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import ate
from localization.evaluation.tum_file import read_tum
from localization.maps.map_files import load_cloud
from localization.pipeline.log_replay import localize
from localization.types import Pose
from teleop.__main__ import main
from tests.localization.logs.test_carmen_log import flaser
from tests.localization.logs.test_ros_bag import recorded, ros2
from tests.support_rooms import HALL, MOUNTS, Drive

pytest.importorskip("open3d", reason="building maps needs Open3D")

START = Pose.planar(4.0, 1.6, 0.0)
DRIVE = Drive(HALL, START, (0.6, 0.0, 0.0), (21.0, 0.5, 1.0 / 3.0), noise=0.012, seed=3)
"""A rest, and a circle of 1.5 m radius about the hall's middle and a little farther."""
EPOCH = 976052857_000000000
AT = ("--start", "4", "1.6", "0")


def carmen(path: Path) -> Path:
    """A text of scans and of odometry that is 2 % wrong and began elsewhere."""
    lines = []
    for stamp in range(0, DRIVE.end + 1, 100_000_000):
        step = DRIVE.pose(0).inverse() @ DRIVE.pose(stamp)
        way = Pose.planar(1.02 * step.position[0], 1.02 * step.position[1], 1.02 * step.yaw)
        odom = Pose.planar(9.0, 4.0, 1.0) @ way
        seconds = (EPOCH + stamp) * 1e-9
        lines.append(flaser(HALL, DRIVE.pose(stamp), odom, seconds))
        x, y, yaw = odom.position[0], odom.position[1], odom.yaw
        lines.append(f"ODOM {x:.6f} {y:.6f} {yaw:.6f} 0.5 0.3 0.0 {seconds + 0.01:.6f} robot 1.0")
    path.write_text("\n".join(lines) + "\n")
    return path


def worst(drive: Trajectory, *, epoch: int = 0) -> float:
    """Root mean square of the horizontal error of a drive, moved to its best fit [m]."""
    stamps = drive.stamps - epoch
    shifted = Trajectory(stamps, drive.positions, drive.quaternions_wxyz)
    truth = Trajectory.from_poses((stamp, DRIVE.pose(stamp)) for stamp in stamps.tolist())
    return ate(shifted, truth, aligned=True).horizontal.rmse


@pytest.mark.slow
def test_carmen_text_is_mapped_and_localised_in_its_own_map(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A level scanner sees walls at one height: they are taken to stand upright, and serve as a map."""
    log, out = carmen(tmp_path / "hall.log"), tmp_path / "map.ply"
    assert main(["map", str(log), *AT, "--out", str(out)]) == 0
    assert worst(read_tum(out.with_suffix(".tum")), epoch=EPOCH) < 0.02
    # The odometry began elsewhere, and so, for all that it shows, did the drive.
    (note,) = [line for line in capsys.readouterr().out.splitlines() if str(log) in line]
    assert "begins in the middle of a drive: its odometry starts at 9.00 4.00 m" in note
    cloud = load_cloud(out)
    assert np.abs(cloud.normals[:, 2]).max() < 0.05
    assert np.ptp(cloud.points[:, 2]) > 1.0
    done = localize(log, out, start=START @ Pose.planar(0.1, -0.1, 0.05), cache=None)
    known = [e for e in done.estimates if e.map_from_base is not None]
    estimate = Trajectory.from_estimates(known)
    assert worst(estimate.take(slice(20, None)), epoch=EPOCH) < 0.02


@pytest.mark.slow
def test_ros_2_bag_without_frames_is_mapped_with_the_mount_that_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held = recorded(DRIVE.readings())[1:]
    bag, out = ros2(tmp_path / "bag", held, StoragePlugin.SQLITE3), tmp_path / "map.ply"
    words = ["map", str(bag), *AT, "--out", str(out)]
    assert main(words) == 2
    assert (
        "pose of 'laser_horizontal' (of /front/scan) on 'base_link' is unknown"
        in capsys.readouterr().err
    )
    x, _, z = MOUNTS["laser_horizontal"].position
    words += ["--mount", "laser_horizontal", str(x), "0", str(z), "0"]
    words += ["--topics", "/front/scan", "/joints"]
    assert main(words) == 0
    assert worst(read_tum(out.with_suffix(".tum"))) < 0.02
