"""What clients said and when it arrived, read from their frames and not from what the robot made of them."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from localization.types import SECOND
from teleop.joystick import LAYOUT
from teleop.robot.topics.arm_topics import ARM_ACTIONS, ARM_INPUTS, MIRROR_DEGREES
from teleop.rosbridge.auth.permissions import Access
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.scenario.operators.wire import Recorder

_LARGEST: Final = 4096
"""Largest frame that is read [bytes]: commands, hints and calls are smaller."""
DRIVE_TOPICS: Final = frozenset({"/joy", "/unity/joy", "/cmd_vel"})
"""Topics of drive messages."""
ARM_TOPICS: Final = frozenset(each.name for each in ARM_INPUTS if each is not MIRROR_DEGREES)
"""Topics by which clients move an arm."""
_ARM_GOALS: Final = frozenset(each.name for each in ARM_ACTIONS)
_KEPT: Final = 64
"""Number of drive messages that are kept of each client."""


@dataclass(frozen=True, slots=True)
class DriveMessage:
    """A drive message as a client sent it."""

    arrived: int
    """Robot time of its arrival [ns]."""
    sent: int | None
    """Robot time at which it set out [ns]; None if nobody knows."""
    forward: float
    """Requested forward speed [m/s]."""
    turn: float
    """Requested turn rate [rad/s]."""
    enabled: bool
    """Whether the deadman is held; true without one."""
    stick: bool
    """Whether it is of a joystick."""
    stamped: int = 0
    """Time that it bears, by its client's clock [ns]; 0 without one."""
    seen: int | None = None
    """Newest robot time that its client had been shown when it set out [ns]; None if nobody knows."""

    @property
    def moves(self) -> bool:
        """Whether it asks for motion."""
        return self.enabled and (self.forward != 0.0 or self.turn != 0.0)


@dataclass(slots=True)
class ClientFacts:
    """What one client has sent."""

    name: str
    """Its name, as the robot has it."""
    number: int
    """Number of its connection."""
    drives: list[DriveMessage] = field(default_factory=list)
    """Its last drive messages, oldest first."""
    arm_at: int | None = None
    """When it last asked something of the arm [ns]; None if it never did."""
    sent: SentCommands | None = None
    """When its messages set out, if it is of this process."""
    access: Access | None = None
    """What it may do; None until it has shown a token."""
    left: int | None = None
    """When it left [ns]; None while it is connected."""

    @property
    def role(self) -> str:
        """Its role; empty until it has shown a token, where one is required."""
        return "" if self.access is None else self.access.role.value

    @property
    def holder(self) -> str:
        """Holder of its token; empty without one."""
        return "" if self.access is None else self.access.holder

    def may_ask(self, service: str) -> bool:
        """Return whether what it sends counts (docs/security.md): who only watches may stop the robot."""
        return self.role in ("operate", "admin") or (
            self.role == "view" and service == "/teleop/estop"
        )


class SentCommands:
    """Notes when a client of this process sends drive messages; hands all it sends on to another recorder."""

    def __init__(self, following: Recorder | None = None) -> None:
        self.waiting: deque[tuple[int, int | None]] = deque()
        """Robot times at which those messages set out that have not arrived yet, oldest first, and ``seen`` then [ns]."""

        self.seen: Callable[[], int | None] = lambda: None
        """Returns the newest robot time that the client has been shown [ns]."""

        self._following = following

    def add(self, now: int, operation: Mapping[str, Any]) -> None:
        """Note an operation that is sent at a robot time [ns]."""
        if operation.get("op") == "publish" and operation.get("topic") in DRIVE_TOPICS:
            self.waiting.append((now, self.seen()))
        if self._following is not None:
            self._following.add(now, operation)


@dataclass(frozen=True, slots=True)
class Said:
    """Something else that a client sent: the call of a service, or a hint."""

    arrived: int
    """Robot time of its arrival [ns]."""
    client: int
    """Number of the client's connection."""
    what: str
    """Name of the service, or ``/initialpose``."""


