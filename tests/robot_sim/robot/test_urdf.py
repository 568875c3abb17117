"""URDF of each platform, as MuJoCo, which reads URDF too, understands it."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest

from localization.types import Pose
from robot_sim.robot.camera_mount import camera_frames
from robot_sim.robot.mujoco_body import WHEELS
from robot_sim.robot.platforms import P3AT, PLATFORMS
from robot_sim.robot.skid_steer_parameters import SkidSteer
from robot_sim.robot.urdf import urdf
from robot_sim.validation.drive_bench import DriveBench
from tests.robot_sim.driving import state_of

robots = pytest.mark.parametrize("robot", PLATFORMS.values(), ids=PLATFORMS)
COMPILER = (
    '<mujoco><compiler fusestatic="false" discardvisual="true" balanceinertia="true"/></mujoco>'
)


def compiled(robot: SkidSteer) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the model that MuJoCo makes of the URDF, with base_link at the origin."""
    text = urdf(robot, robot.mounts).replace("</robot>", COMPILER + "</robot>")
    model = mujoco.MjModel.from_xml_string(text)
    data = state_of(model)
    return model, data


def extent(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> np.ndarray:
    """Return lowest and highest coordinates (2, 3) of the geoms of a body, wheels across the robot."""
    corners = []
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] == body:
            half = np.abs(data.geom_xmat[geom].reshape(3, 3)) @ _half_size(model, geom)
            corners += [data.geom_xpos[geom] - half, data.geom_xpos[geom] + half]
    return np.array([np.min(corners, axis=0), np.max(corners, axis=0)])


def _half_size(model: mujoco.MjModel, geom: int) -> np.ndarray:
    size = model.geom_size[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return np.array([size[0], size[0], size[1]])
    return np.array(size)


@robots
def test_links_lie_where_the_simulated_robot_has_them(robot: SkidSteer) -> None:
    bench = DriveBench(robot)
    simulated = mujoco.MjData(bench.model)
    simulated.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    mujoco.mj_kinematics(bench.model, simulated)
    model, data = compiled(robot)
    for wheel in WHEELS:
        place = data.body(f"{wheel}_wheel").xpos
        np.testing.assert_allclose(place, simulated.body(wheel).xpos, atol=1e-6)
    for name, mount in {**robot.mounts, "imu_link": robot.imu_mount}.items():
        found = Pose.from_rotation(data.body(name).xpos, data.body(name).xmat.reshape(3, 3))
        apart = mount.inverse() @ found
        assert np.abs(apart.position).max() < 1e-6
        assert np.abs(apart.rotation - np.eye(3)).max() < 1e-6
    names = {model.body(k).name for k in range(model.nbody)}
    assert names >= {"laser_horizontal", "laser_vertical", "imu_link"}


@robots
def test_shapes_have_the_size_of_the_robot(robot: SkidSteer) -> None:
    model, data = compiled(robot)
    low, high = extent(model, data, model.body("front_left_wheel").id)
    expected = [2 * robot.wheel_radius, 2 * robot.wheel_half_width, 2 * robot.wheel_radius]
    np.testing.assert_allclose(high - low, expected, atol=1e-6)
    assert high[1] == pytest.approx(robot.half_width, abs=1e-6)
    base = model.body("front_left_wheel").parentid[0]
    low, high = extent(model, data, int(base))
    assert high[0] - low[0] == pytest.approx(robot.length, abs=1e-6)
    assert low[2] == pytest.approx(robot.clearance, abs=1e-6)


def test_wheels_turn_about_the_axle_so_that_the_robot_goes_ahead() -> None:
    model, data = compiled(P3AT())
    assert model.njnt == 4
    for k in range(4):
        np.testing.assert_allclose(data.xaxis[k], [0.0, 1.0, 0.0], atol=1e-9)


def test_only_the_scanners_that_are_carried_have_links() -> None:
    robot = P3AT()
    text = urdf(robot, {"laser_horizontal": robot.mounts["laser_horizontal"]})
    assert 'link name="laser_horizontal"' in text
    assert "laser_vertical" not in text
    assert text.isascii()


@robots
def test_the_camera_is_described_only_where_there_is_one(robot: SkidSteer) -> None:
    links = {link.get("name") for link in ET.fromstring(urdf(robot, robot.mounts)).iter("link")}
    root = ET.fromstring(urdf(robot, robot.mounts, camera=Pose.identity()))
    frames = camera_frames(robot)

    assert links.isdisjoint(frames)
    assert {link.get("name") for link in root.iter("link")} == links | set(frames)
    for name, pose in frames.items():
        joint = next(j for j in root.iter("joint") if j.find("child").get("link") == name)  # type: ignore[union-attr]
        origin = joint.find("origin")
        assert origin is not None
        place, angles = ([float(v) for v in origin.get(k, "").split()] for k in ("xyz", "rpy"))
        described = Pose.from_euler(place, roll=angles[0], pitch=angles[1], yaw=angles[2])
        np.testing.assert_allclose(described.position, pose.position, atol=1e-9)
        np.testing.assert_allclose(described.rotation, pose.rotation, atol=1e-8)
