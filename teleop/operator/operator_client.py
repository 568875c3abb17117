"""The operator's rosbridge client: the robot's state as received, and the messages it can send."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_geometry import pose_from_message, pose_to_dict
from localization.logs.ros_stamps import stamp_from_message, stamp_to_dict
from localization.maps.cloud import Cloud
from localization.types import Health, Pose, Twist
from teleop.joystick import write_joy
from teleop.operator.display.threaded_display import DisplayProtocol
from teleop.operator.message_decoding import map_from_base
from teleop.rosbridge.client.client import Client

TOPICS: Final[Mapping[str, str]] = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/map_info": "farsteer_msgs/msg/MapInfo",
    "/drive_limits": "farsteer_msgs/msg/DriveLimits",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/localization/status": "farsteer_msgs/msg/LocalizationStatus",
    "/localization/hint_verdict": "farsteer_msgs/msg/HintVerdict",
    "/localization/candidates": "geometry_msgs/msg/PoseArray",
    "/teleop/state": "farsteer_msgs/msg/TeleopState",
    "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/odom": "nav_msgs/msg/Odometry",
    "/local_cloud": "sensor_msgs/msg/PointCloud2",
    "/ground_truth/odom": "nav_msgs/msg/Odometry",
}
"""Topics that an operator subscribes to, with their types; the ground truth is for the display alone."""

WATCHED: Final[Mapping[str, str]] = {
    "/scan": "sensor_msgs/msg/LaserScan",
    "/scan_vertical": "sensor_msgs/msg/LaserScan",
    "/imu/data": "sensor_msgs/msg/Imu",
    "/bumper_state": "farsteer_msgs/msg/BumperState",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
"""Topics that a person at a station watches as well."""

CAMERA: Final[Mapping[str, str]] = {
    "/camera/rgb/camera_info": "sensor_msgs/msg/CameraInfo",
    "/camera/rgb/image_rect_color/compressed": "sensor_msgs/msg/CompressedImage",
    "/camera/depth/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
}
"""Topics of a camera, for who wants to see its pictures."""

_THROTTLE: Final[Mapping[str, int]] = {
    "/clock": 100,
    "/odom": 100,
    "/ground_truth/odom": 100,
    "/scan": 100,
    "/scan_vertical": 100,
    "/imu/data": 100,
    "/camera/rgb/camera_info": 2000,
    "/camera/rgb/image_rect_color/compressed": 100,
    "/camera/depth/image_raw/compressed": 500,
}
"""Least periods of topics that come faster than an eye follows, or are large [ms]."""

JOY: Final = "/joy"
INITIALPOSE: Final = "/initialpose"


class OperatorClient:
    """Joins a client and a display; knows the robot's time, its estimated pose and its health."""

    def __init__(
        self,
        client: Client,
        cloud: Cloud | None = None,
        display: DisplayProtocol | None = None,
        *,
        topics: Mapping[str, str] = TOPICS,
        on_message: Callable[[str, Mapping[str, Any]], None] = lambda topic, message: None,
    ) -> None:
        """Build on a client.

        Args:
            client: The connection, which need not be established yet.
            cloud: This side's copy of the robot's map; None if it is fetched.
            display: Draws what is received and sent.
            topics: Topics to subscribe to, with their types.
            on_message: Called with the topic and each message received.
        """
        self.client, self._cloud, self._display = client, cloud, display
        self._topics = topics
        self._on_message = on_message
        self.now = 0
        """The robot's time [ns]."""
        self.map_from_base: Pose | None = None
        """The estimated pose; None before the robot is localised."""
        self.health = Health.WAITING
        """Health of the robot's localisation."""
        self.map_sha256 = ""
        """Hash of the robot's map; empty until it is received."""
        self.map_name = ""
        """Name of the robot's map; empty until it is received."""
        self.places: Mapping[str, Pose] = {}
        """Named places of the map."""

    async def start(self) -> None:
        """Subscribe to the topics and advertise what will be published."""
        # A rejected velocity request is reported at this level.
        await self.client.set_level("warning")
        for topic, kind in self._topics.items():
            receive = partial(self.receive, topic)
            throttle = _THROTTLE.get(topic, 0)
            await self.client.subscribe(
                topic, kind, receive, throttle_rate=throttle, compression="cbor"
            )
        await self.client.advertise(JOY, "sensor_msgs/msg/Joy")
        await self.client.advertise(INITIALPOSE, "geometry_msgs/msg/PoseWithCovarianceStamped")

    def receive(self, topic: str, message: Mapping[str, Any]) -> None:
        """Take a message of a topic."""
        match topic:
            case "/clock":
                self.now = stamp_from_message(message["clock"])
            case "/map_info":
                self.map_sha256, self.map_name = str(message["sha256"]), str(message["name"])
                poses = [pose_from_message(pose) for pose in message.get("places", ())]
                self.places = dict(zip(message.get("place_names", ()), poses, strict=False))
            case "/localization/status":
                self.health = Health(message["health"])
            case "/tf":
                self.map_from_base = map_from_base(message["transforms"])
        if self._display is not None:
            self._display.show(topic, message)
        self._on_message(topic, message)

    async def step(self, ticks: int) -> str | None:
        """Advance a robot in lockstep; return why it did not advance, or None.

        All messages of these ticks have been received when this returns.

        Args:
            ticks: Number of ticks of 20 ms.

        Raises:
            ServiceCallError: If the robot is not in lockstep, or another client steps it.
        """
        answer = await self.client.call("/sim/step", {"ticks": ticks}, timeout=60.0)
        self.now = stamp_from_message(answer["stamp"])
        return None if answer["success"] else str(answer["message"])

    @property
    def map_mismatch(self) -> str | None:
        """How the two sides' maps differ; None if they are the same file, or not yet known."""
        if self._cloud is None or self.map_sha256 in ("", self._cloud.sha256):
            return None
        return (
            f"the robot's map has hash {self.map_sha256[:12]}, ours {self._cloud.sha256[:12]}: "
            "both sides must have the same file"
        )

    async def drive(self, twist: Twist, *, enabled: bool) -> None:
        """Send a Joy message that requests a twist, with the deadman button held or not."""
        axes, buttons = write_joy(twist, enabled=enabled)
        if self._display is not None:
            forward, turn = float(twist.linear[0]), float(twist.angular[2])
            self._display.command(forward, turn, enabled, self.now)
        header = {"stamp": stamp_to_dict(self.now), "frame_id": "operator"}
        await self.client.publish(JOY, {"header": header, "axes": axes, "buttons": buttons})

    async def hint(self, pose: Pose, covariance: FloatArray) -> None:
        """Send a pose hint.

        Args:
            pose: Approximate ``map_from_base``.
            covariance: Its covariance (6, 6) in ROS's order [m, rad]; all zeros for the robot's default.
        """
        if self._display is not None:
            self._display.hint(pose, covariance, self.now)
        await self.client.publish(
            INITIALPOSE,
            {
                "header": {"stamp": stamp_to_dict(self.now), "frame_id": "map"},
                "pose": {
                    "pose": pose_to_dict(pose),
                    "covariance": np.asarray(covariance).ravel().tolist(),
                },
            },
        )
