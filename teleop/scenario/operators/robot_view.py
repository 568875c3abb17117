"""What an operator knows of the robot: the newest of what has come over its wire."""

from __future__ import annotations

from typing import Any

from localization.logs.ros_geometry import pose_from_message
from localization.types import Health, Pose
from teleop.scenario.operators.wire import Answer, Wire


class RobotView:
    """Subscribes to pose, status and command path, and remembers the newest message of each."""

    def __init__(self, wire: Wire) -> None:
        """Subscribe, and ask for the name by which the robot knows this client."""
        self._wire = wire
        self.pose: Pose | None = None
        """The newest pose, ``map_from_base``; None before the first."""

        self.seen_at = 0
        """Robot time at which it came [ns]."""

        self.health = Health.WAITING
        """State of the estimate."""

        self.control = "idle"
        """State of the command path: idle, armed, disarmed or estop."""

        self.controller = ""
        """Name of the client that drives; empty if none does."""

        self.name = ""
        """Name of this client; empty until the robot has answered."""

        wire.subscribe("/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped", self._take_pose)
        wire.subscribe(
            "/localization/status", "farsteer_msgs/LocalizationStatus", self._take_status
        )
        wire.subscribe("/teleop/state", "farsteer_msgs/TeleopState", self._take_state)
        wire.call("/teleop/session", on_answer=self._take_session)

    @property
    def others_drive(self) -> bool:
        """Whether another client holds the lease."""
        return bool(self.controller and self.name) and self.controller != self.name

    @property
    def armed(self) -> bool:
        """Whether the robot follows this client's commands."""
        return self.control == "armed" and not self.others_drive

    def _take_pose(self, message: dict[str, Any]) -> None:
        self.pose = pose_from_message(message["pose"]["pose"])
        self.seen_at = self._wire.now

    def _take_status(self, message: dict[str, Any]) -> None:
        self.health = Health(message["health"])

    def _take_state(self, message: dict[str, Any]) -> None:
        self.control, self.controller = message["state"], message["controller"]

    def _take_session(self, answer: Answer) -> None:
        self.name = str(answer.values.get("name", ""))
