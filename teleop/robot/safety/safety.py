"""Command arbitration of the robot: driver's lease, deadman, watchdog and latched e-stop.

The same rules apply to every client. All times are by the clock of the tick's ``now``: simulated in lockstep,
monotonic in real time. A command counts from its arrival at the robot's socket, not from the tick that takes
it. A client's own stamp only ever makes its commands older.
"""

from __future__ import annotations

from localization.types import SECOND, Twist
from teleop.robot.arm.arm_commands import Stream
from teleop.robot.inbox import ArmWish, Ask, DriveCommand, EStop, EStopReset, Give, Refuse
from teleop.robot.safety.arm_deadman import ArmDeadman
from teleop.robot.safety.arming import ArmingRules
from teleop.robot.safety.control_state import ControlMode, ControlState, SafetyConfig
from teleop.robot.safety.estop import reset_rejection
from teleop.robot.safety.speed_limits import SpeedLimits
from teleop.robot.safety.turns import Asking, Turn

_STANDSTILL = Twist.planar(0.0, 0.0)


class Safety:
    """Owns lease, deadman, watchdog and e-stop; turns requests into the command in force."""

    def __init__(self, limits: SpeedLimits, config: SafetyConfig | None = None) -> None:
        """Start idle.

        Args:
            limits: Speed limits of the platform.
            config: Timeouts; the defaults if not given.
        """
        self.limits, self.config = limits, config or SafetyConfig()
        self._controller = ""
        self._arrival = 0
        self._age = 0
        self._twist = _STANDSTILL
        self._armed = False
        self._estop: EStop | None = None
        self._reason = "no driver yet"
        self._arming = ArmingRules()
        self.arm = ArmDeadman(self.config)
        """The arm's deadman, which shares the lease and nothing else with that of the wheels."""
        self.narrow: SpeedLimits | None = None
        """Tighter limits for as long as the arm is off its stow pose or holds something; None for none."""
        self._asking: Asking | None = None

    @property
    def controller(self) -> str:
        """Name of the client that holds the lease; empty if there is no driver."""
        return self._controller

    @property
    def estop(self) -> EStop | None:
        """The latched e-stop, with the client that latched it; None if it is released."""
        return self._estop

    def request(self, command: DriveCommand, now: int) -> str | None:
        """Take a client's velocity request; return why it is rejected, or None.

        Args:
            command: The request; it counts from its arrival.
            now: Time of the tick [ns].
        """
        self.expire(now)
        client, request = command.client, command.request
        arrival = now if command.arrival is None else min(command.arrival, now)
        if self._estop is not None:
            return self._latched()
        if not self._controller:
            if not request.enabled:
                return None
            self._give_lease(client, "took the free lease")
            self._arrival = arrival
        elif client != self._controller:
            return self._taken() if request.enabled else None
        self._arrival, self._age = max(self._arrival, arrival), command.age
        if request.neutral:
            return self._take_neutral(command, now)
        if refusal := self.config.stale.refusal(command.age):
            self._disarm(refusal)
            return refusal
        if not self._armed:
            if refusal := self._arming.refusal(command):
                return refusal
            self._arm(client)
        share = self.config.stale.speed_share(command.age)
        self._twist = self.limits.limited(_scaled(request.twist, share))
        self._reason = "driving" if share == 1.0 else "driving slowly, for commands arrive late"
        self.expire(now)
        return None

    def take_over(self, client: str, now: int) -> None:
        """Give the lease to a client that requests it; it must re-arm."""
        self._arming.taken_over(client, self._controller)
        self._give_lease(client, f"taken over from {self._controller or 'nobody'}")
        self.arm.stop(self._reason)
        self._arrival = now

    def ask(self, message: Ask, now: int) -> str | None:
        """Note that a client asks the driver for the robot; return why it may not, or None."""
        rejection = self._turn(now).rejection(message)
        if rejection is None and self._asking is None:
            self._asking = Asking(message.client, message.number, now)
        return rejection

    def give(self, message: Give, now: int) -> str | None:
        """Give the lease to the client that asks for it, which must re-arm; return why not, or None."""
        rejection, asking = self._turn(now).rejection(message), self._asking
        if rejection is None and asking is not None:
            self._arming.taken_over(asking.client, message.client)
            self._give_lease(asking.client, f"was given the robot by {message.client}")
            self.arm.stop(self._reason)
            self._arrival = now
        return rejection

    def refuse(self, message: Refuse, now: int) -> str | None:
        """End the request of the client that asks for the robot; return why not, or None."""
        rejection = self._turn(now).rejection(message)
        if rejection is None:
            self._asking = None
        return rejection

    def admit_step(self, client: str, age: int, now: int) -> str | None:
        """Give a client that asks for a step the free lease; return why it may not have one, or None.

        Args:
            client: Name of the client.
            age: Age of the request at its arrival [ns].
            now: Time of the tick [ns].
        """
        refusal = self._admission(client, age, now)
        if refusal is None:
            self._arrival = now
        return refusal

    def admit_arm_goal(self, client: str, age: int, now: int) -> str | None:
        """Give a client that asks for a motion of the arm the free lease, as ``admit_step`` does."""
        refusal = self._admission(client, age, now)
        if refusal is None:
            self.arm.seen = now
        return refusal

    def request_arm(self, message: ArmWish, stream: Stream, now: int) -> str | None:
        """Take a client's command to the arm; return why it is refused, or None.

        Args:
            message: The message; it counts from its arrival.
            stream: What it carries.
            now: Time of the tick [ns].
        """
        self.expire(now)
        self.arm.observe(message, stream)
        client = message.client
        if self._estop is not None:
            return self._latched() if stream.engaged else None
        if not self._controller and stream.engaged:
            self._give_lease(client, "took the free lease")
        if client != self._controller:
            return self._taken() if stream.engaged else None
        arrival = now if message.arrival is None else min(message.arrival, now)
        refusal = self.arm.take(message, stream, arrival)
        self.expire(now)
        return refusal

    def arm_alive(self, client: str, arrival: int | None, now: int) -> None:
        """Note that the driver is connected while a goal of its moves the arm."""
        if client == self._controller:
            self.arm.seen = max(self.arm.seen, now if arrival is None else min(arrival, now))

    def _admission(self, client: str, age: int, now: int) -> str | None:
        """Give a client the free lease; return why it may not have one, or None."""
        self.expire(now)
        if self._estop is not None:
            return self._latched()
        if self._controller and client != self._controller:
            return self._taken()
        if self.config.stale.refusal(age):
            limit = self.config.stale.refuse / SECOND
            return f"the way from you takes {age / SECOND:.1f} s, and {limit:g} s is the limit"
        if not self._controller:
            self._give_lease(client, "took the free lease")
        return None

    def _latched(self) -> str:
        who = self._estop.client if self._estop else ""
        return f"e-stop by {who} is latched; reset it first"

    def _taken(self) -> str:
        return f"{self._controller} drives; call /teleop/take_over"

    def drive_step(self, twist: Twist, now: int) -> None:
        """Follow a step of the driver, which needs no neutral stick: each step is asked for by itself."""
        self._arm(self._controller)
        self._arrival, self._age = now, 0
        self._twist, self._reason = self.limits.limited(twist), "driving a step"

    def end_step(self, now: int) -> None:
        """Stop after a step; the driver keeps the lease, as one that has just fallen silent does."""
        self._arrival = now
        self._disarm("at rest after a step")

    def disconnected(self, client: str) -> None:
        """Note that a client has disconnected; if it was the driver, the robot brakes at once."""
        self._arming.forget(client)
        self.arm.forget(client)
        self._asking = Turn(client, self._asking).without(client).asking
        if client == self._controller:
            self._end(f"{client} disconnected")

    def server_lost(self, reason: str) -> None:
        """Note that what connects the clients has stopped: all of them are gone."""
        self._arming.forget_all()
        self.arm.forget_all()
        self._asking = None
        self._end(reason)

    def stop(self, order: EStop) -> None:
        """Latch the e-stop, which every client may do; the first one to do so stays its owner."""
        self._estop = self._estop or order
        self._arming.estopped()
        self._end(f"e-stop by {self._estop.client}")

    def reset(self, order: EStopReset) -> str | None:
        """Release the e-stop; return why the client may not, or None.

        The next driver must send a neutral stick first.
        """
        rejection = reset_rejection(self._estop, order)
        # Where nothing is latched there is nothing to release, and a driver keeps the robot.
        if rejection is None and self._estop is not None:
            self._estop = None
            self._end(f"e-stop reset by {order.client}")
        return rejection

    def expire(self, now: int) -> None:
        """Apply the timeouts: silence first stops the robot, then ends the lease."""
        if self._asking is not None and self._asking.expired(now):
            self._asking = None
        silence = now - self._arrival
        silence_of_both = now - max(self._arrival, self.arm.seen)
        if self._controller and silence_of_both > self.config.lease:
            if self._armed:
                self._arming.silenced(self._controller)
            self._end(f"{self._controller} was silent for {silence_of_both / SECOND:.1f} s")
        # What is in force now stays so until the next tick.
        elif self._armed and silence + self.config.tick > self.config.watchdog:
            self._arming.silenced(self._controller)
            self._disarm(f"no command for {silence / SECOND:.3f} s")
        self.arm.expire(now)

    def command(self, now: int) -> Twist:
        """Return the command in force."""
        self.expire(now)
        return self._in_force()

    def age(self, now: int) -> int:
        """Return the age of the driver's command, with its way to the robot [ns]; 0 if there is no driver."""
        return now - self._arrival + self._age if self._controller else 0

    def halt(self, reason: str) -> None:
        """Stop the robot; the driver keeps the lease and must send a neutral stick."""
        self._disarm(reason)

    def state(self, now: int) -> ControlState:
        """Return the state of the command path."""
        self.expire(now)
        control = ControlMode.IDLE
        if self._estop is not None:
            control = ControlMode.ESTOP
        elif self._controller:
            control = ControlMode.ARMED if self._armed else ControlMode.DISARMED
        driven = bool(self._controller)
        reason = self._reason
        if self.narrow is not None and self._in_force().linear[0] != self._twist.linear[0]:
            reason = "driving slowly, for the arm is not folded or holds something"
        return ControlState(
            control,
            reason,
            self._controller,
            now - max(self._arrival, self.arm.seen) if driven else 0,
            self._in_force(),
            self._estop,
            self._age if driven else 0,
            self.config.stale,
            self._asking,
            now - self._asking.since if self._asking else 0,
        )

    def _in_force(self) -> Twist:
        return self._twist if self.narrow is None else self.narrow.limited(self._twist)

    def _turn(self, now: int) -> Turn:
        self.expire(now)
        return Turn(self._controller, self._asking)

    def _take_neutral(self, command: DriveCommand, now: int) -> str | None:
        """Stop, and arm unless the link is too slow."""
        if refusal := self.config.stale.refusal(command.age):
            self._disarm(refusal)
            # A stick that is let go asks for nothing that could be refused.
            return refusal if command.request.enabled else None
        self._arm(command.client)
        self._twist, self._reason = _STANDSTILL, "neutral"
        self.expire(now)
        return None

    def _arm(self, client: str) -> None:
        self._armed = True
        self._arming.armed(client)

    def _give_lease(self, client: str, reason: str) -> None:
        self._controller, self._reason, self._age = client, f"{client} {reason}", 0
        self._armed, self._twist = False, _STANDSTILL
        self._asking = Turn("", self._asking).given(client).asking

    def _disarm(self, reason: str) -> None:
        """Stop the robot; the driver keeps the lease and must arm again."""
        self._armed, self._twist, self._reason = False, _STANDSTILL, reason

    def _end(self, reason: str) -> None:
        """End the lease, if there is one, and stop the robot."""
        self._controller, self._age = "", 0
        self._disarm(reason)
        self.arm.stop(reason)


def _scaled(twist: Twist, share: float) -> Twist:
    return twist if share == 1.0 else Twist(share * twist.linear, share * twist.angular)
