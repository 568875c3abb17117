from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tyro
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from localization.cli.localize import Localize
from localization.cli.sensor_layout import layout_of
from localization.geometry import (
    FloatArray,
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from localization.logs.frame_tree import SensorLayout
from localization.logs.laser_scan_message import scan_message
from localization.logs.log_interface import LogError
from localization.logs.motion_messages import inertial_message, odometry_message
from localization.logs.open_log import open_log
from localization.logs.point_cloud_message import points_message, read_points
from localization.logs.ros_bag import RosBag
from localization.logs.ros_types import (
    JOINT_STATE,
    TF,
    TYPES,
    build,
    header_message,
    quaternion_message,
    to_cdr,
    vector_message,
)
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.log_replay import localize
from localization.types import (
    SECOND,
    Inertial,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)
from tests.support_rooms import HALL, MOUNTS, Drive, by_odometry, write_log

START = Pose.planar(2.6, 1.6, 0.2)
LOOP = ((1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (1.0, 0.0, 0.8))
ROS1 = get_typestore(Stores.ROS1_NOETIC)
ROS1.register(get_types_from_msg("geometry_msgs/msg/TransformStamped[] transforms", TF))
ROS2 = TYPES

Messages = list[tuple[str, int, object]]
"""Topic, time of recording [ns], message of the ROS 2 type store."""


def ros1(
    path: Path, recorded: Messages, compression: Ros1Writer.CompressionFormat | None = None
) -> Path:
    """Write a ROS 1 bag, its messages turned into those of that type store."""
    path = path.with_suffix(".bag")
    writer = Ros1Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connections = {}
        for topic, stamp, message in recorded:
            kind = message.__msgtype__  # type: ignore[attr-defined]
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS1)
            data = ROS1.serialize_ros1(_as_ros1(message), kind)
            writer.write(connections[topic], stamp, data)
    return path


def _as_ros1(message: object) -> object:
    """The same values in the classes of ROS 1, whose headers count."""
    kind = message.__msgtype__  # type: ignore[attr-defined]
    fields = {}
    for name in message.__dataclass_fields__:  # type: ignore[attr-defined]
        value = getattr(message, name)
        if hasattr(value, "__msgtype__"):
            value = _as_ros1(value)
        elif isinstance(value, list) and value and hasattr(value[0], "__msgtype__"):
            value = [_as_ros1(v) for v in value]
        if name != "__msgtype__":
            fields[name] = value
    if kind == "std_msgs/msg/Header":
        fields["seq"] = 7
    return ROS1.types[kind](**fields)


def ros2(
    path: Path,
    recorded: Messages,
    storage: StoragePlugin,
    mode: CompressionMode = CompressionMode.NONE,
) -> Path:
    writer = Ros2Writer(path, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, stamp, message in recorded:
            kind = message.__msgtype__  # type: ignore[attr-defined]
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS2)
            writer.write(connections[topic], stamp, to_cdr(message))
    return path


KINDS: dict[str, Callable[[Path, Messages], Path]] = {
    "ros1": ros1,
    "sqlite3": lambda path, recorded: ros2(path, recorded, StoragePlugin.SQLITE3),
    "mcap": lambda path, recorded: ros2(path, recorded, StoragePlugin.MCAP),
}


def transforms(links: Iterable[tuple[str, str, Pose]]) -> object:
    """A ``TFMessage`` of (parent, child, parent_from_child)."""
    return build(
        TF,
        transforms=[
            build(
                "geometry_msgs/msg/TransformStamped",
                header=header_message(0, parent),
                child_frame_id=child,
                transform=build(
                    "geometry_msgs/msg/Transform",
                    translation=vector_message(pose.position),
                    rotation=quaternion_message(pose.quaternion_wxyz),
                ),
            )
            for parent, child, pose in links
        ],
    )


DECK = Pose.from_euler([0.05, 0.0, 0.2], yaw=0.3)
IMU = Pose.from_euler([0.0, 0.0, 0.1], roll=np.pi, yaw=0.7)


def frames() -> object:
    """Scanners on a deck on the base, as many robots have them; an inertial unit upside down."""
    links = [("base_footprint", "base_link", Pose.identity()), ("base_link", "deck", DECK)]
    links += [("deck", name, DECK.inverse() @ mount) for name, mount in MOUNTS.items()]
    return transforms([*links, ("base_link", "imu", IMU)])


def recorded(
    readings: Iterable[Reading], *, frames_topic: str = "/tf_static", clock: int = SECOND
) -> Messages:
    """What a robot would have recorded of readings: four wheels, an odometry, frames of its own."""
    held: Messages = [(frames_topic, clock, frames())]
    for i, reading in enumerate(readings):
        stamp = clock + i * 1_000_000
        match reading:
            case Scan():
                topic = "/front/scan" if reading.scanner == "laser_horizontal" else "/up/scan"
                held.append((topic, stamp, scan_message(reading)))
            case WheelSpeeds():
                held.append(("/joints", stamp, four_wheels(reading)))
            case Inertial():
                orientation = reading.orientation
                if orientation is not None:
                    world_from_base = rotation_from_quaternion(orientation)
                    orientation = quaternion_from_rotation(world_from_base @ IMU.rotation)
                turned = Inertial(
                    reading.stamp,
                    IMU.rotation.T @ reading.angular_velocity,
                    IMU.rotation.T @ reading.specific_force,
                    orientation,
                    reading.orientation_sigma,
                )
                message = inertial_message(turned)
                message.header.frame_id = "imu"
                held.append(("/imu", stamp, message))
            case Odometry():
                held.append(("/odom", stamp, odometry_message(reading)))
            case PointScan():
                held.append(("/points", stamp, points_message(reading)))
    return held


def four_wheels(reading: WheelSpeeds) -> object:
    names = ["front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel", "arm"]
    speeds = [reading.left, reading.right, reading.left, reading.right, 99.0]
    return build(
        JOINT_STATE,
        header=header_message(reading.stamp, ""),
        name=names,
        position=np.zeros(5),
        velocity=np.array(speeds) / 0.111,
        effort=np.zeros(0),
    )


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Drive(HALL, START, *LOOP, noise=0.012, seed=4)


def worst_error(path: Path, world: Path, drive: Drive, **options: object) -> FloatArray:
    """Largest x, y, z [m] and yaw [rad] errors after the first two seconds."""
    start = START @ Pose.planar(0.2, -0.2, 0.1)
    done = localize(path, world, start=start, **options)  # type: ignore[arg-type]
    errors = []
    for estimate in done.estimates:
        if estimate.map_from_base is not None and estimate.stamp > 3 * SECOND:
            error = drive.pose(estimate.stamp).inverse() @ estimate.map_from_base
            errors.append([*error.position, error.yaw])
    assert len(errors) > 50
    worst: FloatArray = np.abs(np.array(errors)).max(axis=0)
    return worst


@pytest.mark.slow
def test_bag_of_wheels_and_gyro_is_localised_to_a_centimetre(
    tmp_path: Path, hall_map: Path, drive: Drive
) -> None:
    path = ros1(tmp_path / "bag", recorded(drive.readings()))
    assert open_log(path).sensors == SensorConfiguration(Motion.WHEELS_AND_GYRO)
    assert worst_error(path, hall_map, drive)[:2].max() < 0.01


@pytest.mark.slow
def test_bag_of_odometry_and_gyro_is_localised_to_a_centimetre(
    tmp_path: Path, hall_map: Path, drive: Drive
) -> None:
    readings = by_odometry(drive, turn=1.85, begin=Pose.planar(9.0, 4.0, 1.0))
    path = ros1(tmp_path / "bag", recorded(readings))
    assert open_log(path).sensors.motion is Motion.ODOMETRY_AND_GYRO
    worst = worst_error(path, hall_map, drive)
    assert worst[:2].max() < 0.01
    assert worst[3] < np.deg2rad(0.3)


@pytest.mark.parametrize("kind", KINDS)
def test_readings_of_a_bag_are_those_that_were_recorded(
    tmp_path: Path, drive: Drive, kind: str
) -> None:
    readings = drive.readings()
    log = open_log(KINDS[kind](tmp_path / "bag", recorded(readings)))
    assert set(log.mounts) == set(MOUNTS)
    for name, mount in MOUNTS.items():
        np.testing.assert_allclose(log.mounts[name].position, mount.position, atol=1e-9)
        np.testing.assert_allclose(log.mounts[name].rotation, mount.rotation, atol=1e-9)
    told = list(log)
    assert len(told) == len(readings)
    for a, b in zip(told, readings, strict=True):
        assert (type(a), a.stamp) == (type(b), b.stamp)
        if isinstance(a, Inertial) and isinstance(b, Inertial):
            np.testing.assert_allclose(a.angular_velocity, b.angular_velocity, atol=1e-12)
            np.testing.assert_allclose(a.specific_force, b.specific_force, atol=1e-9)
        if isinstance(a, WheelSpeeds) and isinstance(b, WheelSpeeds):
            assert (a.left, a.right) == (b.left, b.right)


def test_orientation_of_a_unit_that_is_mounted_upside_down_becomes_that_of_the_base(
    tmp_path: Path, drive: Drive
) -> None:
    held: list[Reading] = []
    poses = {}
    for reading in drive.readings()[:300]:
        if isinstance(reading, Inertial):
            poses[reading.stamp] = Pose.from_euler(
                [0.0, 0.0, 0.0], roll=0.02, pitch=-0.03, yaw=drive.pose(reading.stamp).yaw
            )
            held.append(
                replace(
                    reading,
                    orientation=poses[reading.stamp].quaternion_wxyz,
                    orientation_sigma=np.array([0.01, 0.02, 0.03]),
                )
            )
        else:
            held.append(reading)
    found = 0
    for reading in open_log(ros1(tmp_path / "bag", recorded(held))):
        if isinstance(reading, Inertial):
            assert reading.orientation is not None
            assert reading.orientation_sigma is not None
            np.testing.assert_allclose(
                rotation_from_quaternion(reading.orientation),
                poses[reading.stamp].rotation,
                atol=1e-9,
            )
            np.testing.assert_allclose(reading.orientation_sigma, [0.01, 0.02, 0.03])
            found += 1
    assert found == len(poses) > 10


@pytest.mark.slow
def test_odometry_and_one_level_scanner_make_a_flat_suite(
    tmp_path: Path, hall_map: Path, drive: Drive
) -> None:
    readings = [r for r in by_odometry(drive, level=True) if not isinstance(r, Inertial)]
    path = ros2(tmp_path / "bag", recorded(readings), StoragePlugin.MCAP)
    assert open_log(path).sensors == SensorConfiguration(Motion.ODOMETRY, flat=True)
    x, y, z, _ = worst_error(path, hall_map, drive)
    assert max(x, y) < 0.01
    assert z < 0.001


def test_static_frames_of_tf_1_are_found_on_tf(tmp_path: Path, drive: Drive) -> None:
    held = recorded(drive.readings()[:50], frames_topic="/tf")
    moving = transforms([("odom", "base_footprint", START), ("map", "odom", START)])
    bag = RosBag(ros1(tmp_path / "bag", [held[0], ("/tf", SECOND, moving), *held[1:]]))
    np.testing.assert_allclose(
        bag.mounts["laser_vertical"].position, MOUNTS["laser_vertical"].position, atol=1e-9
    )


def test_transform_without_a_rotation_leaves_the_others_in_use(
    tmp_path: Path, drive: Drive
) -> None:
    # Drivers that know no rotation leave its quaternion at zeros.
    held, arm = recorded(drive.readings()[:50]), transforms([("deck", "arm", DECK)])
    arm.transforms[0].transform.rotation.w = 0.0  # type: ignore[attr-defined]
    arm.transforms[0].transform.rotation.z = 0.0  # type: ignore[attr-defined]
    bag = RosBag(ros1(tmp_path / "bag", [("/tf_static", SECOND, arm), *held]))
    assert set(bag.mounts) == set(MOUNTS)


def test_bag_without_frames_needs_a_given_mount(tmp_path: Path, drive: Drive) -> None:
    path = ros1(tmp_path / "bag", recorded(drive.readings()[:50])[1:])
    with pytest.raises(
        LogError, match=r"pose of 'laser_horizontal' \(of /front/scan\) on 'base_link' is unknown"
    ):
        RosBag(path)
    layout = SensorLayout(mounts={**MOUNTS, "imu": IMU})
    assert set(RosBag(path, layout).mounts) == set(MOUNTS)


def test_mount_may_be_given_with_the_slash_that_tf_1_puts_before_a_frame(
    tmp_path: Path, drive: Drive
) -> None:
    held = recorded(r for r in drive.readings()[:50] if not isinstance(r, WheelSpeeds))[1:]
    for _, _, message in held:
        message.header.frame_id = f"/{message.header.frame_id}"  # type: ignore[attr-defined]
    layout = SensorLayout(mounts={f"/{n}": m for n, m in {**MOUNTS, "imu": IMU}.items()})
    bag = RosBag(ros1(tmp_path / "bag", held), layout)
    assert set(bag.mounts) == {f"/{name}" for name in MOUNTS}
    assert bag.warnings == ()


def test_given_mount_that_no_topic_uses_is_named_with_the_frames_there_are(
    tmp_path: Path, drive: Drive
) -> None:
    path = ros1(tmp_path / "bag", recorded(drive.readings()[:50]))
    (warning,) = RosBag(path, SensorLayout(mounts={"laser": Pose.identity()})).warnings
    assert "mount of 'laser' is not used" in warning
    assert "imu, laser_horizontal, laser_vertical" in warning


def test_options_for_mounts_and_topics_may_be_given_once_or_several_times() -> None:
    laser, unit = ["laser", "0.2", "0", "0.3", "90"], ["imu", "0.1", "0", "0.2", "0", "0", "30"]
    once = ["log", "--mount", *laser, *unit, "--topics", "/scan", "/imu"]
    again = ["log", "--mount", *laser, "--mount", *unit, "--topics", "/scan", "--topics", "/imu"]
    for words in (once, again):
        asked = tyro.cli(Localize, args=words)
        layout = layout_of(asked.mount, asked.topics)
        assert list(layout.mounts) == ["laser", "imu"]
        assert layout.topics == ("/scan", "/imu")


UNLINKED = Pose.from_euler([0.1, 0.0, 0.2], roll=0.5 * np.pi, yaw=-0.3)
"""Of a unit on its side, as on some Huskies: gravity is on its y axis."""


def without_link_to_the_unit(drive: Drive, seconds: float) -> Messages:
    """A bag whose transforms lead to the scanners and not to the inertial unit, which lies on its side."""
    links = [("base_link", name, mount) for name, mount in MOUNTS.items()]
    held: Messages = [("/tf_static", SECOND, transforms(links))]
    for topic, stamp, message in recorded(
        r for r in drive.readings() if r.stamp < seconds * SECOND
    )[1:]:
        if topic == "/imu":
            turn = UNLINKED.rotation.T @ IMU.rotation
            for name in ("angular_velocity", "linear_acceleration"):
                v = getattr(message, name)
                setattr(message, name, vector_message(turn @ np.array([v.x, v.y, v.z])))
        held.append((topic, stamp, message))
    return held


def test_unit_in_a_frame_that_nothing_connects_is_an_error_with_the_way_out(
    tmp_path: Path, drive: Drive
) -> None:
    path = ros1(tmp_path / "bag", without_link_to_the_unit(drive, 0.5))
    with pytest.raises(LogError) as raised:
        open_log(path)
    message = str(raised.value)
    assert "the pose of 'imu' (of /imu) on 'base_link' is unknown" in message
    assert "`--mount imu 0.1 0 0.3 0`" in message
    assert "--topics" in message
    without = SensorLayout(topics=("/front/scan", "/up/scan", "/joints"))
    assert not any(isinstance(r, Inertial) for r in open_log(path, without))


def test_given_mount_of_a_unit_turns_its_readings_into_the_axes_of_the_base(
    tmp_path: Path, drive: Drive
) -> None:
    path = ros1(tmp_path / "bag", without_link_to_the_unit(drive, 0.5))
    words = (0.1, 0.0, 0.2, 90.0, 0.0, float(np.rad2deg(-0.3)))
    found = [r for r in open_log(path, layout_of({"imu": words}, ())) if isinstance(r, Inertial)]
    true = [r for r in drive.readings() if isinstance(r, Inertial)]
    assert len(found) >= 20
    for reading, expected in zip(found, true, strict=False):
        np.testing.assert_allclose(reading.angular_velocity, expected.angular_velocity, atol=1e-9)
        np.testing.assert_allclose(reading.specific_force, expected.specific_force, atol=1e-9)


def test_unit_whose_later_readings_come_from_an_unknown_frame_is_left_out_and_counted(
    tmp_path: Path, drive: Drive
) -> None:
    held = recorded(drive.readings()[:60])
    for topic, _, message in held[40:]:
        if topic == "/imu":
            message.header.frame_id = "elsewhere"  # type: ignore[attr-defined]
    bag = RosBag(ros1(tmp_path / "bag", held))
    assert len([r for r in bag if isinstance(r, Inertial)]) > 5
    assert "'elsewhere' on the base is unknown" in bag.skipped["/imu"].reason


def test_mount_of_four_numbers_is_level_and_of_six_has_roll_and_pitch() -> None:
    layout = layout_of(
        {"laser": (0.2, 0.0, 0.3, 90.0), "imu": (0.1, 0.2, 0.3, 10.0, 20.0, 30.0)}, ()
    )
    assert np.rad2deg(layout.mounts["laser"].euler) == pytest.approx([0.0, 0.0, 90.0])
    assert np.rad2deg(layout.mounts["imu"].euler) == pytest.approx([10.0, 20.0, 30.0])
    assert layout.mounts["imu"].position == pytest.approx([0.1, 0.2, 0.3])


def test_topics_can_be_chosen(tmp_path: Path, drive: Drive) -> None:
    path = ros1(tmp_path / "bag", recorded(drive.readings()[:50]))
    bag = RosBag(path, SensorLayout(topics=("/front/scan", "/joints")))
    assert {type(r) for r in bag} == {Scan, WheelSpeeds}
    assert bag.sensors == SensorConfiguration(Motion.WHEELS, flat=True)


def test_topic_that_a_bag_lacks_is_an_error_with_those_it_has(tmp_path: Path, drive: Drive) -> None:
    path = ros1(tmp_path / "bag", recorded(drive.readings()[:50]))
    with pytest.raises(LogError, match=r"no topic /joint; it has: /front/scan, /imu, /joints,"):
        RosBag(path, SensorLayout(topics=("/front/scan", "/joint")))


def test_messages_without_a_reading_are_counted_with_a_reason(tmp_path: Path, drive: Drive) -> None:
    text = build("std_msgs/msg/String", data="hello")
    held = [*recorded(drive.readings()[:50]), ("/chatter", 9 * SECOND, text)]
    bag = RosBag(ros2(tmp_path / "bag", held, StoragePlugin.SQLITE3))
    list(bag)
    assert bag.skipped["/chatter"].count == 1
    assert "String holds no reading" in bag.skipped["/chatter"].reason


def test_bag_without_scanner_and_motion_is_rejected_with_its_types(tmp_path: Path) -> None:
    text = build("std_msgs/msg/String", data="hello")
    path = ros2(tmp_path / "bag", [("/chatter", 1, text)], StoragePlugin.MCAP)
    with pytest.raises(
        LogError, match="no scanner, odometry or wheels among its types std_msgs/msg/String"
    ):
        RosBag(path)


def test_damaged_and_foreign_files_are_rejected_in_one_line(tmp_path: Path, drive: Drive) -> None:
    whole = ros1(tmp_path / "bag", recorded(drive.readings()[:50]))
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole.read_bytes()[:3000])
    folder = tmp_path / "folder"
    folder.mkdir()
    for path in (cut, folder, tmp_path / "nowhere.bag"):
        with pytest.raises(LogError) as error:
            open_log(path)
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("kind", "remedy"),
    [("ros1", "rosbag reindex"), ("sqlite3", "sqlite3 FILE .recover"), ("mcap", "mcap recover")],
)
def test_content_of_a_bag_decides_how_it_is_read_and_repaired_not_its_name(
    tmp_path: Path, drive: Drive, kind: str, remedy: str
) -> None:
    readings = drive.readings()[:50]
    bag = KINDS[kind](tmp_path / "bag", recorded(readings))
    (file,) = [bag] if bag.is_file() else [p for p in bag.iterdir() if p.stem == "bag"]
    renamed = file.rename(tmp_path / "drive.bag.active")
    assert len(list(open_log(renamed))) == len(readings)
    renamed.write_bytes(renamed.read_bytes()[:5000])
    with pytest.raises(LogError, match=remedy):
        open_log(renamed)


