"""A robot that does exactly what is asked, behind a protocol: what operators see of it is up to the test."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from localization.types import SECOND, Twist
from teleop.joystick import read_joy
from teleop.ros_types import registry
from teleop.rosbridge import ClientLimits, Protocol, nanoseconds, stamp
from teleop.scenario.operators.memory_transport import MemoryTransport
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Recorder, Wire

TICK = SECOND // 50


class Unicycle:
    """Moves as its last command says; arms on a neutral stick."""

    def __init__(self, x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> None:
        self.now = 0
        self.x, self.y, self.heading = x, y, heading
        self.twist = Twist.planar(0.0, 0.0)
        self.control, self.health, self.driver = "idle", "tracking", ""
        self.publishing = True
        self.ranges = [20.0] * 61
        self.guard: dict[str, Any] = {"state": "free"}
        """What the guard says; it changes no command here."""
        self.commands: list[tuple[int, float, float, bool]] = []
        """Time [ns], forward speed, turn rate and deadman of each command."""
        self.stamps: list[int] = []
        """Stamp of each command by the operator's clock [ns]."""
        self.hints: list[dict[str, Any]] = []
        self.calls: list[str] = []
        self.protocol = Protocol(registry(), limits=ClientLimits.unhurried())
        self.transport = MemoryTransport(self.protocol, lambda: self.now)
        self.seats: list[tuple[Operator, Wire]] = []
        topics = self.protocol.topics
        for name, kind in (
            ("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
            ("/localization/status", "farsteer_msgs/msg/LocalizationStatus"),
            ("/teleop/state", "farsteer_msgs/msg/TeleopState"),
            ("/scan", "sensor_msgs/msg/LaserScan"),
            ("/teleop/guard", "farsteer_msgs/msg/Guard"),
        ):
            topics.advertise(name, kind)
        topics.subscribe("/joy", "sensor_msgs/msg/Joy", self._joy)
        topics.subscribe("/cmd_vel", "geometry_msgs/msg/Twist", self._velocity)
        topics.subscribe(
            "/initialpose",
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            lambda client, message, now: self.hints.append(message),
        )
        self.protocol.services.serve(
            "/teleop/session",
            "farsteer_msgs/srv/Session",
            lambda client, request, now: {"client": client, "name": f"client {client}"},
        )
        for name in (
            "/localization/undo",
            "/localization/relocalize",
            "/teleop/estop",
            "/teleop/estop_reset",
            "/teleop/take_over",
            "/teleop/ask",
            "/teleop/give",
            "/teleop/refuse",
        ):
            self.protocol.services.serve(name, "std_srvs/srv/Trigger", self._noting(name))

    def _noting(self, name: str) -> Any:
        def answer(client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
            self.calls.append(name)
            if name.startswith("/teleop/estop"):
                self.control = "idle" if name.endswith("reset") else "estop"
            return {"success": True}

        return answer

    def _joy(self, client: int, message: dict[str, Any], now: int) -> None:
        self.stamps.append(nanoseconds(message["header"]["stamp"]))
        request = read_joy(list(message["axes"]), list(message["buttons"]))
        self._drive(client, request.twist, request.enabled, now)

    def _velocity(self, client: int, message: dict[str, Any], now: int) -> None:
        twist = Twist.planar(message["linear"]["x"], message["angular"]["z"])
        self._drive(client, twist, True, now)

    def _drive(self, client: int, twist: Twist, enabled: bool, now: int) -> None:
        forward, turn = float(twist.linear[0]), float(twist.angular[2])
        self.commands.append((now, forward, turn, enabled))
        if self.control in ("idle", "disarmed") and enabled and not (forward or turn):
            self.control, self.driver = "armed", f"client {client}"
        still = self.control != "armed" or not enabled
        self.twist = Twist.planar(0.0, 0.0) if still else twist

    def seat(
        self, operator: Operator, briefing: Briefing, recorder: Recorder | None = None
    ) -> Wire:
        """Connect an operator."""
        wire = self.transport.connect(recorder=recorder)
        operator.begin(wire, briefing)
        self.seats.append((operator, wire))
        return wire

    def tick(self) -> None:
        """Advance by 20 ms."""
        seconds = TICK / SECOND
        self.heading += seconds * float(self.twist.angular[2])
        self.x += seconds * float(self.twist.linear[0]) * math.cos(self.heading)
        self.y += seconds * float(self.twist.linear[0]) * math.sin(self.heading)
        self.now += TICK
        if self.publishing and self.now % (5 * TICK) == 0:
            self._publish()
        self.protocol.timers.tick(self.now)
        for operator, wire in self.seats:
            wire.deliver()
            operator.act(wire, self.now)

    def _publish(self) -> None:
        header = {"stamp": stamp(self.now), "frame_id": "map"}
        half = 0.5 * self.heading
        pose = {
            "position": {"x": self.x, "y": self.y, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)},
        }
        publish = self.protocol.topics.publish
        publish("/amcl_pose", {"header": header, "pose": {"pose": pose}}, self.now)
        publish("/localization/status", {"header": header, "health": self.health}, self.now)
        state = {"state": self.control, "controller": self.driver}
        publish("/teleop/state", {"header": header, **state}, self.now)
        publish("/scan", scan(self.ranges), self.now)
        publish("/teleop/guard", self.guard, self.now)

    def run(self, seconds: float) -> None:
        """Tick for a time [s]."""
        for _ in range(round(seconds * 50)):
            self.tick()

    def sent_after(self, seconds: float) -> list[tuple[float, float, bool]]:
        """Return forward speed, turn rate and deadman of the commands after a time [s]."""
        return [command[1:] for command in self.commands if command[0] > seconds * SECOND]


def scan(ranges: list[float]) -> dict[str, Any]:
    """Return a scan of the half circle ahead, right to left [m]."""
    return {
        "angle_min": -math.pi / 2,
        "angle_max": math.pi / 2,
        "angle_increment": math.pi / (len(ranges) - 1),
        "range_min": 0.05,
        "range_max": 19.0,
        "ranges": np.array(ranges, dtype=np.float32),
    }
