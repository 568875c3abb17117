"""The bridge as a client of the robot: steps, photographs, and whether it may do them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from teleop.bridges.kafka import results
from teleop.bridges.robot_client import connect
from teleop.clock import unix_seconds
from teleop.errors import TeleopError
from teleop.rosbridge import Client, ConnectionState
from teleop.rosbridge.errors import (
    ClientError,
    GoalLostError,
    GoalRejectedError,
    ServiceCallError,
)
from teleop.step_commands.commands import Step

MOVE: Final = "/move"
PHOTO: Final = "/camera/photo"
PHOTO_TIMEOUT: Final = 15.0
"""Time for a photograph [s]."""


class RobotRefusesError(TeleopError):
    """The robot will not have this client, or this client must not be the robot's."""


class NotSentError(Exception):
    """There was no connection: nothing was sent to the robot."""


@dataclass(frozen=True, slots=True)
class CommandOutcome:
    """What became of a step or a photograph."""

    outcome: str
    message: str = ""
    distance: float = 0.0
    """Driven by the chosen measure [m]."""
    angle: float = 0.0
    """Turned by the chosen measure [rad]."""


class RobotLink:
    """A connection to the robot, which is opened again when it is lost."""

    def __init__(self, client: Client, measure_by: str) -> None:
        """Take a client that is not connected yet."""
        self.client = client
        self.reachable = asyncio.Event()
        """Whether the robot is connected and has said what this client is to it."""
        self.since = 0.0
        """When it did so [s since 1970]."""
        self.on_change: Callable[[str], object] = lambda text: None
        """Called with a line when the robot is lost and found."""

        self._measure_by = measure_by
        self._connected = asyncio.Event()
        client.on_connection(self._note)

    async def run(self) -> None:
        """Stay connected without end.

        Raises:
            ClientError: If the address is no robot's, or does not accept the token.
            RobotRefusesError: If the token is an admin's.
        """
        await connect(self.client, lambda text: self.on_change(text))
        while True:
            await self._connected.wait()
            self._connected.clear()
            try:
                session = await self.client.call("/teleop/session")
            except ServiceCallError as error:
                if "connection lost" in str(error) or "not connected" in str(error):
                    continue
                self._found(
                    f"{self.client.url} is connected; it does not say what this client may do"
                )
                continue
            self._check(session)

    async def move(self, step: Step) -> CommandOutcome:
        """Drive a step and return what became of it.

        Raises:
            NotSentError: If there was no connection.
        """
        goal = {
            "distance": step.distance,
            "angle": step.angle,
            "speed": step.speed,
            "time_limit": 0.0,
            "measure_by": self._measure_by,
        }
        try:
            result = await self.client.run_goal(MOVE, "farsteer_msgs/action/Move", goal)
        except ClientError:
            raise NotSentError from None
        except GoalLostError as error:
            return CommandOutcome(results.INTERRUPTED, str(error))
        except GoalRejectedError as error:
            return CommandOutcome(results.REFUSED, str(error))
        values = result.values
        return CommandOutcome(
            str(values.get("outcome") or results.REFUSED),
            str(values.get("message", "")),
            *(_number(values.get("distance")), _number(values.get("angle"))),
        )

    async def photograph(self) -> CommandOutcome:
        """Have a photograph taken; return its name as the message.

        Raises:
            NotSentError: If there was no connection.
        """
        if not self.client.connected:
            raise NotSentError
        try:
            values = await self.client.call(PHOTO, timeout=PHOTO_TIMEOUT)
        except ServiceCallError as error:
            lost = "connection lost" in str(error) or "no response" in str(error)
            return CommandOutcome(results.INTERRUPTED if lost else results.REFUSED, str(error))
        good = values.get("success") is not False
        return CommandOutcome(
            results.DONE if good else results.REFUSED, str(values.get("message", ""))
        )

    def _check(self, session: dict[str, Any]) -> None:
        if session.get("tokens") and session.get("role") == "admin":
            raise RobotRefusesError(
                "the token of --token-file is an admin's; give the bridge one of role operate"
            )
        may = session.get("may_drive") is not False
        self._found(
            f"{self.client.url} is connected"
            + ("" if may else f"; its role {session.get('role')} may not drive")
        )

    def _found(self, text: str) -> None:
        self.since = unix_seconds()
        self.reachable.set()
        self.on_change(text)

    def _note(self, state: ConnectionState) -> None:
        if state is ConnectionState.CONNECTED:
            self._connected.set()
        else:
            self.reachable.clear()
            self._connected.clear()
            if state is ConnectionState.DISCONNECTED:
                self.on_change(f"lost {self.client.url}: {self.client.closed_reason}")


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else 0.0