@pytest.mark.long
@pytest.mark.slow
def test_bag_with_a_damaged_index_is_rejected_in_one_line(tmp_path: Path, drive: Drive) -> None:
    (file,) = KINDS["mcap"](tmp_path / "bag", recorded(drive.readings()[:50])).glob("*.mcap")
    whole = file.read_bytes()
    for at in range(len(whole) - 320, len(whole) - 200, 3):
        file.write_bytes(whole[:at] + 8 * b"\xff" + whole[at + 8 :])
        with contextlib.suppress(LogError):
            list(open_log(file))


def test_folder_of_a_recorder_that_was_killed_is_an_error_with_the_tool_that_repairs_it(
    tmp_path: Path, drive: Drive
) -> None:
    bag = KINDS["mcap"](tmp_path / "bag", recorded(drive.readings()[:50]))
    (bag / "metadata.yaml").unlink()
    with pytest.raises(LogError, match="`ros2 bag reindex` or `mcap recover` repairs"):
        open_log(bag)


def test_own_logs_are_distinguished_from_bags_by_their_content(
    tmp_path: Path, drive: Drive
) -> None:
    path = write_log(tmp_path / "odd.name", drive.readings()[:30])
    assert type(open_log(path)).__name__ == "McapLog"
    assert open_log(path).sensors == SensorConfiguration()


