"""The robot behind a rosbridge server: what comes in becomes its inbox, what comes out its topics."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from localization.maps.cloud import Cloud
from localization.types import SECOND, Hint, InvalidReadingError, Pose, Twist
from robot_sim import TICK_NS
from teleop.joystick import JoystickError, Layout, Wish, read_joy
from teleop.robot import topics
from teleop.robot.audit_log import Audit
from teleop.robot.robot import (
    Drive,
    Gone,
    Message,
    Reset,
    Robot,
    Snapshot,
    Stop,
    TakeOver,
    Undo,
)
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.compat.client_traffic import publish_client_traffic
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.errors import MessageError, ServiceError
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.server.server import Server

Sink = Callable[[Snapshot], None]
"""Gets each snapshot, as a recorder or a referee does."""


_ORDERS = {Stop: "e-stop", Reset: "e-stop reset", TakeOver: "take-over"}
"""What the audit log calls them."""


class Host(Observer):
    """Joins robot and server; owns the inbox and nothing else."""

    def __init__(
        self,
        robot: Robot,
        server: Server,
        cloud: Cloud,
        *,
        layout: Layout | None = None,
        audit: Audit | None = None,
        sinks: tuple[Sink, ...] = (),
    ) -> None:
        self.robot, self.server = robot, server
        self._layout, self._sinks = layout or Layout(), sinks
        self._audit = audit
        self._stopper: str | None = None
        """Holder of the token that the e-stop was latched with; None while it is not."""

        self._inbox: list[Message] = []
        self._clients: dict[str, int] = {}
        for topic in topics.OUTPUTS:
            server.protocol.topics.advertise(topic.name, topic.type, latch=topic.latch)
        for latched, message in topics.latched(cloud, robot.simulation.mounts).items():
            server.protocol.topics.advertise(latched.name, latched.type, latch=True)
            server.protocol.topics.publish(latched.name, message, 0)
        readers: Mapping[str, Callable[[str, dict[str, Any]], Message]] = {
            "/joy": self._joy,
            "/unity/joy": self._joy,
            "/cmd_vel": self._cmd_vel,
            "/initialpose": self._hint,
        }
        for entry in topics.INPUTS:
            server.protocol.topics.subscribe(
                entry.name, entry.type, partial(self._receive, readers[entry.name])
            )
        for name, kind, done in (
            ("/teleop/estop", Stop, "stopped"),
            ("/teleop/estop_reset", Reset, "reset; show a neutral stick to drive"),
            ("/teleop/take_over", TakeOver, "yours; show a neutral stick to drive"),
        ):
            server.protocol.services.serve(
                name, "std_srvs/srv/Trigger", partial(self._order, kind, done)
            )
        server.protocol.services.serve("/localization/undo", "std_srvs/srv/Trigger", self._undo)
        serve_standard(server.protocol)
        publish_client_traffic(server)
        server.protocol.observers.add(self)

    def tick(self, now: int) -> Snapshot:
        """Advance the robot by one tick and publish what came of it."""
        inbox, self._inbox = self._inbox, []
        snapshot = self.robot.tick(now, inbox)
        for name, why in snapshot.refusals:
            if name in self._clients:
                self.server.protocol.connections.send_status(self._clients[name], "warning", why)
        ticks = snapshot.stamp // TICK_NS
        for topic in topics.OUTPUTS:
            due = not topic.every or ticks % topic.every == 0
            if due and (topic.latch or self.server.protocol.topics.wanted(topic.name)):
                for message in topic.messages(snapshot):
                    self.server.protocol.topics.publish(topic.name, message, snapshot.stamp)
        if self._audit is not None:
            self._audit.hear(snapshot)
        for sink in self._sinks:
            sink(snapshot)
        return snapshot

    def post(self, message: Message) -> None:
        """Put a message of our own into the inbox."""
        self._inbox.append(message)

    def _receive(
        self,
        read: Callable[[str, dict[str, Any]], Message],
        client: int,
        message: dict[str, Any],
        now: int,
    ) -> None:
        name = self._name(client)
        try:
            heard = read(name, message)
        except (JoystickError, InvalidReadingError) as error:
            raise MessageError(str(error)) from None
        self._inbox.append(heard)
        if self._audit is not None and isinstance(heard, Hint):
            self._audit.hint(name, heard)

    def _name(self, client: int) -> str:
        name = self.server.protocol.connections.name(client)
        self._clients[name] = client
        return name

    def _joy(self, client: str, message: dict[str, Any]) -> Message:
        wish = read_joy(list(message["axes"]), list(message["buttons"]), self._layout)
        stamp = message["header"]["stamp"]
        return Drive(client, wish, int(stamp["sec"]) * SECOND + int(stamp["nanosec"]))

    def _cmd_vel(self, client: str, message: dict[str, Any]) -> Message:
        forward, turn = float(message["linear"]["x"]), float(message["angular"]["z"])
        if not np.isfinite([forward, turn]).all():
            raise JoystickError(f"cmd_vel must be finite, got {forward}, {turn}")
        return Drive(client, Wish(Twist.planar(forward, turn), enabled=True))

    def _hint(self, client: str, message: dict[str, Any]) -> Message:
        frame = message["header"]["frame_id"]
        if frame not in ("map", "/map"):
            raise InvalidReadingError(f"hint header.frame_id must be 'map', got {frame!r}")
        p, q = message["pose"]["pose"]["position"], message["pose"]["pose"]["orientation"]
        pose = Pose(
            np.array([p["x"], p["y"], p["z"]], dtype=float),
            np.array([q["w"], q["x"], q["y"], q["z"]], dtype=float),
        )
        covariance = np.asarray(message["pose"]["covariance"], dtype=float).reshape(6, 6)
        # The operator's stamp is of a clock we do not know; the hint is of now.
        return Hint(self.robot.simulation.stamp, pose, covariance)

    def _order(
        self,
        kind: type[Stop] | type[Reset] | type[TakeOver],
        done: str,
        client: int,
        request: dict[str, Any],
        now: int,
    ) -> dict[str, Any]:
        name, refused = self._name(client), ""
        access = self.server.protocol.connections.access(client)
        holder = access.holder if access else ""
        if kind is Stop and self._stopper is None:
            self._stopper = holder
        elif kind is Reset:
            if self._stopper in (None, holder) or (access and access.role is Role.ADMIN):
                self._stopper = None
            else:
                refused = (
                    f"{self._stopper} stopped the robot; only that token or an admin resets it"
                )
        if self._audit is not None:
            self._audit.order(name, _ORDERS[kind], refused)
        if refused:
            raise ServiceError(refused)
        self._inbox.append(kind(name))
        return {"success": True, "message": done}

    def _undo(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name, refused = self._name(client), ""
        if not self.robot.localizer.undoable:
            seconds = self.robot.localizer.config.undo_memory / SECOND
            refused = f"no hint or search has placed the robot within the last {seconds:.0f} s"
        if self._audit is not None:
            self._audit.order(name, "undo", refused)
        if refused:
            return {"success": False, "message": refused}
        self._inbox.append(Undo(name))
        return {"success": True, "message": "taken back with the next tick"}

    def disconnected(self, connection: Connection, now: int) -> None:
        """Have the robot release what the client controls."""
        self._clients.pop(connection.name, None)
        self._inbox.append(Gone(connection.name))


class Stepper(Observer):
    """Lockstep: the world advances only when its owner asks, through ``/sim/step``.

    The first caller owns the stepping until it leaves. To it nothing is dropped, and the answer queues
    behind all messages of its ticks.
    """

    MOST_TICKS = 500
    """In one call: ten seconds of robot time."""
    _REST_TICKS = 150
    """In which the robot has come to rest from any speed."""

    def __init__(self, host: Host, *, last_stamp: int | None = None) -> None:
        """Serve ``/sim/step`` on a host's server; no tick goes beyond ``last_stamp`` [ns]."""
        self._host, self._last_stamp = host, last_stamp
        self._owner: int | None = None
        self._busy = False
        self.error: Exception | None = None
        """What ended the simulation, if something did."""
        step = host.server.async_handlers.wrap(self._step)
        host.server.protocol.services.serve("/sim/step", "farsteer_msgs/srv/Step", step)
        host.server.protocol.observers.add(self)

    @property
    def _stamp(self) -> int:
        return self._host.robot.simulation.stamp

    @property
    def _over(self) -> bool:
        return self._last_stamp is not None and self._stamp >= self._last_stamp

    async def _step(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        ticks = int(request["ticks"])
        if self._owner not in (None, client):
            owner = self._host.server.protocol.connections.name(self._owner or 0)
            raise ServiceError(f"{owner} owns the stepping; wait until it leaves")
        if not 1 <= ticks <= self.MOST_TICKS:
            raise ServiceError(f"ticks must be 1 to {self.MOST_TICKS}, got {ticks}")
        if self._busy or self.error is not None:
            raise ServiceError(str(self.error or "the last step is not done yet"))
        self._owner = client
        self._host.server.protocol.connections.set_lossless(client)
        self._busy = True
        try:
            for _ in range(ticks):
                if self._owner != client:
                    raise ServiceError("its caller has left")
                if self._over:
                    return {"success": False, "message": "time is up", "stamp": _time(self._stamp)}
                self._tick()
                # The sockets get their turn, so that a long step does not pile up its messages.
                await asyncio.sleep(0)
        finally:
            self._busy = False
        return {"success": True, "message": "", "stamp": _time(self._stamp)}

    def _tick(self) -> Snapshot:
        try:
            snapshot = self._host.tick(self._stamp)
        except Exception as error:
            self.error = error
            raise ServiceError(str(error)) from error
        self._host.server.protocol.timers.tick(snapshot.stamp)
        return snapshot

    def disconnected(self, connection: Connection, now: int) -> None:
        """When the owner leaves, the robot brakes to rest and waits for the next."""
        if connection.id != self._owner:
            return
        self._owner = None
        for _ in range(self._REST_TICKS):
            if self.error is not None or self._over or _resting(self._tick()):
                return


def _resting(snapshot: Snapshot) -> bool:
    twist = snapshot.truth.twist
    return bool(np.abs(twist.linear).max() < 0.002 and np.abs(twist.angular).max() < 0.002)


def _time(stamp: int) -> dict[str, int]:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return {"sec": sec, "nanosec": nanosec}
