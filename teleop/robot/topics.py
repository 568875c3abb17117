"""Every topic of the robot in one table: name, type, rate, and how its message is made of a snapshot.

``python -m teleop.robot.topics`` prints the table as ``docs/topics.md`` has it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, TypeAlias

import numpy as np

from localization.geometry import FloatArray
from localization.logs.laser_scan_message import scan_message
from localization.logs.motion_messages import inertial_message, wheels_message
from localization.logs.ros_types import TF
from localization.maps.cloud import Cloud
from localization.monitoring.health import horizontal_sigma
from localization.types import Estimate, Health, Inertial, Mounts, Pose, Scan, Twist, WheelSpeeds
from robot_sim import P3AT
from robot_sim.drive.robot_condition import Condition
from teleop.robot.robot import TickRecord

Message: TypeAlias = dict[str, Any]
Build: TypeAlias = Callable[[TickRecord], Message | None]


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that the robot publishes while it runs."""

    name: str
    type: str
    every: int
    """Ticks of 20 ms between messages; 0 means whenever there is something new."""
    build: Build
    """Makes the message; None when there is nothing to say."""
    about: str
    latch: bool = False
    build_all: Callable[[TickRecord], list[Message]] | None = None
    """Makes the messages of a topic that may have several in a tick; ``build`` makes the first."""

    def messages(self, tick: TickRecord) -> list[Message]:
        """Return what there is to say after a tick."""
        if self.build_all is not None:
            return self.build_all(tick)
        message = self.build(tick)
        return [] if message is None else [message]


@dataclass(frozen=True, slots=True)
class Input:
    """A topic or service that clients may use."""

    name: str
    type: str
    about: str


def _header(stamp: int, frame: str) -> Message:
    return {"stamp": _time(stamp), "frame_id": frame}


def _time(stamp: int) -> Message:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return {"sec": sec, "nanosec": nanosec}


def _vector(v: FloatArray) -> Message:
    x, y, z = v.tolist()
    return {"x": x, "y": y, "z": z}


