"""The arm's input topics: what clients publish becomes what they want of the arm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from localization.types import InvalidReadingError
from robot_sim.arm.arm_table import ArmTable
from teleop.link.command_age import CommandAge, RoundTrips
from teleop.robot.arm.arm_commands import Confirm, Halt, Stream, Wish
from teleop.robot.arm.goal_results import GoalOutcome, GoalResult
from teleop.robot.clients.arm_input_messages import (
    off_unit,
    read_hand,
    read_jog,
    read_tip_target,
    read_trajectory,
    read_twist,
)
from teleop.robot.clients.arm_requests import ArmRequests
from teleop.robot.clients.hand_join import HandJoin
from teleop.robot.clients.robot_services import NOT_LISTENING
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import ArmWish
from teleop.robot.topics.arm_topics import (
    ARM_INPUTS,
    CONFIRM,
    HAND,
    HAND_JOY,
    HAND_POSE,
    JOG,
    POSE,
    TRAJECTORY,
    TWIST,
)
from teleop.rosbridge.errors import MessageError, ServiceError
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import nanoseconds

_SERVO: Final = (JOG.name, TWIST.name, POSE.name)
"""Topics of MoveIt Servo, by the numbers of ``moveit_msgs/ServoCommandType``."""


class ArmInputs:
    """Reads the input topics; owns what clients have set for theirs, and the ages of their commands."""

    def __init__(
        self,
        protocol: Protocol,
        wishes: Wishes,
        requests: ArmRequests,
        table: ArmTable,
        *,
        round_trips: Callable[[int], RoundTrips | None],
    ) -> None:
        """Subscribe to the input topics.

        Args:
            protocol: The protocol of the robot's server.
            wishes: Takes what clients want.
            requests: Takes their goals.
            table: The arm.
            round_trips: Returns the round trips of a client; None where no time passes on the way.
        """
        self._connections, self._wishes, self._requests = protocol.connections, wishes, requests
        self._table, self._round_trips = table, round_trips
        self._ages: dict[int, dict[str, CommandAge]] = {}
        self._joins: dict[int, HandJoin] = {}
        self._chosen: dict[int, str] = {}
        self._paused: set[int] = set()
        self._told: set[int] = set()
        streams: Mapping[str, Callable[[int, Mapping[str, Any]], Stream | None]] = {
            HAND.name: lambda client, message: read_hand(message),
            HAND_POSE.name: lambda client, message: self._join(client).pose(message),
            HAND_JOY.name: lambda client, message: self._join(client).joy(message),
            TWIST.name: lambda client, message: read_twist(message),
            JOG.name: lambda client, message: read_jog(message, table),
            POSE.name: lambda client, message: read_tip_target(message),
        }
        others = {TRAJECTORY.name: self._trajectory, CONFIRM.name: self._confirm}
        handlers = others | {
            name: partial(self._stream, name, read) for name, read in streams.items()
        }
        for entry in ARM_INPUTS:
            if entry.name in handlers:  # the second arm's angles are read elsewhere
                protocol.topics.subscribe(entry.name, entry.type, handlers[entry.name])

    def choose(self, client: int, number: int) -> bool:
        """Take only one kind of a client's commands of MoveIt Servo from now on; return whether there is such a kind."""
        if not 0 <= number < len(_SERVO):
            return False
        self._chosen[client] = _SERVO[number]
        return True

    def pause(self, client: int, paused: bool) -> None:
        """Take none of a client's commands of MoveIt Servo, and stop what they move; or take them again."""
        if paused:
            self._paused.add(client)
            self._wishes.post(ArmWish(self._connections.name(client), Halt()))
        else:
            self._paused.discard(client)

    def forget(self, client: int) -> None:
        """Note that a client has left."""
        for known in (self._ages, self._joins, self._chosen):
            known.pop(client, None)
        self._paused.discard(client)
        self._told.discard(client)

    def _join(self, client: int) -> HandJoin:
        return self._joins.setdefault(client, HandJoin())

    def _stream(
        self,
        topic: str,
        read: Callable[[int, Mapping[str, Any]], Stream | None],
        client: int,
        message: Mapping[str, Any],
        now: int,
    ) -> None:
        if topic in _SERVO:
            self._check_servo(client, topic)
        try:
            wish = read(client, message)
        except InvalidReadingError as error:
            raise MessageError(str(error)) from None
        if wish is not None:
            self._post(client, topic, wish, message, now)
        if "pose" in message and client not in self._told and (norm := off_unit(message["pose"])):
            self._told.add(client)
            text = f"{topic}: pose.orientation has a norm of {norm:g}; it is normalised, here and from now on"
            self._connections.send_status(client, "error", text)  # few clients see warnings

    def _check_servo(self, client: int, topic: str) -> None:
        if client in self._paused:
            raise MessageError("paused: call /servo_node/pause_servo with data false")
        chosen = self._chosen.get(client, topic)
        if chosen != topic:
            raise MessageError(
                f"you chose {chosen}: call /servo_node/switch_command_type with command_type"
                f" {_SERVO.index(topic)} first"
            )

    def _confirm(self, client: int, message: Mapping[str, Any], now: int) -> None:
        self._post(client, CONFIRM.name, Confirm(bool(message["data"])), {}, now)

    def _post(
        self, client: int, topic: str, wish: Wish, message: Mapping[str, Any], now: int
    ) -> None:
        ages = self._ages.setdefault(client, {}).setdefault(topic, CommandAge())
        stamp = nanoseconds(message["header"]["stamp"]) if "header" in message else 0
        arrived = ages.observe(now, stamp, self._round_trips(client))
        name = self._connections.name(client)
        if not self._wishes.post(ArmWish(name, wish, now, arrived.age, arrived.rested)):
            raise MessageError(NOT_LISTENING)

    def _trajectory(self, client: int, message: Mapping[str, Any], now: int) -> None:
        def ended(result: GoalResult) -> None:
            if result.outcome not in (GoalOutcome.DONE, GoalOutcome.CANCELLED):
                text = f"{TRAJECTORY.name}: {result.outcome.value}: {result.message}"
                self._connections.send_status(client, "error", text)

        try:
            self._requests.ask(
                client, lambda number: read_trajectory(number, message, self._table), ended
            )
        except ServiceError as error:
            raise MessageError(str(error)) from None
