"""One client of the robot in its own process: the same JSON frames as over a socket, in simulated time.

A wire has no socket and no thread. What the robot sends waits until ``deliver`` hands it on, so that no callback
runs while the protocol is at work.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol as Interface

import msgspec

from teleop.rosbridge.framing.outgoing_frames import CloseFrame, Output
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.ros_time import SECOND, stamp

CLOCK_OFFSET: Final = 1_700_000_000 * SECOND
"""What a client's clock is ahead of the robot's [ns]: it counts from 1970, the robot's from the run's start."""

_STATUSES: Final = 200
"""Texts of ``status`` that a wire remembers."""

OnMessage = Callable[[dict[str, Any]], object]
"""Takes a message of a topic."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to the call of a service."""

    values: Mapping[str, Any]
    """Fields of the response; empty if the call failed."""
    failure: str = ""
    """Why the call failed; empty if it did not."""


OnAnswer = Callable[[Answer], object]
"""Takes the answer to a call."""


@dataclass(frozen=True, slots=True)
class Status:
    """A ``status`` of the robot."""

    level: str
    """``error``, ``warning`` or ``info``."""
    text: str
    """What it says."""


class Carrier(Interface):
    """Carries the frames of wires: a ``MemoryTransport``."""

    protocol: Protocol

    @property
    def now(self) -> int:
        """Time of the protocol [ns]."""

    def forget(self, client: int) -> None:
        """Drop what is still sent to a client that has left."""


class Recorder(Interface):
    """Keeps what a client sends."""

    def add(self, now: int, operation: Mapping[str, Any]) -> None:
        """Keep an operation that was sent at a robot time [ns]."""