def test_given_mount_takes_the_place_of_that_in_a_log_of_ours_and_another_name_is_an_error(
    tmp_path: Path, drive: Drive
) -> None:
    path = write_log(tmp_path / "drive.mcap", drive.readings()[:30])
    there = Pose.planar(0.5, 0.0, 0.1)
    log = open_log(path, SensorLayout(mounts={"laser_vertical": there}))
    assert log.mounts["laser_vertical"] is there
    assert list(log.mounts) == list(MOUNTS)
    with pytest.raises(LogError, match=r"no scanner 'laser' to mount; it has: laser_horizontal,"):
        open_log(path, SensorLayout(mounts={"laser": there}))
    with pytest.raises(LogError, match="leave out --topics"):
        open_log(path, SensorLayout(topics=("/scan",)))


# Scanners of several planes


@pytest.mark.parametrize("step", [0, 8, 2**31])
def test_cloud_whose_fields_do_not_fit_its_points_is_counted_with_the_reason(
    tmp_path: Path, drive: Drive, step: int
) -> None:
    message = points_message(turn(drive, SECOND))
    message.point_step = step
    held = [*recorded(drive.readings()[:50]), ("/points", 9 * SECOND, message)]
    bag = RosBag(ros2(tmp_path / "bag", held, StoragePlugin.MCAP))
    assert len(list(bag)) == 50
    assert f"x, y, z, t do not fit its {step} bytes a point" in bag.skipped["/points"].reason


