"""The operator's station: a rosbridge client, what it has heard, and what it can say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

import numpy as np

from localization.geometry import FloatArray
from localization.maps.cloud import Cloud
from localization.types import SECOND, Health, Pose, Twist
from teleop.joystick import JoystickLayout, write_joy
from teleop.operator.threaded_display import DisplayProtocol
from teleop.rosbridge.client.client import Client

TOPICS: Final[Mapping[str, str]] = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/map_info": "farsteer_msgs/msg/MapInfo",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/localization/status": "farsteer_msgs/msg/LocalizationStatus",
    "/localization/hint_verdict": "farsteer_msgs/msg/HintVerdict",
    "/teleop/state": "farsteer_msgs/msg/TeleopState",
    "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/odom": "nav_msgs/msg/Odometry",
    "/local_cloud": "sensor_msgs/msg/PointCloud2",
    "/ground_truth/odom": "nav_msgs/msg/Odometry",
}
"""What a station listens to; the truth is for the display alone."""

_OFTEN_ENOUGH: Final[Mapping[str, int]] = {"/clock": 100, "/odom": 100, "/ground_truth/odom": 100}
"""Topics that come faster than an eye follows are asked for at this period [ms]."""

JOY: Final = "/joy"
INITIALPOSE: Final = "/initialpose"


class OperatorClient:
    """Joins a client and a display; knows the robot's time, its believed pose and its health."""

    def __init__(
        self,
        client: Client,
        cloud: Cloud,
        display: DisplayProtocol | None = None,
        *,
        layout: JoystickLayout | None = None,
        tell: Callable[[str, Mapping[str, Any]], None] = lambda topic, message: None,
    ) -> None:
        """Build on a client that need not be connected yet; ``tell`` gets each message as well."""
        self.client, self._cloud, self._display = client, cloud, display
        self._layout, self._tell = layout or JoystickLayout(), tell
        self.now = 0
        """The robot's time [ns]."""
        self.map_from_base: Pose | None = None
        self.health = Health.WAITING
        self.map_sha256 = ""
        """Of the robot's map; empty until it is known."""

    async def start(self) -> None:
        """Ask for the topics and announce what will be published."""
        # A wish that is not followed is answered at this level.
        await self.client.set_level("warning")
        for topic, kind in TOPICS.items():
            hear = partial(self.hear, topic)
            throttle = _OFTEN_ENOUGH.get(topic, 0)
            await self.client.subscribe(
                topic, kind, hear, throttle_rate=throttle, compression="cbor"
            )
        await self.client.advertise(JOY, "sensor_msgs/msg/Joy")
        await self.client.advertise(INITIALPOSE, "geometry_msgs/msg/PoseWithCovarianceStamped")

    def hear(self, topic: str, message: Mapping[str, Any]) -> None:
        """Take in one message."""
        match topic:
            case "/clock":
                self.now = read_stamp(message["clock"])
            case "/map_info":
                self.map_sha256 = str(message["sha256"])
            case "/localization/status":
                self.health = Health(message["health"])
            case "/tf":
                self.map_from_base = map_from_base(message["transforms"])
        if self._display is not None:
            self._display.show(topic, message)
        self._tell(topic, message)

    async def step(self, ticks: int) -> str | None:
        """In lockstep, have the robot advance; return why it did not, if so.

        All messages of these ticks have been heard when this returns.

        Raises:
            ServiceCallError: if the robot is not in lockstep, or another client steps it.
        """
        answer = await self.client.call("/sim/step", {"ticks": ticks}, timeout=60.0)
        self.now = read_stamp(answer["stamp"])
        return None if answer["success"] else str(answer["message"])

    @property
    def map_complaint(self) -> str | None:
        """What is wrong with the two sides' maps, if they are not the same file."""
        if self.map_sha256 in ("", self._cloud.sha256):
            return None
        return (
            f"the robot's map has hash {self.map_sha256[:12]}, ours {self._cloud.sha256[:12]}: "
            "both sides must hold the same file"
        )

    async def drive(self, twist: Twist, *, enabled: bool) -> None:
        """Send a Joy that asks for a twist, with the deadman held or not."""
        axes, buttons = write_joy(twist, self._layout, enabled=enabled)
        if self._display is not None:
            forward, turn = float(twist.linear[0]), float(twist.angular[2])
            self._display.command(forward, turn, enabled, self.now)
        header = {"stamp": time_message(self.now), "frame_id": "operator"}
        await self.client.publish(JOY, {"header": header, "axes": axes, "buttons": buttons})

    async def hint(self, pose: Pose, covariance: FloatArray) -> None:
        """Tell the robot where it might be; covariance (6, 6) in ROS's order, all zeros for default."""
        if self._display is not None:
            self._display.hint(pose, covariance, self.now)
        w, x, y, z = pose.quaternion_wxyz.tolist()
        px, py, pz = pose.position.tolist()
        await self.client.publish(
            INITIALPOSE,
            {
                "header": {"stamp": time_message(self.now), "frame_id": "map"},
                "pose": {
                    "pose": {
                        "position": {"x": px, "y": py, "z": pz},
                        "orientation": {"x": x, "y": y, "z": z, "w": w},
                    },
                    "covariance": np.asarray(covariance).ravel().tolist(),
                },
            },
        )


def read_stamp(time: Mapping[str, int]) -> int:
    """Return the stamp [ns] of a time message."""
    return int(time["sec"]) * SECOND + int(time["nanosec"])


def time_message(stamp: int) -> dict[str, int]:
    """Return the time message of a stamp [ns]."""
    sec, nanosec = divmod(stamp, SECOND)
    return {"sec": sec, "nanosec": nanosec}


def map_from_base(transforms: list[Mapping[str, Any]]) -> Pose | None:
    """Chain ``map`` to ``odom`` to ``base_link``; None before the robot is placed."""
    poses = {t["child_frame_id"]: _pose(t["transform"]) for t in transforms}
    if "odom" not in poses or "base_link" not in poses:
        return None
    return poses["odom"] @ poses["base_link"]


def _pose(transform: Mapping[str, Any]) -> Pose:
    p, q = transform["translation"], transform["rotation"]
    return Pose(np.array([p["x"], p["y"], p["z"]]), np.array([q["w"], q["x"], q["y"], q["z"]]))
