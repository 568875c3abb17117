"""The robot behind a rosbridge server: clients' messages fill its inbox, its state goes out on topics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from localization.maps.cloud import Cloud
from localization.types import SECOND, Hint, InvalidReadingError
from robot_sim import TICK_NS
from teleop.joystick import JoystickError, JoystickLayout
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.inbox import (
    Disconnected,
    EStop,
    EStopReset,
    InboxMessage,
    Relocalize,
    TakeOver,
    Undo,
)
from teleop.robot.input_messages import hint_reading, joy_command, twist_command
from teleop.robot.robot import Robot
from teleop.robot.safety import estop_after, reset_rejection
from teleop.robot.tick_record import TickRecord
from teleop.robot.topics.topic_table import INPUTS, OUTPUTS, latched_messages
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.compat.client_traffic import publish_client_traffic
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.errors import MessageError, ServiceError
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.server.server import Server

TickObserver = Callable[[TickRecord], None]
"""Receives the record of each tick."""

_Reader = Callable[[str, dict[str, Any]], InboxMessage]

_TRIGGER: Final = "std_srvs/srv/Trigger"

_SEARCH_PERIOD: Final = SECOND
"""Each client may request a search once in this time [ns]."""


class RosbridgeAdapter(Observer):
    """Joins robot and server; owns the inbox and nothing else."""

    def __init__(
        self,
        robot: Robot,
        server: Server,
        cloud: Cloud,
        *,
        layout: JoystickLayout | None = None,
        audit: AuditLog | None = None,
        observers: tuple[TickObserver, ...] = (),
    ) -> None:
        """Advertise the robot's topics and services on the server.

        Args:
            robot: The robot.
            server: Its server, not yet started.
            cloud: The robot's map, of which clients get the hash.
            layout: Assignment of joysticks; the default one if not given.
            audit: Log of what clients do to the robot.
            observers: Called with the record of each tick.
        """
        self.robot, self.server = robot, server
        self._layout, self._observers = layout or JoystickLayout(), observers
        self._audit = audit
        self._inbox: list[InboxMessage] = []
        self._clients: dict[str, int] = {}
        self._search_requests: dict[int, int] = {}
        for topic in OUTPUTS:
            server.protocol.topics.advertise(topic.name, topic.type, latch=topic.latch)
        for latched, message in latched_messages(cloud, robot.simulation.mounts).items():
            server.protocol.topics.advertise(latched.name, latched.type, latch=True)
            server.protocol.topics.publish(latched.name, message, 0)
        readers: Mapping[str, _Reader] = {
            "/joy": self._joy,
            "/unity/joy": self._joy,
            "/cmd_vel": twist_command,
            "/initialpose": self._hint,
        }
        for entry in INPUTS:
            server.protocol.topics.subscribe(
                entry.name, entry.type, partial(self._receive, readers[entry.name])
            )
        server.protocol.services.serve("/teleop/estop", _TRIGGER, self._estop)
        server.protocol.services.serve("/teleop/estop_reset", _TRIGGER, self._estop_reset)
        server.protocol.services.serve("/teleop/take_over", _TRIGGER, self._take_over)
        server.protocol.services.serve("/localization/undo", _TRIGGER, self._undo)
        server.protocol.services.serve("/localization/relocalize", _TRIGGER, self._relocalize)
        serve_standard(server.protocol)
        publish_client_traffic(server)
        server.protocol.observers.add(self)

    def tick(self, now: int) -> TickRecord:
        """Advance the robot by one tick and publish the result.

        Args:
            now: Time by which commands age [ns].
        """
        inbox, self._inbox = self._inbox, []
        tick = self.robot.tick(now, inbox)
        for rejection in tick.rejections:
            if rejection.client in self._clients:
                client = self._clients[rejection.client]
                self.server.protocol.connections.send_status(client, "warning", rejection.reason)
        self._publish(tick)
        if self._audit is not None:
            self._audit.tick(tick)
        for observe in self._observers:
            observe(tick)
        return tick

    def post(self, message: InboxMessage) -> None:
        """Put a message that no client sent into the inbox."""
        self._inbox.append(message)

    def _publish(self, tick: TickRecord) -> None:
        ticks = tick.stamp // TICK_NS
        for topic in OUTPUTS:
            due = not topic.every or ticks % topic.every == 0
            if due and (topic.latch or self.server.protocol.topics.wanted(topic.name)):
                for message in topic.build(tick):
                    self.server.protocol.topics.publish(topic.name, message, tick.stamp)

    def _receive(self, read: _Reader, client: int, message: dict[str, Any], now: int) -> None:
        name = self._name(client)
        try:
            received = read(name, message)
        except (JoystickError, InvalidReadingError) as error:
            raise MessageError(str(error)) from None
        self._inbox.append(received)
        if self._audit is not None and isinstance(received, Hint):
            self._audit.hint(name, received)

    def _name(self, client: int) -> str:
        name = self.server.protocol.connections.name(client)
        self._clients[name] = client
        return name

    def _joy(self, client: str, message: dict[str, Any]) -> InboxMessage:
        return joy_command(client, message, self._layout)

    def _hint(self, client: str, message: dict[str, Any]) -> InboxMessage:
        return hint_reading(message, self.robot.simulation.stamp)

    def _estop(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name = self._name(client)
        self._record(name, "e-stop")
        self._inbox.append(EStop(name, self._holder(client)))
        return {"success": True, "message": "stopped"}

    def _estop_reset(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name, access = self._name(client), self.server.protocol.connections.access(client)
        admin = access is not None and access.role is Role.ADMIN
        reset = EStopReset(name, self._holder(client), admin)
        # The rule is the robot's; it is asked here for what holds once the inbox is drained.
        rejection = reset_rejection(estop_after(self.robot.safety.estop, self._inbox), reset)
        self._record(name, "e-stop reset", rejection)
        if rejection is not None:
            raise ServiceError(rejection)
        self._inbox.append(reset)
        return {"success": True, "message": "reset; send a neutral stick to drive"}

    def _take_over(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name = self._name(client)
        self._record(name, "take-over")
        self._inbox.append(TakeOver(name))
        return {"success": True, "message": "you hold the lease; send a neutral stick to drive"}

    def _undo(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name, rejection = self._name(client), None
        if not self.robot.localizer.undoable:
            seconds = self.robot.localizer.config.undo_memory / SECOND
            rejection = f"no hint or search has set the pose within the last {seconds:.0f} s"
        self._record(name, "undo", rejection)
        if rejection is not None:
            return {"success": False, "message": rejection}
        self._inbox.append(Undo(name))
        return {"success": True, "message": "undone with the next tick"}

    def _relocalize(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name, rejection = self._name(client), self._search_rejection(client, now)
        self._record(name, "relocalize", rejection)
        if rejection is not None:
            return {"success": False, "message": rejection}
        self._search_requests[client] = now
        self._inbox.append(Relocalize(name))
        return {
            "success": True,
            "message": "searching the whole map; drive on until one place is left",
        }

    def _search_rejection(self, client: int, now: int) -> str | None:
        """Return why a client may not request a search now [ns]; None if it may."""
        if (last := self._search_requests.get(client)) is not None and now - last < _SEARCH_PERIOD:
            wait = (last + _SEARCH_PERIOD - now) / SECOND
            return f"one request a second: wait for {wait:.2f} s"
        waiting = any(isinstance(message, Relocalize) for message in self._inbox)
        if waiting or self.robot.localizer.searching:
            return "a search is under way already; its result is on /localization/status"
        return None

    def _holder(self, client: int) -> str:
        access = self.server.protocol.connections.access(client)
        return access.holder if access else ""

    def _record(self, client: str, action: str, rejection: str | None = None) -> None:
        if self._audit is not None:
            self._audit.action(client, action, rejection)

    def disconnected(self, connection: Connection, now: int) -> None:
        """Have the robot release what the client controls."""
        self._clients.pop(connection.name, None)
        self._search_requests.pop(connection.id, None)
        self._inbox.append(Disconnected(connection.name))
