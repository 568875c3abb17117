"""Readings as ROS messages and back, without ROS and without a lost bit.

A message is an object of the rosbags type store, so that a log, a WebSocket and a test speak of the
same thing. Functions ending in ``_message`` build one; those beginning with ``read_`` take one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeAlias

import numpy as np
from rosbags.typesys import Stores, get_typestore

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_from_message, pose_from_transform
from localization.logs.ros_stamps import stamp_from_message, stamp_to_dict
from localization.types import (
    SECOND,
    Hint,
    Inertial,
    Mounts,
    Odometry,
    PointScan,
    Pose,
    Reading,
    Scan,
    WheelSpeeds,
)

Message: TypeAlias = Any
"""An instance of one of ``TYPES.types``; those classes are made at run time."""

TYPES: Final = get_typestore(Stores.ROS2_JAZZY)
"""Message classes, their definitions and their CDR form."""

LASER_SCAN: Final = "sensor_msgs/msg/LaserScan"
JOINT_STATE: Final = "sensor_msgs/msg/JointState"
IMU: Final = "sensor_msgs/msg/Imu"
POINT_CLOUD: Final = "sensor_msgs/msg/PointCloud2"
ODOMETRY: Final = "nav_msgs/msg/Odometry"
POSE_WITH_COVARIANCE: Final = "geometry_msgs/msg/PoseWithCovarianceStamped"
TF: Final = "tf2_msgs/msg/TFMessage"

WHEEL_JOINTS: Final = ("left_wheels", "right_wheels")
"""Names in ``JointState``; each stands for the wheels of one side, which a belt couples."""

WHEEL_RADIUS: Final = 0.111
"""Radius [m] of a Pioneer 3-AT's wheel: 222 mm across (MobileRobots, Pioneer 3-AT data sheet)."""

_POINT: Final = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<u4")])

_LAST_STAMP: Final = 2**31 * SECOND
"""First stamp [ns] that ``builtin_interfaces/Time`` cannot hold."""


class MessageError(ValueError):
    """A value that has no message, or a message that holds no reading; one line says why."""


def _build(message_type: str, /, **fields: object) -> Message:
    return TYPES.types[message_type](**fields)  # type: ignore[arg-type]


def stamp_message(stamp: int) -> Message:
    """Return ``builtin_interfaces/Time`` of a stamp [ns]."""
    if not 0 <= stamp < _LAST_STAMP:
        raise MessageError(f"stamp must be in [0, 2^31) s, got {stamp} ns")
    return _build("builtin_interfaces/msg/Time", **stamp_to_dict(stamp))


def header_message(stamp: int, frame: str) -> Message:
    """Return ``std_msgs/Header`` of a stamp [ns] and a frame."""
    return _build("std_msgs/msg/Header", stamp=stamp_message(stamp), frame_id=frame)


def _vector(xyz: FloatArray, name: str = "geometry_msgs/msg/Vector3") -> Message:
    x, y, z = map(float, xyz)
    return _build(name, x=x, y=y, z=z)


def _quaternion(wxyz: FloatArray) -> Message:
    w, x, y, z = map(float, wxyz)
    return _build("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def _equal_steps(
    start: float, values: FloatArray, tolerance: float, *, scale: float = 1.0
) -> list[float]:
    """Return float32 steps s, likeliest first, with ``start + i * s * scale`` near ``values``.

    Each value bounds the step from both sides; what is left is an interval of which every float32
    is a candidate, and the one nearest its middle is in it if any is.
    """
    if len(values) < 2:
        return [0.0]
    i = np.arange(1, len(values))
    low = ((values[1:] - start - tolerance) / i).max() / scale
    high = ((values[1:] - start + tolerance) / i).min() / scale
    middle = np.float32(0.5 * (low + high))
    infinity = np.float32(np.inf)
    around = (middle, np.nextafter(middle, infinity), np.nextafter(middle, -infinity))
    return [float(step) for step in around]


def scan_message(scan: Scan) -> Message:
    """Return ``LaserScan`` of a scan whose angles and times have equal steps.

    Raises:
        MessageError: If rebuilding the scan from the message would not give the same scan.
    """
    n = len(scan.ranges)
    angle_min = float(scan.angles[0]) if n else 0.0
    offsets = scan.offsets.astype(float)
    for angle_increment in _equal_steps(angle_min, scan.angles, 0.0):
        for time_increment in _equal_steps(0.0, offsets, 0.5, scale=1e9):
            twin = Scan.uniform(
                scan.stamp,
                scan.scanner,
                angle_min=angle_min,
                angle_increment=angle_increment,
                time_increment=time_increment,
                ranges=scan.ranges,
                intensities=scan.intensities,
                range_min=scan.range_min,
                range_max=scan.range_max,
            )
            if same_scan(twin, scan):
                return _build(
                    LASER_SCAN,
                    header=header_message(scan.stamp, scan.scanner),
                    angle_min=angle_min,
                    angle_max=float(scan.angles[-1]) if n else 0.0,
                    angle_increment=angle_increment,
                    time_increment=time_increment,
                    scan_time=0.0,
                    range_min=scan.range_min,
                    range_max=scan.range_max,
                    ranges=scan.ranges.astype(np.float32),
                    intensities=scan.intensities.astype(np.float32),
                )
    raise MessageError(
        f"scan of {scan.scanner} at {scan.stamp} ns has no equal float32 steps of angle and time, "
        "which LaserScan wants; build it with Scan.uniform"
    )