@pytest.mark.parametrize("stamp", [3 * SECOND, 1_700_000_000 * SECOND])
@pytest.mark.parametrize("unit", [1.0, 1e-9])
def test_times_of_points_as_floats_may_be_nanoseconds_or_seconds_of_any_clock(
    stamp: int, unit: float
) -> None:
    offsets = np.arange(0, 100_000_000, 10_000_000)
    message = points_message(PointScan(stamp, "livox", np.ones((10, 3)), offsets))
    kind = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<f8")]
    table = np.ones(10, dtype=kind)
    table["t"] = (stamp + offsets) * unit
    message.point_step, message.row_step = 20, 200
    message.fields[3].datatype = 8
    message.data = np.frombuffer(table.tobytes(), dtype=np.uint8)
    np.testing.assert_allclose(read_points(message).offsets, offsets, atol=500)


def turn(drive: Drive, stamp: int) -> PointScan:
    """A turn of a 16-plane scanner, column by column, from where it was at each column's time."""
    columns, planes = 360, np.deg2rad(np.linspace(-15.0, 15.0, 16))
    azimuth = np.linspace(-np.pi, np.pi, columns, endpoint=False)
    offsets = np.repeat(np.arange(columns) * 250_000, len(planes))
    a, e = np.repeat(azimuth, len(planes)), np.tile(planes, columns)
    beams = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1)
    mount = MOUNTS["laser_horizontal"]
    position, rotation = drive.at(stamp + offsets)
    far = HALL.cast(
        position + rotation @ mount.position,
        np.einsum("nij,nj->ni", rotation, beams @ mount.rotation.T),
    )
    noise = 0.02 * np.random.default_rng([3, stamp]).standard_normal(len(far))
    points = ((far + noise)[:, None] * beams).astype(np.float32)
    seen = np.isfinite(far)
    return PointScan(stamp, "laser_horizontal", points[seen].astype(float), offsets[seen])


@pytest.mark.slow
def test_clouds_of_a_spinning_scanner_are_localised_to_two_centimetres(
    tmp_path: Path, hall_map: Path, drive: Drive
) -> None:
    readings: list[Reading] = []
    for reading in drive.readings():
        if not isinstance(reading, Scan):
            readings.append(reading)
        if isinstance(reading, WheelSpeeds) and reading.stamp % (SECOND // 5) == 0:
            readings.append(turn(drive, reading.stamp - SECOND // 10))
    path = ros2(tmp_path / "bag", recorded(readings), StoragePlugin.MCAP)
    log = open_log(path)
    assert log.sensors == SensorConfiguration(Motion.WHEELS_AND_GYRO)
    first = next(r for r in log if isinstance(r, PointScan))
    twin = turn(drive, first.stamp)
    np.testing.assert_array_equal(first.points, twin.points)
    np.testing.assert_array_equal(first.offsets, twin.offsets)
    x, y, z, yaw = worst_error(path, hall_map, drive)
    assert max(x, y, z) < 0.02
    assert yaw < np.deg2rad(0.5)
