"""Command arbitration of the robot: driver's lease, deadman, watchdog and latched e-stop.

The same rules apply to every client. All times are the ``now`` of the tick: simulated in lockstep,
monotonic in real time, and never a client's stamp.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from localization.types import SECOND, Twist
from teleop.joystick import VelocityRequest
from teleop.robot.inbox import EStop, EStopReset, InboxMessage
from teleop.robot.speed_limits import SpeedLimits

_STANDSTILL = Twist.planar(0.0, 0.0)


class ControlMode(StrEnum):
    """Whether the robot can be driven, and why not."""

    IDLE = "idle"
    """No client holds the lease."""
    ARMED = "armed"
    """A driver holds the lease and its commands are followed."""
    DISARMED = "disarmed"
    """A driver holds the lease but must first send a neutral stick."""
    ESTOP = "estop"
    """The e-stop is latched: no command is followed until it is reset."""


@dataclass(frozen=True, slots=True)
class SafetyConfig:
    """Timeouts of the command path."""

    watchdog: int = SECOND // 2
    """Time for which a command stays in force [ns]; then the robot brakes and the driver must re-arm."""
    lease: int = 2 * SECOND
    """Silence after which a driver loses the lease [ns]."""


@dataclass(frozen=True, slots=True, eq=False)
class ControlState:
    """State of the command path, as published on ``/teleop/state``."""

    control: ControlMode
    """Whether the robot can be driven."""
    reason: str
    """Why the state was entered, for people."""
    controller: str
    """Name of the client that holds the lease; empty if there is no driver."""
    command_age: int
    """Time since the driver's last command [ns]; 0 if there is no driver."""
    twist: Twist
    """The command in force."""


def reset_rejection(latched: EStop | None, reset: EStopReset) -> str | None:
    """Return why an e-stop may not be reset by a client; None if it may.

    Only the holder of the token that latched it, or an administrator, may reset it.

    Args:
        latched: The latched e-stop; None if there is none.
        reset: The request.
    """
    if latched is None or reset.admin or reset.holder == latched.holder:
        return None
    return f"{latched.holder or latched.client} stopped the robot; only that token or an admin resets it"


def estop_after(latched: EStop | None, messages: Iterable[InboxMessage]) -> EStop | None:
    """Return the e-stop that is latched once pending messages have taken effect.

    Args:
        latched: The e-stop that is latched now; None if there is none.
        messages: Pending messages, in order.
    """
    for message in messages:
        if isinstance(message, EStop):
            latched = latched or message
        elif isinstance(message, EStopReset) and reset_rejection(latched, message) is None:
            latched = None
    return latched


class Safety:
    """Owns lease, deadman, watchdog and e-stop; turns requests into the command in force."""

    def __init__(self, limits: SpeedLimits, config: SafetyConfig = SafetyConfig()) -> None:
        """Start idle.

        Args:
            limits: Speed limits of the platform.
            config: Timeouts.
        """
        self.limits, self.config = limits, config
        self._controller = ""
        self._request_stamp = 0
        self._twist = _STANDSTILL
        self._armed = False
        self._estop: EStop | None = None
        self._reason = "no driver yet"

    @property
    def estop(self) -> EStop | None:
        """The latched e-stop, with the client that latched it; None if it is released."""
        return self._estop

    def request(self, client: str, request: VelocityRequest, now: int) -> str | None:
        """Take a client's velocity request; return why it is rejected, or None."""
        self.expire(now)
        if self._estop is not None:
            return f"e-stop by {self._estop.client} is latched; reset it first"
        if not self._controller:
            if not request.enabled:
                return None
            self._give_lease(client, "took the free lease")
        elif client != self._controller:
            return f"{self._controller} drives; call /teleop/take_over" if request.enabled else None
        self._request_stamp = now
        if request.neutral:
            self._armed, self._twist = True, _STANDSTILL
            self._reason = "neutral"
            return None
        if not self._armed:
            return "send a neutral stick first"
        self._twist = self.limits.limited(request.twist)
        self._reason = "driving"
        return None

    def take_over(self, client: str, now: int) -> None:
        """Give the lease to a client that requests it; it must re-arm."""
        self._give_lease(client, f"taken over from {self._controller or 'nobody'}")
        self._request_stamp = now

    def disconnected(self, client: str) -> None:
        """Note that a client has disconnected; if it was the driver, the robot brakes at once."""
        if client == self._controller:
            self._end(f"{client} disconnected")

    def stop(self, order: EStop) -> None:
        """Latch the e-stop, which every client may do; the first one to do so stays its owner."""
        self._estop = self._estop or order
        self._end(f"e-stop by {self._estop.client}")

    def reset(self, order: EStopReset) -> str | None:
        """Release the e-stop; return why the client may not, or None.

        The next driver must send a neutral stick first.
        """
        rejection = reset_rejection(self._estop, order)
        if rejection is None:
            self._estop = None
            self._end(f"e-stop reset by {order.client}")
        return rejection

    def expire(self, now: int) -> None:
        """Apply the timeouts: silence first stops the robot, then ends the lease."""
        silence = now - self._request_stamp
        if self._controller and silence > self.config.lease:
            self._end(f"{self._controller} was silent for {silence / SECOND:.1f} s")
        elif self._controller and silence > self.config.watchdog and self._armed:
            self._armed, self._twist = False, _STANDSTILL
            self._reason = f"no command for {silence / SECOND:.2f} s"

    def command(self, now: int) -> Twist:
        """Return the command in force."""
        self.expire(now)
        return self._twist

    def state(self, now: int) -> ControlState:
        """Return the state of the command path."""
        self.expire(now)
        control = ControlMode.IDLE
        if self._estop is not None:
            control = ControlMode.ESTOP
        elif self._controller:
            control = ControlMode.ARMED if self._armed else ControlMode.DISARMED
        age = now - self._request_stamp if self._controller else 0
        return ControlState(control, self._reason, self._controller, age, self._twist)

    def _give_lease(self, client: str, reason: str) -> None:
        self._controller, self._reason = client, f"{client} {reason}"
        self._armed, self._twist = False, _STANDSTILL

    def _end(self, reason: str) -> None:
        """End the lease, if there is one, and stop the robot."""
        self._controller, self._armed, self._twist, self._reason = "", False, _STANDSTILL, reason
