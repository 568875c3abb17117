"""The hands of an operator: a stick with its deadman, or a stream of velocities."""

from __future__ import annotations

from typing import Any, Literal

from localization.types import Twist
from teleop.joystick import write_joy
from teleop.scenario.operators.wire import Wire

_STANDSTILL = Twist.planar(0.0, 0.0)


class Hands:
    """Sends commands, with the stamp of the operator's clock where a message has one."""

    def __init__(self, interface: Literal["joy", "cmd_vel"] = "joy") -> None:
        """Take up the topic to drive by: ``/joy`` or ``/cmd_vel``."""
        self._interface = interface
        self.stamp_age = 0
        """By so much the stamps that are sent are older than the operator's clock [ns]."""

    def hold(self, wire: Wire, twist: Twist) -> None:
        """Ask for a velocity, with the deadman held."""
        self._send(wire, twist, enabled=True)

    def neutral(self, wire: Wire) -> None:
        """Hold the deadman, with the stick at rest; this arms the robot."""
        self._send(wire, _STANDSTILL, enabled=True)

    def rest(self, wire: Wire) -> None:
        """Let the deadman go, with the stick at rest; of a stream of velocities nothing is sent."""
        if self._interface == "joy":
            self._send(wire, _STANDSTILL, enabled=False)

    def let_go(self, wire: Wire, twist: Twist) -> None:
        """Let the deadman go, with the stick where it is; of a stream of velocities nothing is sent."""
        if self._interface == "joy":
            self._send(wire, twist, enabled=False)

    def _send(self, wire: Wire, twist: Twist, *, enabled: bool) -> None:
        forward, turn = float(twist.linear[0]), float(twist.angular[2])
        if self._interface == "cmd_vel":
            message: dict[str, Any] = {"linear": {"x": forward}, "angular": {"z": turn}}
            wire.publish("/cmd_vel", "geometry_msgs/Twist", message)
            return
        axes, buttons = write_joy(twist, enabled=enabled)
        header = {"stamp": wire.stamp_before(self.stamp_age)}
        wire.publish(
            "/joy", "sensor_msgs/Joy", {"header": header, "axes": axes, "buttons": buttons}
        )
