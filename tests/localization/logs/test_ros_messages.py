from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from localization.logs.laser_scan_message import scan_message
from localization.logs.motion_messages import (
    inertial_message,
    read_inertial,
    read_wheels,
    wheels_message,
)
from localization.logs.pose_messages import hint_message, mounts_message, read_hint, read_mounts
from localization.logs.ros_messages import readers, reading_message
from localization.logs.ros_types import (
    IMU,
    TF,
    MessageError,
    from_cdr,
    quaternion_message,
    stamp_message,
    to_cdr,
)
from localization.types import Hint, Inertial, InvalidReadingError, Pose, Reading, Scan, WheelSpeeds
from tests.support import MOUNTS, a_scan, bits, floats, poses, readings, scans, wheel_speeds


@given(reading=readings())
def test_readings_are_restored_from_cdr_bit_for_bit(reading: Reading) -> None:
    message = reading_message(reading)
    again = from_cdr(to_cdr(message), message.__msgtype__)
    assert bits(readers()[message.__msgtype__](again)) == bits(reading)


@given(wheels=wheel_speeds(), radius=floats(0.01, 1.0))
def test_rim_speeds_are_restored_for_any_wheel_radius(wheels: WheelSpeeds, radius: float) -> None:
    assert read_wheels(wheels_message(wheels, radius), radius) == wheels


@given(first=poses(), second=poses())
def test_mounts_are_restored_bit_for_bit(first: Pose, second: Pose) -> None:
    mounts = {"laser_horizontal": first, "mast/laser": second}
    message = from_cdr(to_cdr(mounts_message(mounts)), TF)
    again = read_mounts(message)
    assert {k: bits(v) for k, v in again.items()} == {k: bits(v) for k, v in mounts.items()}


def test_frames_not_on_the_base_are_no_mounts() -> None:
    message = mounts_message(MOUNTS)
    message.transforms[1].header.frame_id = "map"
    assert list(read_mounts(message)) == ["laser_horizontal"]


@given(scan=scans())
def test_scan_message_holds_what_ros_expects(scan: Scan) -> None:
    message = scan_message(scan)
    assert message.header.frame_id == scan.scanner
    assert message.ranges.dtype == np.float32
    n = len(scan.ranges)
    if n > 1:
        last = message.angle_min + (n - 1) * message.angle_increment
        assert message.angle_max == pytest.approx(last, abs=1e-9)


def test_scan_with_unequal_steps_is_rejected() -> None:
    scan = a_scan()
    for bent in (
        replace(scan, angles=scan.angles + np.array([0.0, 0.0, 1e-3])),
        replace(scan, offsets=scan.offsets + np.array([0, 0, 1000])),
        replace(scan, ranges=np.array([1.0, 0.1, 2.0])),
    ):
        with pytest.raises(MessageError, match=r"Scan\.uniform"):
            scan_message(bent)


@pytest.mark.parametrize("speed", [0.1, float("nan"), float("inf") * 0])
def test_rim_speed_that_would_change_is_rejected(speed: float) -> None:
    with pytest.raises(MessageError, match=r"wheels\.left .* float32"):
        wheels_message(WheelSpeeds(0, speed, 0.0))


def test_joint_state_is_the_angular_velocity_of_each_side() -> None:
    message = wheels_message(WheelSpeeds(1_500_000_000, 0.5, -0.25), 0.125)
    assert message.name == ["left_wheels", "right_wheels"]
    assert message.velocity.tolist() == [4.0, -2.0]
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)


def test_joint_state_without_our_wheels_is_rejected_by_name() -> None:
    message = wheels_message(WheelSpeeds(0, 0.5, 0.5))
    message.name = ["left_wheels", "gripper"]
    with pytest.raises(MessageError, match=r"joints .*gripper.* lack the velocity of right_wheels"):
        read_wheels(message)


def test_imu_message_marks_its_orientation_as_missing() -> None:
    message = inertial_message(Inertial(0, np.zeros(3), np.array([0.0, 0.0, 9.81])))
    assert message.orientation_covariance[0] == -1.0
    assert message.linear_acceleration.z == 9.81


@given(pose=poses(), sigma=st.none() | st.tuples(*[floats(1e-4, 1.0)] * 3))
def test_orientation_of_an_inertial_unit_is_restored_bit_for_bit(
    pose: Pose, sigma: tuple[float, ...] | None
) -> None:
    reading = Inertial(
        0,
        np.zeros(3),
        np.array([0.0, 0.0, 9.81]),
        pose.quaternion_wxyz,
        None if sigma is None else np.array(sigma),
    )
    again = read_inertial(from_cdr(to_cdr(inertial_message(reading)), IMU))
    if sigma is None and np.array_equal(pose.quaternion_wxyz, [1.0, 0.0, 0.0, 0.0]):
        assert again.orientation is None
    else:
        assert bits(again) == bits(reading)


@pytest.mark.parametrize(
    ("wxyz", "variance"),
    [
        ((1.0, 0.0, 0.0, 0.0), 0.0),
        ((0.0, 0.0, 0.0, 0.0), 0.0),
        ((0.0, 0.0, 0.0, 0.0), 0.1),
        ((0.6, 0.0, 0.0, 0.8), -1.0),
        ((float("nan"), 0.0, 0.0, 0.8), 0.1),
    ],
)
def test_orientation_that_no_unit_measured_is_left_out(
    wxyz: tuple[float, ...], variance: float
) -> None:
    message = inertial_message(Inertial(0, np.zeros(3), np.array([0.0, 0.0, 9.81])))
    message.orientation = quaternion_message(np.array(wxyz))
    message.orientation_covariance = np.diag([variance, 0.1 * abs(variance), 0.0]).ravel()
    assert read_inertial(message).orientation is None


def test_orientation_must_be_a_unit_quaternion_with_a_sigma_that_is_not_negative() -> None:
    zero = np.zeros(3)
    for wrong in (np.array([0.0, 0.0, 0.0, 2.0]), np.full(4, np.nan), np.zeros(3)):
        with pytest.raises(InvalidReadingError, match=r"inertial\.orientation"):
            Inertial(0, zero, zero, wrong)
    unit = np.array([1.0, 0.0, 0.0, 0.0])
    with pytest.raises(InvalidReadingError, match=r"orientation_sigma must be >= 0"):
        Inertial(0, zero, zero, unit, np.array([0.1, -0.1, 0.1]))


def test_hint_has_ros_quaternion_order_and_must_be_in_map() -> None:
    message = hint_message(Hint(0, Pose.planar(1.0, 2.0, np.pi), np.zeros((6, 6))))
    assert message.pose.pose.orientation.z == 1.0
    message.header.frame_id = "odom"
    with pytest.raises(MessageError, match="'odom'"):
        read_hint(message)


@pytest.mark.parametrize("stamp", [-1, 2**31 * 10**9])
def test_stamp_that_ros_cannot_hold_is_rejected(stamp: int) -> None:
    with pytest.raises(MessageError, match="stamp must be"):
        stamp_message(stamp)
