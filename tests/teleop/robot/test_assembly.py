"""The robot is the same whether its parts run in one thread or in processes of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from localization.maps.cloud import Cloud
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from localization.types import Hint, Inertial, Pose, Twist
from robot_sim import World
from teleop.joystick import VelocityRequest
from teleop.robot.assembly import RobotParts, build_drive, build_stepped_robot
from teleop.robot.estimation import Estimation
from teleop.robot.inbox import DriveCommand, InboxMessage, PoseHint
from teleop.robot.serving.serve_config import ServeConfig


def bits(pose: Pose | None) -> bytes:
    return b"" if pose is None else pose.position.tobytes() + pose.quaternion_wxyz.tobytes()


@pytest.mark.slow
def test_parts_apart_do_the_same_to_the_bit_as_a_robot_in_one_thread(
    office: World, office_cloud: Cloud, cache: Path
) -> None:
    config = ServeConfig(port=0, lockstep=True, seed=3, slip=(0.3,))
    parts, prepared = RobotParts.of(office, config), prepare(office_cloud, cache=cache)
    stepped = build_stepped_robot(parts, office_cloud, prepared, config)
    drive = build_drive(parts)
    estimation = Estimation(Localizer(prepared, drive.simulation.mounts))
    start = drive.simulation.truth().map_from_base
    hint, inbox = PoseHint("", Hint(0, start, np.zeros((6, 6)))), list[InboxMessage]()
    stepped.inbox = lambda: inbox
    for number in range(30):
        twist = Twist.planar(0.0 if number < 2 else 0.4, 0.0)
        command = DriveCommand("driver", VelocityRequest(twist, enabled=True))
        inbox = [hint, command] if number == 0 else [command]
        together, apart = stepped.tick(), drive.tick(drive.simulation.stamp, inbox)
        estimated = estimation.take(apart)
        assert bits(together.truth.map_from_base) == bits(apart.truth.map_from_base)
        assert bits(together.estimate.map_from_base) == bits(estimated.estimate.map_from_base)
    moved = apart.truth.map_from_base.position - start.position
    assert np.linalg.norm(moved) > 0.03
    assert together.estimate.map_from_base is not None


def test_settings_of_serve_reach_the_drive(office: World) -> None:
    drive = build_drive(RobotParts.of(office, ServeConfig(seed=7, max_age=0.25, slow_age=0.1)))
    assert drive.safety.config.stale == ServeConfig(max_age=0.25, slow_age=0.1).stale_limits
    other = build_drive(RobotParts.of(office, ServeConfig(seed=8)))
    one, two = (
        next(r.angular_velocity for r in robot.tick(0, []).sensed if isinstance(r, Inertial))
        for robot in (drive, other)
    )
    assert not np.array_equal(one, two)