class WireFacts(Observer):
    """Reads the frames of all clients as they arrive; owns what they said."""

    def __init__(self, clock: Callable[[], int]) -> None:
        """Date frames by the robot's clock [ns]."""
        self._clock = clock
        self.clients: dict[int, ClientFacts] = {}
        """All clients so far, by number."""

        self.said: list[Said] = []
        """Calls and hints so far, oldest first."""

    def connected(self, connection: Connection, now: int) -> None:
        """Note a client."""
        facts = ClientFacts(connection.name, connection.id, access=connection.access)
        self.clients[connection.id] = facts

    def renamed(self, connection: Connection, old: str) -> None:
        """Note a client's new name."""
        if connection.id in self.clients:
            self.clients[connection.id].name = connection.name

    def authenticated(self, connection: Connection, access: Access | None, now: int) -> None:
        """Note what a client that shows a token may do from now on."""
        if connection.id in self.clients and access is not None:
            self.clients[connection.id].access = access

    def disconnected(self, connection: Connection, now: int) -> None:
        """Note that it has left."""
        if connection.id in self.clients:
            self.clients[connection.id].left = self._clock()

    def received(self, connection: Connection, frame: str | bytes) -> None:
        """Read a frame."""
        client = self.clients.get(connection.id)
        if client is None or len(frame) > _LARGEST:
            return
        try:
            operation = json.loads(frame)
        except (ValueError, RecursionError):
            return
        if isinstance(operation, dict):
            self._read(client, operation)

    def _read(self, client: ClientFacts, operation: Mapping[str, Any]) -> None:
        now, service = self._clock(), str(operation.get("service"))
        if not client.may_ask(service):
            return
        match operation.get("op"), operation.get("topic"), operation.get("msg"):
            case "publish", ("/joy" | "/unity/joy" | "/cmd_vel") as topic, dict(message):
                waiting = client.sent.waiting if client.sent is not None else None
                sent, seen = waiting.popleft() if waiting else (None, None)
                read = _twist if topic == "/cmd_vel" else self._joy
                if (drive := read(message, now, sent)) is not None:
                    self._add(client, replace(drive, seen=seen))
            case "publish", "/initialpose", dict():
                self.said.append(Said(now, client.number, "/initialpose"))
            case "publish", str(topic), dict() if topic in ARM_TOPICS:
                client.arm_at = now
            case "send_action_goal", _, _ if operation.get("action") in _ARM_GOALS:
                client.arm_at = now
            case "call_service", _, _:
                self.said.append(Said(now, client.number, service))

    def _add(self, client: ClientFacts, message: DriveMessage) -> None:
        client.drives.append(message)
        del client.drives[:-_KEPT]

    def _joy(self, message: Mapping[str, Any], now: int, sent: int | None) -> DriveMessage | None:
        layout, buttons = LAYOUT, message.get("buttons", ())
        try:
            forward = float(message["axes"][layout.forward_axis])
            turn = float(message["axes"][layout.turn_axis])
            held = bool(buttons[layout.deadman_button : layout.deadman_button + 1] == [1])
            turbo = bool(buttons[layout.turbo_button : layout.turbo_button + 1] == [1])
        except (KeyError, IndexError, TypeError, ValueError, OverflowError):
            return None
        if not (math.isfinite(forward) and math.isfinite(turn)):
            return None
        speed = layout.turbo_speed if turbo else layout.speed
        return DriveMessage(
            now,
            sent,
            speed * _beyond(forward, layout.deadzone),
            layout.turn * _beyond(turn, layout.deadzone),
            held,
            True,
            _stamp(message),
        )

    def since(self, begin: int, end: int) -> Iterator[Said]:
        """Yield what was said from ``begin`` until before ``end`` [ns]."""
        for said in reversed(self.said):
            if said.arrived < begin:
                return
            if said.arrived < end:
                yield said


def _stamp(message: Mapping[str, Any]) -> int:
    """Return the time in a message's header [ns]; 0 without one."""
    try:
        time = message["header"]["stamp"]
        return int(time["sec"]) * SECOND + int(time["nanosec"])
    except (KeyError, TypeError, ValueError, OverflowError):
        return 0


def _twist(message: Mapping[str, Any], now: int, sent: int | None) -> DriveMessage | None:
    try:
        forward = float(message.get("linear", {}).get("x", 0.0))
        turn = float(message.get("angular", {}).get("z", 0.0))
    except (AttributeError, TypeError, ValueError, OverflowError):
        return None
    if not (math.isfinite(forward) and math.isfinite(turn)):
        return None
    return DriveMessage(now, sent, forward, turn, True, False)


def _beyond(axis: float, deadzone: float) -> float:
    clamped = max(-1.0, min(1.0, axis))
    beyond = max(0.0, abs(clamped) - deadzone) / (1.0 - deadzone)
    return math.copysign(beyond, clamped) if beyond else 0.0
