"""Safety on the robot: one driver at a time, who must hold on; silence means stop, e-stop stays.

It holds for every client alike. All times are the ``now`` of the tick: simulated in lockstep, monotonic
in real time, and never a client's stamp.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from localization.types import SECOND, Twist
from teleop.joystick import VelocityRequest

_STOP = Twist.planar(0.0, 0.0)


class ControlMode(StrEnum):
    """Who drives, if anybody."""

    IDLE = "idle"
    """Nobody holds the lease."""
    ARMED = "armed"
    """A driver holds it and may drive."""
    DISARMED = "disarmed"
    """A driver holds it but must first show a neutral stick."""
    ESTOP = "estop"
    """Latched: nobody drives until it is reset."""


@dataclass(frozen=True, slots=True)
class SafetyConfig:
    """Times and limits of the command path."""

    watchdog: int = SECOND // 2
    """A command holds this long [ns]; then the robot brakes and the driver must re-arm."""
    lease: int = 2 * SECOND
    """A driver silent for this long loses the lease [ns]."""
    max_speed: float = 0.7
    """[m/s]."""
    max_turn: float = float(np.deg2rad(140.0))
    """[rad/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class ControlState:
    """What ``/teleop/state`` says."""

    control: ControlMode
    reason: str
    controller: str
    """Name of the client that holds the lease; empty if none does."""
    command_age: int
    """Since the controller's last command [ns]; 0 if there is no controller."""
    twist: Twist
    """The command in force."""


class Safety:
    """Owns lease, deadman, watchdog and e-stop; turns wishes into the command in force."""

    def __init__(self, config: SafetyConfig = SafetyConfig()) -> None:
        self.config = config
        self._controller = ""
        self._request_stamp = 0
        self._twist = _STOP
        self._armed = False
        self._estop = ""
        self._reason = "nobody drives yet"

    def request(self, client: str, request: VelocityRequest, now: int) -> str | None:
        """Take a client's wish; return why it is not followed, if it is not."""
        self.expire(now)
        if self._estop:
            return f"e-stop by {self._estop} is latched; reset it first"
        if not self._controller:
            if not request.enabled:
                return None
            self._give_lease(client, "took the free lease")
        elif client != self._controller:
            return (
                f"{self._controller} drives; ask for /teleop/take_over" if request.enabled else None
            )
        self._request_stamp = now
        if request.neutral:
            self._armed, self._twist = True, _STOP
            self._reason = "neutral"
            return None
        if not self._armed:
            return "show a neutral stick first"
        self._twist = self._limited(request.twist)
        self._reason = "driving"
        return None

    def take_over(self, client: str, now: int) -> None:
        """Give the lease to a client that asks for it; it must re-arm."""
        self._give_lease(client, f"taken over from {self._controller or 'nobody'}")
        self._request_stamp = now

    def disconnected(self, client: str) -> None:
        """Note that a client is gone; if it drove, the robot brakes at once."""
        if client == self._controller:
            self._end(f"{client} disconnected")

    def stop(self, client: str) -> None:
        """Latch the e-stop; any client may."""
        self._estop = self._estop or client
        self._end(f"e-stop by {self._estop}")

    def reset(self, client: str) -> None:
        """Release the e-stop; whoever drives next must show a neutral stick first."""
        self._estop = ""
        self._end(f"e-stop reset by {client}")

    def expire(self, now: int) -> None:
        """Let time tell: silence stops the robot, then costs the lease."""
        silence = now - self._request_stamp
        if self._controller and silence > self.config.lease:
            self._end(f"{self._controller} was silent for {silence / SECOND:.1f} s")
        elif self._controller and silence > self.config.watchdog and self._armed:
            self._armed, self._twist = False, _STOP
            self._reason = f"no command for {silence / SECOND:.2f} s"

    def command(self, now: int) -> Twist:
        """Return the command in force."""
        self.expire(now)
        return self._twist

    def state(self, now: int) -> ControlState:
        """Return what there is to tell about control."""
        self.expire(now)
        control = ControlMode.IDLE
        if self._estop:
            control = ControlMode.ESTOP
        elif self._controller:
            control = ControlMode.ARMED if self._armed else ControlMode.DISARMED
        age = now - self._request_stamp if self._controller else 0
        return ControlState(control, self._reason, self._controller, age, self._twist)

    def _give_lease(self, client: str, reason: str) -> None:
        self._controller, self._reason = client, f"{client} {reason}"
        self._armed, self._twist = False, _STOP

    def _end(self, reason: str) -> None:
        self._controller, self._armed, self._twist, self._reason = "", False, _STOP, reason

    def _limited(self, twist: Twist) -> Twist:
        c = self.config
        return Twist.planar(
            float(np.clip(twist.linear[0], -c.max_speed, c.max_speed)),
            float(np.clip(twist.angular[2], -c.max_turn, c.max_turn)),
        )
