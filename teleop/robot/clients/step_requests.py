"""Steps that clients have asked for, from their arrival until the robot has answered them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from teleop.link.command_age import RoundTrips
from teleop.robot.clients.robot_services import NOT_LISTENING
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import StepAlive, StepAnswered, StepCancel, StepGoal
from teleop.robot.steps.measures import MEASURES
from teleop.robot.steps.step_results import StepProgress, StepResult
from teleop.robot.tick_record import DriveRecord
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.connections import Connections
from teleop.step_commands.commands import Step

_ALIVE_EVERY: Final = 5
"""Ticks between two signs of life of a client with steps: ten a second."""

_FEEDBACK_EVERY: Final = 5
"""Ticks between two reports on the step that is driven: ten a second."""

LONGEST: Final = 3600.0
"""Largest time limit of a step [s]."""

OnProgress = Callable[[StepProgress | None, int], object]
"""Takes progress, None while the step waits, and the number of steps in front of it."""

OnResult = Callable[[StepResult], object]
"""Takes the result."""


@dataclass(slots=True)
class _Request:
    client: int
    name: str
    on_progress: OnProgress
    on_result: OnResult
    ahead: int = -1


class StepRequests:
    """Owns the unanswered steps of all clients; each gets one result."""

    def __init__(
        self,
        connections: Connections,
        wishes: Wishes,
        *,
        round_trips: Callable[[int], RoundTrips | None],
        now: Callable[[], int],
    ) -> None:
        """Take the parts.

        Args:
            connections: The clients.
            wishes: Takes what clients want.
            round_trips: Returns the round trips of a client; None where no time passes on the way.
            now: Returns the time of the server's clock [ns].
        """
        self._connections, self._wishes = connections, wishes
        self._round_trips, self._now = round_trips, now
        self._requests: dict[int, _Request] = {}
        self._numbers = itertools.count(1)
        self._ticks = 0

    def ask(
        self,
        client: int,
        step: Step,
        *,
        time_limit: float = 0.0,
        measure_by: str = "",
        on_progress: OnProgress = lambda progress, ahead: None,
        on_result: OnResult,
    ) -> Callable[[], object]:
        """Ask the robot for a step; return what cancels it.

        Args:
            client: Number of the client.
            step: The step.
            time_limit: Time after which it is given up [s]; 0 for the robot's own limit.
            measure_by: ``odometry`` or ``localization``; empty for odometry.
            on_progress: Called as the step draws near and is driven.
            on_result: Called once, unless the client leaves before.

        Raises:
            ServiceError: If a value is invalid, or the robot takes no messages.
        """
        if not 0.0 <= time_limit <= LONGEST:
            raise ServiceError(
                f"time_limit must be up to {LONGEST:g} s, or 0 for the robot's own, got {time_limit:g}"
            )
        if measure_by and measure_by not in MEASURES:
            raise ServiceError(
                f"measure_by must be {' or '.join(MEASURES)}, got {measure_by[:40]!r}"
            )
        name, number = self._connections.name(client), next(self._numbers)
        trips = self._round_trips(client)
        goal = StepGoal(
            name,
            number,
            step.distance,
            step.angle,
            step.speed,
            float(time_limit),
            measure_by or MEASURES[0],
            0 if trips is None else trips.delay,
        )
        if not self._wishes.post(goal):
            raise ServiceError(NOT_LISTENING)
        self._requests[number] = _Request(client, name, on_progress, on_result)

        def cancel() -> None:
            # The goals of a client that has left are cancelled, too; the robot ends those by itself.
            if self._connections.get(client) is not None:
                self._wishes.post(StepCancel(name, number))

        return cancel

    def driven(self, tick: DriveRecord) -> None:
        """Hand on what became of the steps in a tick, and report who is still connected."""
        self._ticks += 1
        for result in tick.steps.unanswered:
            goal = result.goal
            request = self._requests.get(goal.number)
            # It is sent again and again until this is confirmed; what is not confirmed now is so later.
            if self._wishes.post(StepAnswered(goal.client, goal.number)) and request is not None:
                del self._requests[goal.number]
                request.on_result(result)
        if self._requests:
            self._report_progress(tick)
            if self._ticks % _ALIVE_EVERY == 0:
                self._report_life()

    def forget(self, client: int) -> None:
        """Note that a client has left: the robot ends its steps by itself."""
        self._requests = {n: r for n, r in self._requests.items() if r.client != client}

    def _report_progress(self, tick: DriveRecord) -> None:
        moving, waiting = tick.steps.moving, tick.steps.waiting
        if moving is not None and self._ticks % _FEEDBACK_EVERY == 0:
            driven = self._requests.get(moving.number)
            if driven is not None:
                driven.on_progress(moving, 0)
        for ahead, number in enumerate(waiting, int(moving is not None)):
            request = self._requests.get(number)
            if request is not None and request.ahead != ahead:
                request.ahead = ahead
                request.on_progress(None, ahead)

    def _report_life(self) -> None:
        now = self._now()
        for client, name in {r.client: r.name for r in self._requests.values()}.items():
            trips = self._round_trips(client)
            unanswered = None if trips is None else trips.unanswered
            self._wishes.post(StepAlive(name, now, unanswered or 0))
