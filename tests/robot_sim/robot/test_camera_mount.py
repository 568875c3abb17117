from __future__ import annotations

import numpy as np
import pytest

from robot_sim.cameras import CAMERAS
from robot_sim.robot.camera_mount import CAMERA_LINK, DEPTH_FRAME, RGB_FRAME, camera_frames
from robot_sim.robot.platforms import PLATFORMS
from robot_sim.robot.skid_steer_parameters import SkidSteer

robots = pytest.mark.parametrize("robot", PLATFORMS.values(), ids=PLATFORMS)


@robots
def test_optical_frames_look_forward_with_x_right_and_y_down(robot: SkidSteer) -> None:
    frames = camera_frames(robot)

    assert list(frames) == [CAMERA_LINK, RGB_FRAME, DEPTH_FRAME]
    np.testing.assert_allclose(frames[CAMERA_LINK].rotation, np.eye(3), atol=1e-12)
    for name in (RGB_FRAME, DEPTH_FRAME):
        # Columns: x, y and z of the optical frame in base_link (REP 103).
        axes = np.column_stack([(0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
        np.testing.assert_allclose(frames[name].rotation, axes, atol=1e-12)
        np.testing.assert_array_equal(frames[name].position, frames[CAMERA_LINK].position)


@robots
def test_the_camera_is_carried_above_the_horizontal_scanner(robot: SkidSteer) -> None:
    scanner, camera = robot.mounts["laser_horizontal"].position, robot.camera_mount.position

    assert camera[1] == scanner[1] == 0.0
    # The housing reaches 6 cm above the scanner's own origin, and 5 cm forward of it.
    assert camera[2] > scanner[2] + 0.06
    assert camera[0] < scanner[0] + 0.05


@robots
def test_the_camera_of_an_arm_looks_at_the_floor_before_the_bumper(robot: SkidSteer) -> None:
    eye = camera_frames(robot, CAMERAS["arm"].place)[RGB_FRAME]
    # Where the optical axis meets the floor, in base_link.
    axis = eye.rotation[:, 2]
    ahead, left, _ = eye.position - axis * eye.position[2] / axis[2]

    assert ahead > 0.5 * robot.length + 0.1
    assert abs(left) < 0.1
