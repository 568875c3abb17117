"""The robot's input topics: what clients publish becomes what they want of the robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final

from localization.types import SECOND, InvalidReadingError
from teleop.joystick import JoystickError
from teleop.link.command_age import CommandAge, RoundTrips
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.input_messages import hint_reading, joy_command, twist_command
from teleop.robot.clients.robot_services import NOT_LISTENING
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import DriveCommand, PoseHint
from teleop.robot.topics.topic_table import INPUTS
from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.protocol.protocol import Protocol

_HINT_PERIOD: Final = SECOND
"""Each client may give a hint once in this time [ns]: judging one takes the localiser some milliseconds."""

TopicHandler = Callable[[int, str, dict[str, Any], int], None]
"""Takes number and name of a client, its message and the time [ns]."""


class ClientInputs:
    """Reads the input topics; owns what is known of the age of each client's commands."""

    def __init__(
        self,
        protocol: Protocol,
        wishes: Wishes,
        *,
        round_trips: Callable[[int], RoundTrips | None],
        audit: AuditLog | None,
        turtle_control: TopicHandler,
    ) -> None:
        """Subscribe to the input topics.

        Args:
            protocol: The protocol of the robot's server.
            wishes: Takes what clients want.
            round_trips: Returns the round trips of a client; None where no time passes on the way.
            audit: Log of what clients do to the robot.
            turtle_control: Takes the messages of ``/turtle_control``.
        """
        self._connections, self._wishes = protocol.connections, wishes
        self._round_trips, self._audit = round_trips, audit
        self._ages: dict[int, CommandAge] = {}
        self._hints: dict[int, int] = {}
        handlers: Mapping[str, TopicHandler] = {
            "/joy": self._joy,
            "/unity/joy": self._joy,
            "/cmd_vel": self._twist,
            "/initialpose": self._hint,
            "/turtle_control": turtle_control,
        }
        for entry in INPUTS:
            protocol.topics.subscribe(
                entry.name, entry.type, partial(self._receive, handlers[entry.name])
            )

    def forget(self, client: int) -> None:
        """Note that a client has left."""
        self._ages.pop(client, None)
        self._hints.pop(client, None)

    def _receive(
        self, handle: TopicHandler, client: int, message: dict[str, Any], now: int
    ) -> None:
        try:
            handle(client, self._connections.name(client), message, now)
        except (JoystickError, InvalidReadingError) as error:
            raise MessageError(str(error)) from None

    def _joy(self, client: int, name: str, message: dict[str, Any], now: int) -> None:
        self._drive(client, joy_command(name, message), now)

    def _twist(self, client: int, name: str, message: dict[str, Any], now: int) -> None:
        self._drive(client, twist_command(name, message), now)

    def _drive(self, client: int, command: DriveCommand, now: int) -> None:
        age = self._ages.setdefault(client, CommandAge())
        arrived = age.observe(now, command.stamp, self._round_trips(client))
        dated = replace(command, arrival=now, age=arrived.age, rested=arrived.rested)
        if not self._wishes.post(dated):
            raise MessageError(NOT_LISTENING)

    def _hint(self, client: int, name: str, message: dict[str, Any], now: int) -> None:
        hint = hint_reading(message)
        if (last := self._hints.get(client)) is not None and now - last < _HINT_PERIOD:
            wait = (last + _HINT_PERIOD - now) / SECOND
            raise MessageError(f"too soon: one hint a second; wait for {wait:.2f} s")
        self._hints[client] = now
        if not self._wishes.post(PoseHint(name, hint)):
            raise MessageError(NOT_LISTENING)
        if self._audit is not None:
            self._audit.hint(name, hint)