class Wire:
    """One client of the robot: subscribes, publishes, calls services."""

    def __init__(self, transport: Carrier, client: int, recorder: Recorder | None = None) -> None:
        """Take the parts; ``MemoryTransport.connect`` makes wires."""
        self._transport, self._recorder = transport, recorder
        self.client = client
        """Number of the client, as ``/teleop/session`` gives it."""

        self.closed: str | None = None
        """Why the connection has ended; None while it is open."""

        self.clock_offset = CLOCK_OFFSET
        """What the client's clock is ahead of the robot's [ns]."""

        self.seen: int | None = None
        """Newest robot time in the header of a message that was handed on [ns]: so old is what its operator sees."""

        self.statuses: deque[Status] = deque(maxlen=_STATUSES)
        """The last texts of ``status``, oldest first."""

        self._hung = False
        self._arrived: deque[bytes] = deque()
        self._subscribers: dict[str, list[OnMessage]] = {}
        self._advertised: set[str] = set()
        self._calls: dict[str, OnAnswer] = {}
        self._number = 0

    @property
    def now(self) -> int:
        """Robot time [ns]; what the client's clock shows is ``clock_offset`` more."""
        return self._transport.now

    @property
    def stamp(self) -> dict[str, int]:
        """The time of the client's clock, as ``builtin_interfaces/Time``."""
        return self.stamp_before(0)

    def stamp_before(self, age: int) -> dict[str, int]:
        """Return the time of the client's clock, less an age [ns], as ``builtin_interfaces/Time``."""
        return stamp(self._transport.now + self.clock_offset - age)

    # What a client sends

    def subscribe(
        self, topic: str, type: str, callback: OnMessage, *, throttle_rate: int = 0
    ) -> None:
        """Have ``callback`` called with each message of a topic.

        Args:
            topic: Name of the topic.
            type: Its type, such as ``sensor_msgs/Joy``.
            callback: Called while the wire delivers.
            throttle_rate: Shortest time between two messages [ms].
        """
        callbacks = self._subscribers.setdefault(topic, [])
        callbacks.append(callback)
        operation: dict[str, Any] = {"op": "subscribe", "topic": topic, "type": type}
        operation["id"] = f"subscribe:{topic}:{len(callbacks)}"
        if throttle_rate:
            operation["throttle_rate"] = throttle_rate
        self.send(operation)

    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None:
        """Publish a message; the first one of a topic advertises it."""
        if topic not in self._advertised:
            self._advertised.add(topic)
            self.send({"op": "advertise", "topic": topic, "type": type})
        self.send({"op": "publish", "topic": topic, "msg": message})

    def call(
        self,
        service: str,
        type: str = "",
        arguments: Mapping[str, Any] | None = None,
        on_answer: OnAnswer | None = None,
    ) -> None:
        """Call a service; ``on_answer`` is called with the answer while the wire delivers."""
        self._number += 1
        operation: dict[str, Any] = {"op": "call_service", "service": service}
        if type:
            operation["type"] = type
        operation["args"] = dict(arguments or {})
        operation["id"] = identity = f"call:{self._number}"
        if on_answer is not None:
            self._calls[identity] = on_answer
        self.send(operation)

    def goal(
        self, action: str, type: str, arguments: Mapping[str, Any], on_answer: OnAnswer
    ) -> str:
        """Send a goal of an action; return its id, by which ``cancel`` cancels it.

        Args:
            action: Name of the action.
            type: Its type, such as ``farsteer_msgs/action/Move``.
            arguments: Fields of the goal.
            on_answer: Called with the result while the wire delivers.
        """
        self._number += 1
        operation: dict[str, Any] = {"op": "send_action_goal", "action": action}
        operation["action_type"], operation["args"] = type, dict(arguments)
        operation["id"] = identity = f"goal:{self._number}"
        self._calls[identity] = on_answer
        self.send(operation)
        return identity

    def cancel(self, action: str, identity: str) -> None:
        """Ask for the end of a goal; its result says what became of it."""
        self.send({"op": "cancel_action_goal", "action": action, "id": identity})

    def send(self, operation: Mapping[str, Any]) -> None:
        """Send any operation; nothing happens if the connection has ended."""
        if self.closed is None and not self._hung:
            if self._recorder is not None:
                self._recorder.add(self._transport.now, operation)
            frame = json.dumps(operation, separators=(",", ":"))
            self._transport.protocol.receive(self.client, frame, self._transport.now)

    def close(self, reason: str = "closed by the client") -> None:
        """End the connection, without a word as when a program dies."""
        if self.closed is None:
            self.closed = reason
            self._end(self._transport.now)

    def hang(self) -> None:
        """Neither send nor read from now on, while the connection stays open."""
        self._hung = True
        self._arrived.clear()

    # What a client receives

    def receive(self, output: Output) -> None:
        """Take a frame of the robot, which waits for ``deliver``."""
        if isinstance(output, CloseFrame):
            if self.closed is None:
                self.closed = output.reason or f"closed with code {output.code}"
                # The protocol is at work: it learns of the end in its next tick.
                self._transport.protocol.timers.at(self._transport.now, self._end)
        elif self.closed is None and not self._hung and not output.binary:
            self._arrived.append(output.payload)

    def deliver(self) -> None:
        """Call the callbacks of all that has arrived, in its order."""
        while self._arrived:
            operation = msgspec.json.decode(self._arrived.popleft())
            match operation["op"]:
                case "publish":
                    self._see(operation["msg"])
                    for callback in self._subscribers.get(operation["topic"], ()):
                        callback(operation["msg"])
                case "service_response" | "action_result":
                    self._answer(operation)
                case "status":
                    self.statuses.append(Status(operation["level"], operation["msg"]))
                case _:
                    pass  # nothing else is asked for

    def _see(self, message: Mapping[str, Any]) -> None:
        header = message.get("header")
        if header is not None and (time := header["stamp"]):
            at = time["sec"] * SECOND + time["nanosec"]
            self.seen = at if self.seen is None else max(self.seen, at)

    def _answer(self, operation: Mapping[str, Any]) -> None:
        on_answer = self._calls.pop(operation.get("id", ""), None)
        if on_answer is None:
            return
        values = operation["values"]
        failed = not operation["result"]
        on_answer(Answer({}, str(values)) if failed else Answer(values))

    def _end(self, now: int) -> None:
        self._transport.protocol.disconnect(self.client, now)
        self._transport.forget(self.client)
