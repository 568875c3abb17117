"""Bags of two robots, and of two odometries: one is read, and a line says which."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from localization.logs.frame_tree import SensorLayout
from localization.logs.motion_messages import odometry_message
from localization.logs.open_log import open_log
from localization.logs.ros_types import IMU, JOINT_STATE, LASER_SCAN, ODOMETRY
from localization.logs.topic_choice import chosen_topics
from localization.pipeline.log_replay import localize
from localization.types import SECOND, Odometry, Pose
from tests.localization.logs.test_ros_bag import Messages, recorded, ros1
from tests.support_rooms import HALL, Drive


def test_one_robot_with_many_sensors_keeps_all_topics() -> None:
    kinds = {
        "/front/scan": LASER_SCAN,
        "/rear/scan": LASER_SCAN,
        "/base/odom": ODOMETRY,
        "/imu": IMU,
        "/arm/joint_states": JOINT_STATE,
        "/joint_states": JOINT_STATE,
    }
    assert chosen_topics(kinds, dict.fromkeys(kinds, 10)) == (kinds, ())


def test_of_two_robots_the_one_with_more_messages_is_read() -> None:
    kinds = {f"/r{i}/{t}": k for i in (1, 2) for t, k in (("scan", LASER_SCAN), ("odom", ODOMETRY))}
    kinds["/initialpose"] = "geometry_msgs/msg/PoseWithCovarianceStamped"
    counts = {t: 20 if t.startswith("/r2") else 10 for t in kinds}
    kept, (note,) = chosen_topics(kinds, counts)
    assert set(kept) == {"/r2/scan", "/r2/odom", "/initialpose"}
    assert note.startswith("holds 2 robots, in /r1, /r2: only the topics of /r2 are read")


def test_robot_of_the_root_is_read_beside_one_in_a_namespace() -> None:
    kinds = {"/scan": LASER_SCAN, "/odom": ODOMETRY, "/r2/scan": LASER_SCAN, "/r2/odom": ODOMETRY}
    kept, (note,) = chosen_topics(kinds, {t: 90 if "r2" in t else 10 for t in kinds})
    assert set(kept) == {"/scan", "/odom"}
    assert note.startswith("holds 2 robots, in /, /r2: only the topics of / are read")


def test_sensors_of_the_root_belong_to_the_only_robot_in_a_namespace() -> None:
    kinds = {"/scan": LASER_SCAN, "/imu": IMU, "/base/scan": LASER_SCAN, "/base/odom": ODOMETRY}
    assert chosen_topics(kinds, dict.fromkeys(kinds, 1)) == (kinds, ())


def test_robots_without_scanners_are_told_apart_by_their_motion() -> None:  # words: ok
    kinds = {f"/r{i}/{t}": k for i in (1, 2) for t, k in (("imu", IMU), ("odom", ODOMETRY))}
    kept, notes = chosen_topics(kinds, dict.fromkeys(kinds, 10))
    assert set(kept) == {"/r1/imu", "/r1/odom"}
    assert len(notes) == 1


def test_of_several_odometries_and_inertial_topics_the_measured_one_is_read() -> None:
    kinds = {
        "/odometry/filtered": ODOMETRY,
        "/ground_truth/odom": ODOMETRY,
        "/wheel/odom": ODOMETRY,
        "/imu/data_raw": IMU,
        "/imu/data": IMU,
        "/silent/odom": ODOMETRY,
    }
    counts = {**dict.fromkeys(kinds, 100), "/wheel/odom": 10, "/silent/odom": 0}
    kept, notes = chosen_topics(kinds, counts)
    assert {t for t, k in kept.items() if counts[t]} == {"/wheel/odom", "/imu/data"}
    assert "3 topics hold odometry" in notes[0]
    assert "/imu/data is read; choose with --topics" in notes[1]


def test_two_odometries_of_a_bag_do_not_become_one(tmp_path: Path) -> None:
    held: Messages = []
    for i in range(50):
        reading = Odometry(SECOND + i * SECOND // 20, Pose.planar(0.05 * i, 0.0, 0.0))
        far = replace(reading, odom_from_base=Pose.planar(3.0 + 0.05 * i, 1.0, 0.0))
        held.append(("/odom", reading.stamp, odometry_message(reading)))
        held.append(("/odometry/filtered", reading.stamp + 1, odometry_message(far)))
    path = ros1(tmp_path / "bag", held)
    done = localize(path)
    assert abs(done.estimates[-1].odom_from_base.position[0] - 2.45) < 1e-6
    assert "2 topics hold odometry, /odom, /odometry/filtered: /odom is read" in done.notes[0]
    log = open_log(path, SensorLayout(topics=("/odometry/filtered",)))
    assert log.warnings == ()
    assert sum(1 for _ in log) == 50


def test_scans_of_two_robots_in_a_bag_are_not_mixed(tmp_path: Path) -> None:
    """Both have a frame of the same name, as two robots of one maker have."""
    drive = Drive(HALL, Pose.planar(2.6, 1.6, 0.2), (0.5, 0.2, 0.0)).readings()
    held: Messages = []
    for topic, stamp, message in recorded(drive):
        if topic == "/tf_static":
            held.append((topic, stamp, message))
        else:
            held += [(f"/r{i}{topic}", stamp, message) for i in (1, 2)]
    log = open_log(ros1(tmp_path / "bag", held))
    assert sum(1 for _ in log) == len(drive)
    assert "holds 2 robots, in /r1, /r2" in log.warnings[0]
