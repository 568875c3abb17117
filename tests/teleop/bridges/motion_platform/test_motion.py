"""Limits of the motion base, proved by whatever input hypothesis thinks of."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from teleop.bridges.motion_platform.cueing import GRAVITY
from teleop.bridges.motion_platform.datagram import DatagramError, Receiver, pack, unpack
from teleop.bridges.motion_platform.follower import SILENCE, Follower
from teleop.bridges.motion_platform.limited_motion import (
    PERIOD,
    LimitedMotion,
    settling_time,
)
from teleop.bridges.motion_platform.platform import AXES, load_platform
from teleop.errors import SettingError
from teleop.package_data import assets

PLATFORM = load_platform("simona")
LIMITS = PLATFORM.limits
ANY = st.floats(width=64)
TARGETS = st.lists(
    st.tuples(
        arrays(np.float64, 6, elements=ANY), arrays(np.float64, 6, elements=ANY), st.integers(1, 60)
    ),
    min_size=1,
    max_size=12,
)
WITHIN = 1.0 + 1e-9


def imu(roll: float = 0.0, pitch: float = 0.0, **changes: Any) -> dict[str, Any]:
    half = np.array([roll, pitch]) / 2.0
    (cr, cp), (sr, sp) = np.cos(half), np.sin(half)
    orientation = {"x": sr * cp, "y": cr * sp, "z": -sr * sp, "w": cr * cp}
    force = GRAVITY * np.array(
        [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
    )
    message: dict[str, Any] = {
        "header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "imu_link"},
        "orientation": orientation,
        "orientation_covariance": [0.0] * 9,
        "angular_velocity": {"x": 0.0, "y": 0.0, "z": 0.0},
        "linear_acceleration": dict(zip("xyz", force, strict=True)),
    }
    return message | changes


@pytest.mark.slow
@settings(max_examples=100)
@given(targets=TARGETS)
def test_position_rate_and_acceleration_keep_their_limits_for_any_target(targets: Any) -> None:
    motion = LimitedMotion(LIMITS)
    for target, rate, periods in targets:
        for _ in range(periods):
            before, moved = motion.rate, motion.position
            motion.step(target, rate)
            assert (np.abs(motion.position) <= LIMITS.position * WITHIN).all()
            assert (np.abs(motion.rate) <= LIMITS.rate * WITHIN).all()
            assert (np.abs(motion.rate - before) <= LIMITS.acceleration * PERIOD * WITHIN).all()
            # Not numpy's `allclose`, which takes half of the test's time.
            assert np.abs(motion.position - moved - motion.rate * PERIOD).max() <= 1e-12


@pytest.mark.slow
@settings(max_examples=100)
@given(targets=TARGETS)
def test_it_is_level_and_at_rest_within_the_stated_time_from_any_state(targets: Any) -> None:
    motion = LimitedMotion(LIMITS)
    for target, rate, periods in targets:
        for _ in range(periods):
            motion.step(target, rate)
    for _ in range(int(settling_time(LIMITS) / PERIOD)):
        motion.step(np.zeros(6), np.zeros(6))
    assert np.abs(motion.position).max() < 1e-9
    assert np.abs(motion.rate).max() < 1e-9


@settings(max_examples=300)
@given(shares=arrays(np.float64, 6, elements=st.floats(-1.0, 1.0)))
def test_no_leg_leaves_its_range_within_the_limits(shares: Any) -> None:
    lengths = PLATFORM.leg_lengths(shares * LIMITS.position)
    assert lengths.min() >= PLATFORM.shortest
    assert lengths.max() <= PLATFORM.longest


def test_legs_are_as_long_as_the_published_geometry_says_and_equal_when_level() -> None:
    level = PLATFORM.leg_lengths(np.zeros(6))
    assert np.ptp(level) < 1e-12
    # Lower joint at 60 - 10.475 degrees on 1.65 m, upper one at 3.5835 degrees on 1.6 m, 2.39 m above.
    between = np.radians(60.0 - 20.95 / 2.0 - 7.167 / 2.0)
    chord = 1.65**2 + 1.6**2 - 2.0 * 1.65 * 1.6 * np.cos(between)
    assert level[0] == pytest.approx(np.sqrt(chord + 2.39**2), abs=1e-9)
    risen = PLATFORM.leg_lengths(np.array([0.0, 0.0, 0.08, 0.0, 0.0, 0.0]))
    assert (risen > level).all()


@pytest.mark.slow
@settings(max_examples=25)
@given(
    said=st.lists(
        st.tuples(ANY, ANY, ANY, ANY, st.floats(0.0, 2.0), st.booleans()), min_size=1, max_size=15
    ),
    cueing=st.sampled_from(["tilt", "washout"]),
)
def test_a_strict_receiver_accepts_all_poses_whatever_the_robot_says(
    said: Any, cueing: Any
) -> None:
    follower, receiver, now = Follower(PLATFORM, cueing, 1.0), Receiver(PLATFORM), 0.0
    for roll, pitch, turn, push, gap, stopped in said:
        follower.take_state({"estop": stopped})
        with np.errstate(all="ignore"):
            message = imu(roll, pitch)
            message["angular_velocity"]["x"] = turn
            message["linear_acceleration"]["x"] = push
            with contextlib.suppress(ValueError):
                follower.take_imu(message, now)
            for _ in range(1 + int(gap / PERIOD)):
                receiver.take(pack(follower.step(now)))
                now += PERIOD
    assert receiver.refused == 0


def follow(
    follower: Follower,
    seconds: float,
    begin: float,
    feel: Callable[[float], dict[str, Any] | None],
) -> tuple[float, list[Any]]:
    """Step with a message every second period; return the time at the end, and all poses."""
    poses, now = [], begin
    for tick in range(round(seconds / PERIOD)):
        if tick % 2 == 0 and (message := feel(now)) is not None:
            follower.take_imu(message, now)
        poses.append(follower.step(now))
        now += PERIOD
    return now, poses


def settled(follower: Follower, seconds: float, message: dict[str, Any]) -> Any:
    """Return the last pose of a follower that feels the same for a time."""
    return follow(follower, seconds, 0.0, lambda now: message)[1][-1].pose


def test_the_chair_tilts_as_the_robot_does_and_is_level_after_silence_or_an_e_stop() -> None:
    follower, now = Follower(PLATFORM, "tilt", 1.0), 0.0
    leaning = imu(0.05, -0.1)
    for _ in range(2):
        now, (*_, pose) = follow(follower, 1.5, now, lambda now: leaning)
        assert pose.following
        assert pose.pose[3:5] == pytest.approx([0.05, -0.1], abs=1e-9)
        now, (*_, pose) = follow(follower, SILENCE + settling_time(LIMITS), now, lambda now: None)
        assert not pose.following
        assert np.abs(pose.pose).max() < 1e-9
    now, _ = follow(follower, 1.5, now, lambda now: leaning)
    follower.take_state({"estop": True})
    _, (*_, pose) = follow(follower, settling_time(LIMITS), now, lambda now: leaning)
    assert np.abs(pose.pose).max() < 1e-9


def test_a_lasting_push_leans_the_chair_back_and_is_not_noticed_as_a_turn() -> None:
    pushed = imu()
    pushed["linear_acceleration"]["x"] = 0.5
    _, poses = follow(Follower(PLATFORM, "washout", 1.0), 3.0, 0.0, lambda now: pushed)
    surge, pitch = np.array([pose.pose for pose in poses])[:, [0, 4]].T
    assert pitch[-1] == pytest.approx(-np.arcsin(0.5 / GRAVITY), abs=1e-3)
    assert np.abs(np.diff(pitch)).max() < np.radians(3.0) * PERIOD
    assert surge[20] > 0.005
    assert surge[-1] == pytest.approx(0.5 / 2.5**2, abs=0.005)


def test_a_robot_that_stays_on_a_slope_is_felt_as_that_slope_by_the_washout() -> None:
    pose = settled(Follower(PLATFORM, "washout", 1.0), 6.0, imu(pitch=0.1))
    assert pose[4] == pytest.approx(0.1, abs=0.002)


def transform(parent: str, child: str, rotation: dict[str, float]) -> dict[str, Any]:
    """Return a ``tf2_msgs/TFMessage``."""
    header = {"frame_id": parent}
    one = {"header": header, "child_frame_id": child, "transform": {"rotation": rotation}}
    return {"transforms": [one]}


def test_a_unit_without_orientation_is_followed_by_the_transforms() -> None:
    follower = Follower(PLATFORM, "tilt", 1.0)
    follower.take_transforms(transform("odom", "base_link", imu(0.05, 0.02)["orientation"]))
    pose = settled(follower, 1.0, imu(orientation_covariance=[-1.0] + [0.0] * 8))
    assert pose[3:5] == pytest.approx([0.05, 0.02], abs=1e-9)


def test_a_unit_that_is_mounted_turned_is_felt_in_the_robots_frame() -> None:
    # Its x axis points to the robot's left: what it calls roll is the robot's pitch.
    follower, half = Follower(PLATFORM, "tilt", 1.0), np.sqrt(0.5)
    mount = {"x": 0.0, "y": 0.0, "z": half, "w": half}
    follower.take_transforms(transform("base_link", "imu_link", mount))
    assert settled(follower, 1.0, imu(roll=0.08))[3:5] == pytest.approx([0.0, 0.08], abs=1e-9)


def test_a_turn_at_a_steady_rate_is_followed_within_a_period() -> None:
    turn = {"x": 0.2, "y": 0.0, "z": 0.0}
    _, poses = follow(
        *(Follower(PLATFORM, "tilt", 1.0), 0.7, 0.0),
        lambda now: imu(roll=0.2 * now, angular_velocity=turn),
    )
    off = [0.2 * (n + 1) * PERIOD - pose.pose[3] for n, pose in enumerate(poses)]
    assert max(np.abs(off[30:])) <= 0.2 * 1.5 * PERIOD


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda d: d[:-1], "123 bytes, a datagram has 124"),
        (lambda d: b"X" + d[1:], "format"),
        (lambda d: d[:60] + b"\x01" + d[61:], "checksum"),
    ],
)
def test_a_datagram_that_was_changed_is_refused(change: Any, reason: str) -> None:
    with pytest.raises(DatagramError, match=reason):
        unpack(change(pack(Follower(PLATFORM, "tilt", 1.0).step(1.0))))


def test_a_receiver_refuses_what_is_old_jumps_or_has_other_legs_and_takes_a_new_beginning() -> None:
    receiver = Receiver(PLATFORM)
    _, poses = follow(Follower(PLATFORM, "tilt", 1.0), 0.6, 0.0, lambda now: imu(roll=0.15))
    for pose in poses[:20]:
        receiver.take(pack(pose))
    with pytest.raises(DatagramError, match="number 5 after 20"):
        receiver.take(pack(poses[4]))
    jumped = PLATFORM.leg_lengths(np.zeros(6))
    with pytest.raises(DatagramError, match=r"(rate|acceleration) of roll"):
        receiver.take(pack(type(poses[20])(21, poses[20].stamp, True, np.zeros(6), jumped)))
    with pytest.raises(DatagramError, match="a leg is"):
        receiver.take(pack(type(poses[20])(21, poses[20].stamp, True, poses[20].pose, jumped)))
    assert receiver.take(pack(poses[20])).sequence == 21
    with pytest.raises(DatagramError, match="first position"):
        Receiver(PLATFORM).take(pack(poses[40]))
    # A bridge that was started again begins level, and is believed once the platform is.
    with pytest.raises(DatagramError, match="number 1 after 21"):
        receiver.take(pack(poses[0]))
    with pytest.raises(DatagramError, match="first position"):
        receiver.take(pack(poses[19]), settled=True)
    assert receiver.take(pack(poses[0]), settled=True).sequence == 1


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("pitch = 11.0", "pitch = 20.0", "position: legs would be"),
        ("height = 2.39", "height = -1", "geometry.height: input should be greater than 0"),
        ("base_radius = 1.650", "base_radios = 1.650", "geometry.base_radius: field required"),
        ("[geometry]", "[geometry", "is no TOML"),
    ],
)
def test_a_platform_file_with_a_mistake_is_refused_by_the_name_of_the_field(
    tmp_path: Path, old: str, new: str, reason: str
) -> None:
    text = (assets() / "platforms" / "simona.toml").read_text(encoding="utf-8")
    assert old in text
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SettingError, match=reason):
        load_platform(str(wrong))
    with pytest.raises(SettingError, match="no platform chair: there are simona"):
        load_platform("chair")
    assert len(AXES) == 6