def same_scan(a: Scan, b: Scan) -> bool:
    """Return whether two scans are the same in every number (NaN being equal to NaN)."""
    return (a.stamp, a.scanner, a.range_min, a.range_max) == (
        b.stamp,
        b.scanner,
        b.range_min,
        b.range_max,
    ) and all(
        np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True)
        for name in ("angles", "offsets", "ranges", "intensities")
    )


def read_scan(message: Message) -> Scan:
    """Return the scan in a ``LaserScan``; its ``frame_id`` is the scanner."""
    return Scan.uniform(
        stamp_from_message(message.header.stamp),
        str(message.header.frame_id),
        angle_min=message.angle_min,
        angle_increment=message.angle_increment,
        time_increment=message.time_increment,
        ranges=message.ranges,
        intensities=message.intensities,
        range_min=message.range_min,
        range_max=message.range_max,
    )


def points_message(scan: PointScan) -> Message:
    """Return ``PointCloud2`` with x, y, z [m] and the times ``t`` after its stamp [ns].

    Raises:
        MessageError: If float32 and uint32 do not hold the numbers exactly.
    """
    table = np.zeros(len(scan.points), dtype=_POINT)
    for i, name in enumerate("xyz"):
        table[name] = scan.points[:, i]
    table["t"] = scan.offsets
    exact = all((table[name] == scan.points[:, i]).all() for i, name in enumerate("xyz"))
    if not exact or (table["t"] != scan.offsets).any():
        raise MessageError(
            f"points of {scan.scanner} at {scan.stamp} ns must be of float32 resolution, and their"
            " times within 4 s"
        )
    fields = [
        _build("sensor_msgs/msg/PointField", name=name, offset=4 * i, datatype=kind, count=1)
        for i, (name, kind) in enumerate(zip("xyzt", (7, 7, 7, 6), strict=True))
    ]
    return _build(
        POINT_CLOUD,
        header=header_message(scan.stamp, scan.scanner),
        height=1,
        width=len(table),
        fields=fields,
        is_bigendian=False,
        point_step=_POINT.itemsize,
        row_step=_POINT.itemsize * len(table),
        data=np.frombuffer(table.tobytes(), dtype=np.uint8),
        is_dense=True,
    )


def wheels_message(wheels: WheelSpeeds, wheel_radius: float = WHEEL_RADIUS) -> Message:
    """Return ``JointState`` with both sides' angular velocity [rad/s]; ``wheel_radius`` in [m]."""
    for name in ("left", "right"):
        speed = getattr(wheels, name)
        if not float(np.float32(speed)) == speed:
            raise MessageError(
                f"wheels.{name} must be a finite number of float32 resolution, got {speed!r}; "
                "round it with numpy.float32"
            )
    velocity = np.array([wheels.left, wheels.right]) / wheel_radius
    return _build(
        JOINT_STATE,
        header=header_message(wheels.stamp, "base_link"),
        name=list(WHEEL_JOINTS),
        position=np.zeros(0),
        velocity=velocity,
        effort=np.zeros(0),
    )


def read_wheels(message: Message, wheel_radius: float = WHEEL_RADIUS) -> WheelSpeeds:
    """Return the rim speeds in a ``JointState``; ``wheel_radius`` in [m].

    Dividing by the radius and multiplying again costs at most the last bits of a float64, which
    rounding to float32 forgets: the speeds come back exactly.
    """
    velocity = dict(zip(message.name, message.velocity, strict=False))
    if missing := [joint for joint in WHEEL_JOINTS if joint not in velocity]:
        raise MessageError(f"no velocity of {' and '.join(missing)} in joints {message.name}")
    left, right = (float(np.float32(wheel_radius * velocity[joint])) for joint in WHEEL_JOINTS)
    return WheelSpeeds(stamp_from_message(message.header.stamp), left, right)


def inertial_message(inertial: Inertial) -> Message:
    """Return ``Imu`` in ``base_link``, with no orientation and unknown covariances."""
    # A first element of -1 means "this field does not exist", all zeros "covariance unknown"
    # (comments of sensor_msgs/Imu).
    no_orientation = np.zeros(9)
    no_orientation[0] = -1.0
    return _build(
        IMU,
        header=header_message(inertial.stamp, "base_link"),
        orientation=_quaternion(np.array([1.0, 0.0, 0.0, 0.0])),
        orientation_covariance=no_orientation,
        angular_velocity=_vector(inertial.angular_velocity),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=_vector(inertial.specific_force),
        linear_acceleration_covariance=np.zeros(9),
    )