def _pose(pose: Pose) -> Message:
    w, x, y, z = pose.quaternion_wxyz.tolist()
    return {"position": _vector(pose.position), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def _twist(twist: Twist) -> Message:
    return {"linear": _vector(twist.linear), "angular": _vector(twist.angular)}


def _transform(stamp: int, parent: str, child: str, pose: Pose) -> Message:
    p = _pose(pose)
    return {
        "header": _header(stamp, parent),
        "child_frame_id": child,
        "transform": {"translation": p["position"], "rotation": p["orientation"]},
    }


def _plain(message: object) -> Any:
    """Turn a message of the type store into plain values."""
    if is_dataclass(message):
        names = [f.name for f in fields(message) if f.name != "__msgtype__"]
        return {name: _plain(getattr(message, name)) for name in names}
    if isinstance(message, list):
        return [_plain(item) for item in message]
    return message


def ros_covariance(estimate: Estimate) -> FloatArray:
    """Return the (36,) covariance in ROS's convention, whose rotations are about the fixed axes."""
    assert estimate.map_from_base is not None
    turn = np.eye(6)
    turn[3:, 3:] = estimate.map_from_base.rotation
    return np.asarray((turn @ estimate.covariance @ turn.T).ravel())


def _clock(s: TickRecord) -> Message:
    return {"clock": _time(s.stamp)}


def _tf(s: TickRecord) -> Message:
    e = s.estimate
    transforms = [_transform(s.stamp, "odom", "base_link", e.odom_from_base)]
    if e.map_from_base is not None:
        map_from_odom = e.map_from_base @ e.odom_from_base.inverse()
        transforms.insert(0, _transform(s.stamp, "map", "odom", map_from_odom))
    return {"transforms": transforms}


def _odometry(stamp: int, frame: str, pose: Pose, twist: Twist) -> Message:
    return {
        "header": _header(stamp, frame),
        "child_frame_id": "base_link",
        "pose": {"pose": _pose(pose)},
        "twist": {"twist": _twist(twist)},
    }


def _odom(s: TickRecord) -> Message:
    return _odometry(s.stamp, "odom", s.estimate.odom_from_base, s.estimate.twist)


def _ground_truth(s: TickRecord) -> Message:
    return _odometry(s.stamp, "map", s.truth.map_from_base, s.truth.twist)


def _true_slip(s: TickRecord) -> Message:
    slip = s.truth.slip
    centres = np.array([slip.icr_x, slip.icr_left, slip.icr_right])
    turning = bool(np.isfinite(centres).all())
    # JSON has no NaN.
    icr_x, icr_left, icr_right = centres.tolist() if turning else (0.0, 0.0, 0.0)
    return {
        "header": _header(s.stamp, "base_link"),
        "longitudinal": slip.longitudinal.tolist(),
        "lateral": slip.lateral.tolist(),
        "turning": turning,
        "icr_x": icr_x,
        "icr_left": icr_left,
        "icr_right": icr_right,
    }


def _true_condition(s: TickRecord) -> Message:
    c = s.condition
    return {
        "header": _header(s.stamp, "base_link"),
        "touching": list(c.touching),
        "wheels_down": list(c.wheels_down),
        "grounded": c.grounded,
        "roll": c.roll,
        "pitch": c.pitch,
        "left_stalled": c.left_stalled,
        "right_stalled": c.right_stalled,
        "fallen": c.fallen,
    }


def _bumpers(s: TickRecord) -> Message:
    bumpers = s.condition.bumpers
    return {
        "header": _header(s.stamp, "base_link"),
        "front_bumpers": list(bumpers.front),
        "rear_bumpers": list(bumpers.rear),
    }


def _packet(s: TickRecord) -> Message | None:
    if s.packet is None:
        return None
    return {"layout": {"dim": [], "data_offset": 0}, "data": s.packet.to_bytes()}


def _amcl_pose(s: TickRecord) -> Message | None:
    pose = s.estimate.map_from_base
    if pose is None:
        return None
    covariance = ros_covariance(s.estimate)
    return {
        "header": _header(s.stamp, "map"),
        "pose": {"pose": _pose(pose), "covariance": covariance},
    }


def _scans_of(scanner: str) -> Callable[[TickRecord], list[Message]]:
    """A mirror that turns 75 times a second ends one scan or two in a tick."""

    def build_all(s: TickRecord) -> list[Message]:
        return [
            _scan(reading)
            for reading in s.readings
            if isinstance(reading, Scan) and reading.scanner == scanner
        ]

    return build_all


def _scan(scan: Scan) -> Message:
    message: Message = _plain(scan_message(scan))
    # JSON has no infinity, and some clients die of null: no return is beyond the range.
    clean = np.nan_to_num(message["ranges"], nan=0.0, posinf=scan.range_max + 1.0)
    return {**message, "ranges": clean}


def _scan_of(scanner: str) -> Build:
    build_all = _scans_of(scanner)
    return lambda s: next(iter(build_all(s)), None)


def _local_cloud(s: TickRecord) -> Message | None:
    e = s.estimate
    if e.sweep is None or e.match is None or e.map_from_base is None:
        return None
    table = np.zeros((len(e.sweep.points), 5), dtype="<f4")
    table[:, :3] = e.map_from_base.apply(e.sweep.points)
    table[:, 4] = e.match.distances
    names = ("x", "y", "z", "intensity", "distance")
    return {
        "header": _header(e.sweep.stamp, "map"),
        "height": 1,
        "width": len(table),
        "fields": [
            {"name": n, "offset": 4 * i, "datatype": 7, "count": 1} for i, n in enumerate(names)
        ],
        "is_bigendian": False,
        "point_step": 20,
        "row_step": 20 * len(table),
        "data": table.tobytes(),
        "is_dense": bool(np.isfinite(table).all()),
    }


def _imu(s: TickRecord) -> Message | None:
    found = [r for r in s.readings if isinstance(r, Inertial)]
    return _plain(inertial_message(found[-1])) if found else None


def _joints(s: TickRecord) -> Message | None:
    found = [r for r in s.readings if isinstance(r, WheelSpeeds)]
    return _plain(wheels_message(found[-1], P3AT().rolling_radius)) if found else None


def _status(s: TickRecord) -> Message:
    e = s.estimate
    placed = e.map_from_base is not None
    fit = (
        s.matched.match.inlier_ratio
        if s.matched is not None and s.matched.match is not None
        else 0.0
    )
    nis = s.matched.nis if s.matched is not None and s.matched.nis is not None else 0.0
    sigma = horizontal_sigma(e.covariance) if placed else 0.0
    return {
        "header": _header(s.stamp, "map"),
        "health": e.health.value,
        "reasons": list(e.reasons),
        "fit": fit,
        "nis": nis,
        "position_sigma": sigma,
        "heading_sigma": float(np.sqrt(e.covariance[5, 5])) if placed else 0.0,
        "unexplained": 1.0 - fit if s.matched is not None else 0.0,
    }


def _verdict(s: TickRecord) -> Message | None:
    found = [e.verdict for e in s.estimates if e.verdict is not None]
    if not found:
        return None
    v = found[-1]
    return {
        "header": _header(v.stamp, "map"),
        "verdict": v.verdict.value,
        "reason": v.reason,
        "hint": _pose(v.hint.map_from_base),
        "candidates": [_pose(c.map_from_base) for c in v.candidates],
        "scores": [c.score for c in v.candidates],
    }


def _teleop_state(s: TickRecord) -> Message:
    c = s.control
    return {
        "header": _header(s.stamp, "base_link"),
        "state": c.control.value,
        "reason": c.reason,
        "controller": c.controller,
        "armed": c.control.value == "armed",
        "estop": c.control.value == "estop",
        "command_age": c.command_age / 1e9,
        "linear": float(c.twist.linear[0]),
        "angular": float(c.twist.angular[2]),
    }


_LEVEL = {Health.TRACKING: 0, Health.LOST: 2, Health.WAITING: 1}


def _diagnostics(s: TickRecord) -> Message:
    e = s.estimate
    sigma = np.sqrt(np.diag(e.covariance))
    values = {
        "position sigma [mm]": f"{1e3 * float(np.hypot(sigma[0], sigma[1])):.1f}",
        "heading sigma [deg]": f"{np.rad2deg(sigma[5]):.3f}",
        "controller": s.control.controller or "nobody",
        "control": f"{s.control.control.value}: {s.control.reason}",
    }
    status = {
        "level": _LEVEL.get(e.health, 1),
        "name": "localization",
        "message": "; ".join((e.health.value, *e.reasons)),
        "hardware_id": "p3at",
        "values": [{"key": k, "value": v} for k, v in values.items()],
    }
    return {"header": _header(s.stamp, ""), "status": [status, _drive_status(s.condition)]}


def _drive_status(c: Condition) -> Message:
    """What the robot's own sensors can tell of bumps, stalls and tilt."""
    rings = {"front bumpers": c.bumpers.front, "rear bumpers": c.bumpers.rear}
    values = {
        # Plus zero, for there is no minus zero degrees.
        "roll [deg]": f"{round(np.rad2deg(c.roll), 1) + 0.0:.1f}",
        "pitch [deg]": f"{round(np.rad2deg(c.pitch), 1) + 0.0:.1f}",
        **{name: "".join("-#"[pressed] for pressed in ring) for name, ring in rings.items()},
        "left motors": "stalled" if c.left_stalled else "ok",
        "right motors": "stalled" if c.right_stalled else "ok",
    }
    return {
        "level": 2 if c.fallen else int(bool(c.troubles)),
        "name": "drive",
        "message": "; ".join(c.troubles) or "ok",
        "hardware_id": "p3at",
        "values": [{"key": k, "value": v} for k, v in values.items()],
    }


OUTPUTS: tuple[Topic, ...] = (
    Topic("/clock", "rosgraph_msgs/msg/Clock", 1, _clock, "the robot's time"),
    Topic("/tf", "tf2_msgs/msg/TFMessage", 2, _tf, "`map` to `odom` to `base_link`"),
    Topic("/odom", "nav_msgs/msg/Odometry", 2, _odom, "smooth pose in `odom` and twist; drifts"),
    Topic(
        "/amcl_pose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        5,
        _amcl_pose,
        "the estimate in `map` with its covariance, once there is one",
    ),
    Topic(
        "/scan",
        "sensor_msgs/msg/LaserScan",
        0,
        _scan_of("laser_horizontal"),
        "horizontal scanner; no return is range_max + 1",
        build_all=_scans_of("laser_horizontal"),
    ),
    Topic(
        "/scan_vertical",
        "sensor_msgs/msg/LaserScan",
        0,
        _scan_of("laser_vertical"),
        "transverse scanner",
        build_all=_scans_of("laser_vertical"),
    ),
    Topic(
        "/local_cloud",
        "sensor_msgs/msg/PointCloud2",
        0,
        _local_cloud,
        "the last sweep in `map`: x y z, intensity (0: a sweep carries none), distance to the map [m], NaN where nothing is mapped near",
    ),
    Topic("/imu/data", "sensor_msgs/msg/Imu", 1, _imu, "gyro and accelerometer"),
    Topic("/joint_states", "sensor_msgs/msg/JointState", 1, _joints, "wheel rates of both sides"),
    Topic(
        "/localization/status",
        "farsteer_msgs/msg/LocalizationStatus",
        5,
        _status,
        "health with reasons, fit, NIS, sigmas",
    ),
    Topic(
        "/localization/hint_verdict",
        "farsteer_msgs/msg/HintVerdict",
        0,
        _verdict,
        "the answer to a hint",
        latch=True,
    ),
    Topic(
        "/teleop/state",
        "farsteer_msgs/msg/TeleopState",
        5,
        _teleop_state,
        "who drives, and the command in force",
    ),
    Topic(
        "/bumper_state",
        "farsteer_msgs/msg/BumperState",
        1,
        _bumpers,
        "front and rear bumper segments, each ring from the robot's left; as ROSARIA has it",
    ),
    Topic(
        "/firmware/packet",
        "std_msgs/msg/UInt8MultiArray",
        0,
        _packet,
        "with the firmware option, 10 Hz: the controller's standard packet, byte by byte",
    ),
    Topic(
        "/diagnostics",
        "diagnostic_msgs/msg/DiagnosticArray",
        50,
        _diagnostics,
        "for dashboards: localisation; bumpers, tilt, stalls, a fall",
    ),
    Topic(
        "/ground_truth/odom",
        "nav_msgs/msg/Odometry",
        2,
        _ground_truth,
        "where the robot really is; simulation only",
    ),
    Topic(
        "/ground_truth/slip",
        "farsteer_msgs/msg/Slip",
        2,
        _true_slip,
        "how the wheels really slip, and the centres of rotation; simulation only",
    ),
    Topic(
        "/ground_truth/condition",
        "farsteer_msgs/msg/Condition",
        1,
        _true_condition,
        "what is touched, by name; wheels on the ground, tilt, stalls, a fall; simulation only",
    ),
)
"""What the robot publishes, tick by tick."""

TF_STATIC = Input("/tf_static", TF, "where scanners and IMU sit on `base_link`; latched")
MAP_INFO = Input(
    "/map_info", "farsteer_msgs/msg/MapInfo", "name, bounds and SHA-256 of the map; latched"
)

INPUTS: tuple[Input, ...] = (
    Input(
        "/joy", "sensor_msgs/msg/Joy", "drive: `axes[1]` forward, `axes[0]` turn, deadman, turbo"
    ),
    Input("/unity/joy", "sensor_msgs/msg/Joy", "the same under the name that the paper used"),
    Input("/cmd_vel", "geometry_msgs/msg/Twist", "drive without a joystick; no deadman"),
    Input(
        "/initialpose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "a hint: all-zero covariance means the default sigma",
    ),
)
"""Topics that the robot listens to."""

SERVICES: tuple[Input, ...] = (
    Input("/sim/step", "farsteer_msgs/srv/Step", "lockstep only: advance so many ticks of 20 ms"),
    Input("/teleop/estop", "std_srvs/srv/Trigger", "brake and stay braked"),
    Input("/teleop/estop_reset", "std_srvs/srv/Trigger", "release the e-stop"),
    Input("/teleop/take_over", "std_srvs/srv/Trigger", "take the lease from whoever drives"),
    Input(
        "/localization/undo",
        "std_srvs/srv/Trigger",
        "take back the last accepted hint, or where a search has placed the robot",
    ),
)


def tf_static(mounts: Mounts) -> Message:
    """Return the message of ``/tf_static``."""
    transforms = [_transform(0, "base_link", name, pose) for name, pose in mounts.items()]
    return {"transforms": transforms}


def map_info(cloud: Cloud) -> Message:
    """Return the message of ``/map_info``."""
    low, high = cloud.bounds
    return {
        "name": cloud.name,
        "frame_id": cloud.frame,
        "sha256": cloud.sha256,
        "points": len(cloud.points),
        "min": _vector(low),
        "max": _vector(high),
    }


def markdown() -> str:
    """Return the page ``docs/topics.md``."""

    def rate(topic: Topic) -> str:
        return f"{50 / topic.every:g} Hz" if topic.every else "as it comes"

    def rows(inputs: tuple[Input, ...]) -> list[str]:
        return [f"| `{i.name}` | `{i.type}` | {i.about} |" for i in inputs]

    lines = [
        "# Topics",
        "",
        "This page is made from the table in `teleop/robot/topics.py`: `python -m teleop.robot.topics`.",
        "Rates are of robot time. Robot topics cannot be published by clients.",
        "",
        "## From the robot",
        "",
        "| topic | type | rate | what |",
        "|---|---|---|---|",
        *(
            f"| `{t.name}` | `{t.type}` | {rate(t)}{', latched' if t.latch else ''} | {t.about} |"
            for t in OUTPUTS
        ),
        *(f"| `{i.name}` | `{i.type}` | once | {i.about} |" for i in (TF_STATIC, MAP_INFO)),
        "",
        "## To the robot",
        "",
        "| topic | type | what |",
        "|---|---|---|",
        *rows(INPUTS),
        "",
        "## Services",
        "",
        "| service | type | what |",
        "|---|---|---|",
        *rows(SERVICES),
        "",
    ]
    return "\n".join(lines)


def latched(cloud: Cloud, mounts: Mounts) -> Mapping[Input, Message]:
    """Return what is published once."""
    return {TF_STATIC: tf_static(mounts), MAP_INFO: map_info(cloud)}


if __name__ == "__main__":
    sys.stdout.write(markdown())
