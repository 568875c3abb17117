"""A robot and its server in one thread: what clients want goes into each tick, its record out on the topics."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from teleop.robot.gateway import Gateway
from teleop.robot.inbox import InboxMessage
from teleop.robot.robot import Robot
from teleop.robot.tick_record import TickRecord

TickObserver = Callable[[TickRecord], None]
"""Receives the record of each tick."""

Inbox = Callable[[], Sequence[InboxMessage]]
"""Returns the messages of the next tick."""


class SteppedRobot:
    """Ticks a robot whose time is simulated, at anybody's request; reads no clock."""

    def __init__(
        self, robot: Robot, gateway: Gateway, *, observers: tuple[TickObserver, ...] = ()
    ) -> None:
        """Join a robot and its server.

        Args:
            robot: The robot.
            gateway: The gateway to its clients.
            observers: Called with the record of each tick.
        """
        self.robot, self.gateway, self.adapter = robot, gateway, gateway.adapter
        self.observers = observers
        """Called with the record of each tick."""

        self.inbox: Inbox = self.adapter.wishes.take
        """Returns the messages of the next tick; what clients want, unless something else is set."""

        self.adapter.previews.answer_at_once = robot.estimation.preview

    @property
    def stamp(self) -> int:
        """Robot time [ns]."""
        return self.robot.simulation.stamp

    def tick(self) -> TickRecord:
        """Advance the world by one tick."""
        tick = self.robot.tick(self.stamp, self.inbox())
        self.gateway.driven(tick.drive)
        self.gateway.estimated(tick.estimation)
        for observe in self.observers:
            observe(tick)
        self.gateway.server.protocol.timers.tick(tick.stamp)
        return tick