def read_inertial(message: Message) -> Inertial:
    """Return the reading in an ``Imu``, taken to be in ``base_link``'s axes."""
    w, a = message.angular_velocity, message.linear_acceleration
    return Inertial(
        stamp_from_message(message.header.stamp),
        np.array([w.x, w.y, w.z]),
        np.array([a.x, a.y, a.z]),
    )


def odometry_message(odometry: Odometry) -> Message:
    """Return ``Odometry`` from ``odom`` to ``base_link``, with no twist and unknown covariances."""
    return _build(
        ODOMETRY,
        header=header_message(odometry.stamp, "odom"),
        child_frame_id="base_link",
        pose=_pose_with_covariance(odometry.odom_from_base, np.zeros(36)),
        twist=_build(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=_build(
                "geometry_msgs/msg/Twist", linear=_vector(np.zeros(3)), angular=_vector(np.zeros(3))
            ),
            covariance=np.zeros(36),
        ),
    )


def read_odometry(message: Message) -> Odometry:
    """Return the pose in an ``Odometry``, taken to be that of ``base_link``."""
    pose = message.pose.pose
    return Odometry(stamp_from_message(message.header.stamp), pose_from_message(pose))


def _pose_with_covariance(pose: Pose, covariance: FloatArray) -> Message:
    return _build(
        "geometry_msgs/msg/PoseWithCovariance",
        pose=_build(
            "geometry_msgs/msg/Pose",
            position=_vector(pose.position, "geometry_msgs/msg/Point"),
            orientation=_quaternion(pose.quaternion_wxyz),
        ),
        covariance=covariance,
    )


def hint_message(hint: Hint) -> Message:
    """Return ``PoseWithCovarianceStamped`` in ``map``."""
    return _build(
        POSE_WITH_COVARIANCE,
        header=header_message(hint.stamp, "map"),
        pose=_pose_with_covariance(hint.map_from_base, hint.covariance.ravel()),
    )


def read_hint(message: Message) -> Hint:
    """Return the hint in a ``PoseWithCovarianceStamped``, which must be in ``map``."""
    if (frame := str(message.header.frame_id)) != "map":
        raise MessageError(f"a hint must be in frame 'map', got {frame!r}")
    pose = message.pose.pose
    return Hint(
        stamp_from_message(message.header.stamp),
        pose_from_message(pose),
        np.asarray(message.pose.covariance, dtype=float).reshape(6, 6),
    )


def mounts_message(mounts: Mounts) -> Message:
    """Return ``TFMessage`` for ``/tf_static``: ``base_link`` to each scanner."""
    return _build(
        TF,
        transforms=[
            _build(
                "geometry_msgs/msg/TransformStamped",
                header=header_message(0, "base_link"),
                child_frame_id=scanner,
                transform=_build(
                    "geometry_msgs/msg/Transform",
                    translation=_vector(pose.position),
                    rotation=_quaternion(pose.quaternion_wxyz),
                ),
            )
            for scanner, pose in mounts.items()
        ],
    )


def read_mounts(message: Message) -> dict[str, Pose]:
    """Return ``base_from_frame`` of each frame that a ``TFMessage`` hangs on ``base_link``."""
    return {
        str(link.child_frame_id): pose_from_transform(link.transform)
        for link in message.transforms
        if link.header.frame_id == "base_link"
    }


def reading_message(reading: Reading, wheel_radius: float = WHEEL_RADIUS) -> Message:
    """Return the message of any reading; its ``__msgtype__`` is its type."""
    match reading:
        case Scan():
            return scan_message(reading)
        case PointScan():
            return points_message(reading)
        case WheelSpeeds():
            return wheels_message(reading, wheel_radius)
        case Inertial():
            return inertial_message(reading)
        case Odometry():
            return odometry_message(reading)
        case Hint():
            return hint_message(reading)


def readers(wheel_radius: float = WHEEL_RADIUS) -> dict[str, Callable[[Message], Reading]]:
    """Return, by message type, the function that makes a reading of it."""
    return {
        LASER_SCAN: read_scan,
        JOINT_STATE: lambda message: read_wheels(message, wheel_radius),
        IMU: read_inertial,
        ODOMETRY: read_odometry,
        POSE_WITH_COVARIANCE: read_hint,
    }


def to_cdr(message: Message) -> bytes:
    """Return a message's bytes: little-endian CDR."""
    return bytes(TYPES.serialize_cdr(message, message.__msgtype__, little_endian=True))


def from_cdr(data: bytes, message_type: str) -> Message:
    """Return the message in CDR bytes."""
    return TYPES.deserialize_cdr(data, message_type)


def definition(message_type: str) -> str:
    """Return a type's ``.msg`` text, with the types it is made of appended, as MCAP wants it."""
    return TYPES.generate_msgdef(message_type, ros_version=2)[0]
