"""The topic ``/turtle_control``: step commands as JSON, each sender's in its own order."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.step_requests import StepRequests
from teleop.robot.step_results import ENDS_QUEUE, StepOutcome, StepResult
from teleop.robot.steps.step_queue import MAX_STEPS
from teleop.robot.topics.topic_table import TURTLE_RESULT
from teleop.rosbridge.errors import MessageError, RosbridgeError, ServiceError
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.step_commands.commands import Photo, Step, StepCommand, StepCommandError
from teleop.step_commands.turtle_control import StepSizes, read_turtle_control

PHOTO_SERVICE: Final = "/camera/photo"
"""Service that takes a photograph, on a robot with a camera."""


@dataclass(slots=True)
class _Sender:
    """A client that publishes on the topic."""

    client: int
    name: str
    sizes: StepSizes = field(default_factory=StepSizes)
    waiting: deque[StepCommand] = field(default_factory=deque)
    """Commands behind a photograph, with it; the robot has all before them."""
    driving: int = 0
    """Steps that the robot has not answered yet."""
    photographing: bool = False


class TurtleControl:
    """Owns the sizes that each client has set, and its commands that wait for a photograph."""

    def __init__(
        self,
        protocol: Protocol,
        requests: StepRequests,
        *,
        now: Callable[[], int],
        audit: AuditLog | None = None,
    ) -> None:
        """Advertise the topic of the results.

        Args:
            protocol: The protocol of the robot's server.
            requests: Takes the steps.
            now: Returns the time of the server's clock [ns].
            audit: Log of what clients do to the robot.
        """
        self._protocol, self._requests = protocol, requests
        self._now, self._audit = now, audit
        self._senders: dict[int, _Sender] = {}
        protocol.topics.advertise(TURTLE_RESULT.name, TURTLE_RESULT.type)

    def receive(self, client: int, name: str, message: Mapping[str, Any], now: int) -> None:
        """Take a message of the topic.

        Raises:
            MessageError: If it is no such command, or too many wait.
        """
        sender = self._senders.setdefault(client, _Sender(client, name))
        try:
            sizes, commands = read_turtle_control(str(message["data"]), sender.sizes)
        except StepCommandError as error:
            raise MessageError(f"turtle_control: {error}") from None
        if len(sender.waiting) + sender.driving + len(commands) > MAX_STEPS:
            raise MessageError(
                f"turtle_control: {MAX_STEPS} commands wait already; send the next one after a result"
            )
        sender.sizes = sizes
        sender.waiting.extend(commands)
        self._advance(sender)

    def forget(self, client: int) -> None:
        """Note that a client has left."""
        self._senders.pop(client, None)

    def _advance(self, sender: _Sender) -> None:
        """Hand on what may be: steps at once, a photograph once all steps before it are answered."""
        while sender.waiting and not sender.photographing:
            command = sender.waiting[0]
            if isinstance(command, Photo):
                if sender.driving:
                    return
                sender.waiting.popleft()
                self._photograph(sender)
            else:
                sender.waiting.popleft()
                self._drive(sender, command)

    def _drive(self, sender: _Sender, step: Step) -> None:
        def answered(result: StepResult) -> None:
            sender.driving -= 1
            self._answer(sender, step, result.outcome, result.message, result)
            if result.outcome in ENDS_QUEUE:
                self._drop(sender, result.outcome)
            self._advance(sender)

        try:
            self._requests.ask(sender.client, step, on_result=answered)
        except ServiceError as error:
            self._answer(sender, step, StepOutcome.REFUSED, str(error))
            return
        sender.driving += 1
        if self._audit is not None:
            self._audit.step(sender.name, step)

    def _drop(self, sender: _Sender, outcome: StepOutcome) -> None:
        """Answer what waits behind a photograph, as the robot does with what waits behind a step."""
        while sender.waiting:
            message = f"not begun: a step before it ended with {outcome.value}"
            self._answer(sender, sender.waiting.popleft(), outcome, message)

    def _photograph(self, sender: _Sender) -> None:
        sender.photographing = True

        def done(response: Mapping[str, Any] | ServiceError) -> None:
            sender.photographing = False
            failed = isinstance(response, ServiceError) or response.get("success") is False
            outcome = StepOutcome.REFUSED if failed else StepOutcome.DONE
            if isinstance(response, ServiceError):
                message = str(response)
            else:
                message = str(response.get("name") or response.get("message", ""))
            self._answer(sender, Photo(), outcome, message)

        def done_later(response: Mapping[str, Any] | ServiceError) -> None:
            done(response)
            self._advance(sender)

        response = self._photo(sender)
        if isinstance(response, DeferredResponse) and not response.done:
            response.on_done(done_later)
        elif isinstance(response, DeferredResponse):
            response.on_done(done)
        else:
            done(response)

    def _photo(self, sender: _Sender) -> Mapping[str, Any] | ServiceError | DeferredResponse:
        access = self._protocol.connections.access(sender.client)
        service = self._protocol.services.find(PHOTO_SERVICE)
        if service is None:
            return ServiceError("this robot has no camera; start it with one")
        refusal = "the sender has left"
        if access is not None:
            refusal = access.refusal("call", PHOTO_SERVICE) or ""
        if refusal:
            if self._audit is not None:
                self._audit.photo(sender.name, access, "", refusal)
            return ServiceError(refusal)
        try:
            return self._protocol.services.call(sender.client, service, {}, None, self._now())
        except RosbridgeError as error:
            return ServiceError(str(error))

    def _answer(
        self,
        sender: _Sender,
        command: StepCommand,
        outcome: StepOutcome,
        message: str,
        result: StepResult | None = None,
    ) -> None:
        values: dict[str, object] = {"client": sender.name}
        if isinstance(command, Photo):
            values["action"] = "photo"
        else:
            values["distance"] = round(command.distance, 6)
            values["angle"] = round(math.degrees(command.angle), 3)
        values["outcome"], values["message"] = outcome.value, message
        if result is not None and result.begun:
            values["driven_distance"] = round(result.distance, 4)
            values["driven_angle"] = round(math.degrees(result.angle), 2)
            values["duration"] = round(result.duration, 2)
        self._protocol.topics.publish(TURTLE_RESULT.name, {"data": json.dumps(values)}, self._now())
