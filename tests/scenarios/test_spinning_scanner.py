"""A scanner of many planes in a simulated scene, from rays through a ROS 2 bag to where the robot is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from localization.evaluation.consistency import consistency, nees
from localization.evaluation.localization_history import History
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.trajectory_errors import ate, errors
from localization.logs.frame_tree import SensorLayout
from localization.logs.motion_messages import WHEEL_RADIUS
from localization.logs.ros_messages import reading_message
from localization.logs.ros_types import IMU, JOINT_STATE, POINT_CLOUD, TYPES, to_cdr
from localization.pipeline.log_replay import LogRun
from localization.types import SECOND, Health, Inertial, PointScan, Pose, Twist, WheelSpeeds
from robot_sim import Simulation, SimulationConfig, load_world
from robot_sim.survey.total_station import TotalStation
from teleop.scenario.tour_driver import TourDriver
from teleop.scene_clouds import scene_cloud_path

PLANES, COLUMNS = 16, 1800
"""As a VLP-16 has at 10 Hz: 28 800 points in each turn."""
TURN = SECOND // 10
MOUNT = Pose.from_euler([0.1, 0.0, 0.45], pitch=0.02, yaw=0.3)
NOISE = 0.02
"""Of a range, one sigma [m]; data sheet of such scanners: 3 cm."""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def drive(path: Path, seconds: float) -> Trajectory:
    """Drive the office's tour and record it as a robot with such a scanner would; return the truth."""
    world = load_world("office")
    simulation = Simulation(world, seed=3, config=SimulationConfig(scanners=()))
    station, driver = TotalStation(world), TourDriver(world.tour)
    elevation = np.tile(np.deg2rad(np.linspace(-15.0, 15.0, PLANES)), COLUMNS)
    azimuth = np.repeat(np.linspace(-np.pi, np.pi, COLUMNS, endpoint=False), PLANES)
    level = np.cos(elevation)
    beams = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)
    offsets = np.repeat(np.arange(COLUMNS, dtype=np.int64) * (TURN // COLUMNS), PLANES)
    rng = np.random.default_rng(1)
    truth = simulation.truth()
    poses = [(truth.stamp, truth.map_from_base)]
    begun = 0
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {
            Inertial: ("/imu", IMU),
            WheelSpeeds: ("/joint_states", JOINT_STATE),
            PointScan: ("/velodyne_points", POINT_CLOUD),
        }
        lines = {
            kind: writer.add_connection(topic, message, typestore=TYPES)
            for kind, (topic, message) in topics.items()
        }
        while simulation.stamp < seconds * SECOND:
            drives = simulation.stamp > SECOND
            command = driver.command(truth.map_from_base, Health.TRACKING)
            simulation.command(command if drives else Twist.planar(0.0, 0.0))
            readings = list(simulation.step())
            truth = simulation.truth()
            poses.append((truth.stamp, truth.map_from_base))
            if simulation.stamp >= begun + TURN:
                position, rotation = Trajectory.from_poses(poses[-100:]).at(begun + offsets)
                eyes = position + rotation @ MOUNT.position
                ways = np.einsum("nij,nj->ni", rotation, beams @ MOUNT.rotation.T)
                far = station.look(eyes, ways, 40.0).distances
                far += NOISE * rng.standard_normal(len(far))
                hit = np.isfinite(far) & (far > 0.4)
                points = (far[hit, None] * beams[hit]).astype(np.float32).astype(float)
                readings.append(PointScan(begun, "velodyne", points, offsets[hit]))
                begun += TURN
            for reading in readings:
                message = reading_message(reading, WHEEL_RADIUS)
                writer.write(lines[type(reading)], simulation.stamp, to_cdr(message))
    return Trajectory.from_poses(poses)


@pytest.mark.long
def test_scanner_of_sixteen_planes_is_localised_to_a_centimetre(tmp_path: Path) -> None:
    truth = drive(tmp_path / "bag", 6.0)
    layout = SensorLayout(mounts={"velodyne": MOUNT})
    start = truth.pose(0) @ Pose.planar(0.5, -0.4, 0.2)
    run = LogRun(tmp_path / "bag", scene_cloud_path("office"), layout=layout, start=start)
    history = History()
    sizes = []
    for estimate in run:
        history.add(estimate)
        if estimate.sweep is not None:
            sizes.append(len(estimate.sweep.points))
    known = history.trajectory()
    settled = known.take(slice(int(np.searchsorted(known.stamps, 2 * SECOND)), None))
    assert ate(settled, truth).position.rmse < 0.01
    covariances = history.covariances()[-len(settled) :][: len(errors(settled, truth).vectors)]
    found = consistency(nees(errors(settled, truth).vectors, covariances), 6)
    assert found.mean_ratio < 2.0
    assert len(sizes) > 50
    assert max(sizes) <= 2000
