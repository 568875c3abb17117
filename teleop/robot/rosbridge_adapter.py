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
from teleop.joystick import JoystickError, JoystickLayout, VelocityRequest, read_joy
from teleop.robot import topics
from teleop.robot.audit_log import AuditLog
from teleop.robot.robot import (
    Disconnected,
    DriveCommand,
    EStop,
    EStopReset,
    Message,
    Robot,
    TakeOver,
    TickRecord,
    Undo,
)
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.compat.client_traffic import publish_client_traffic
from teleop.rosbridge.compat.standard_services import serve_standard
from teleop.rosbridge.errors import MessageError, ServiceError
from teleop.rosbridge.server.server import Server

TickObserver = Callable[[TickRecord], None]
"""Gets each snapshot, as a recorder or a referee does."""


_ORDERS = {EStop: "e-stop", EStopReset: "e-stop reset", TakeOver: "take-over"}
"""What the audit log calls them."""


class RosbridgeAdapter:
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
        self.robot, self.server = robot, server
        self._layout, self._observers = layout or JoystickLayout(), observers
        self._audit = audit
        self._stopper: str | None = None
        """Holder of the token that the e-stop was latched with; None while it is not."""

        self._inbox: list[Message] = []
        self._clients: dict[str, int] = {}
        for topic in topics.OUTPUTS:
            server.advertise(topic.name, topic.type, latch=topic.latch)
        for latched, message in topics.latched(cloud, robot.simulation.mounts).items():
            server.advertise(latched.name, latched.type, latch=True)
            server.publish(latched.name, message, 0)
        readers: Mapping[str, Callable[[str, dict[str, Any]], Message]] = {
            "/joy": self._joy,
            "/unity/joy": self._joy,
            "/cmd_vel": self._cmd_vel,
            "/initialpose": self._hint,
        }
        for entry in topics.INPUTS:
            server.listen(entry.name, entry.type, partial(self._receive, readers[entry.name]))
        for name, kind, done in (
            ("/teleop/estop", EStop, "stopped"),
            ("/teleop/estop_reset", EStopReset, "reset; show a neutral stick to drive"),
            ("/teleop/take_over", TakeOver, "yours; show a neutral stick to drive"),
        ):
            server.serve(name, "std_srvs/srv/Trigger", partial(self._order, kind, done))
        server.serve("/localization/undo", "std_srvs/srv/Trigger", self._undo)
        serve_standard(server.protocol)
        publish_client_traffic(server)
        server.on_disconnect(self._gone)

    def tick(self, now: int) -> TickRecord:
        """Advance the robot by one tick and publish what came of it."""
        inbox, self._inbox = self._inbox, []
        tick = self.robot.tick(now, inbox)
        for name, why in tick.refusals:
            if name in self._clients:
                self.server.protocol.status(self._clients[name], "warning", why)
        ticks = tick.stamp // TICK_NS
        for topic in topics.OUTPUTS:
            due = not topic.every or ticks % topic.every == 0
            if due and (topic.latch or self.server.wanted(topic.name)):
                for message in topic.messages(tick):
                    self.server.publish(topic.name, message, tick.stamp)
        if self._audit is not None:
            self._audit.hear(tick)
        for sink in self._observers:
            sink(tick)
        return tick

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
        name = self.server.name(client)
        self._clients[name] = client
        return name

    def _joy(self, client: str, message: dict[str, Any]) -> Message:
        request = read_joy(list(message["axes"]), list(message["buttons"]), self._layout)
        stamp = message["header"]["stamp"]
        return DriveCommand(client, request, int(stamp["sec"]) * SECOND + int(stamp["nanosec"]))

    def _cmd_vel(self, client: str, message: dict[str, Any]) -> Message:
        forward, turn = float(message["linear"]["x"]), float(message["angular"]["z"])
        if not np.isfinite([forward, turn]).all():
            raise JoystickError(f"cmd_vel must be finite, got {forward}, {turn}")
        return DriveCommand(client, VelocityRequest(Twist.planar(forward, turn), enabled=True))

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
        kind: type[EStop] | type[EStopReset] | type[TakeOver],
        done: str,
        client: int,
        request: dict[str, Any],
        now: int,
    ) -> dict[str, Any]:
        name, refused = self._name(client), ""
        access = self.server.protocol.access(client)
        holder = access.holder if access else ""
        if kind is EStop and self._stopper is None:
            self._stopper = holder
        elif kind is EStopReset:
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

    def _gone(self, client: int, name: str) -> None:
        self._clients.pop(name, None)
        self._inbox.append(Disconnected(name))


class LockstepService:
    """Lockstep: the world advances only when its owner asks, through ``/sim/step``.

    The first caller owns the stepping until it leaves. To it nothing is dropped, and the answer queues
    behind all messages of its ticks.
    """

    MAX_TICKS = 500
    """In one call: ten seconds of robot time."""
    _MAX_BRAKING_TICKS = 150
    """In which the robot has come to rest from any speed."""

    def __init__(self, host: RosbridgeAdapter, *, last_stamp: int | None = None) -> None:
        """Serve ``/sim/step`` on a host's server; no tick goes beyond ``last_stamp`` [ns]."""
        self._host, self._last_stamp = host, last_stamp
        self._owner: int | None = None
        self._busy = False
        self.error: Exception | None = None
        """What ended the simulation, if something did."""
        host.server.serve("/sim/step", "farsteer_msgs/srv/Step", self._step)
        host.server.on_disconnect(self._leave)

    @property
    def _stamp(self) -> int:
        return self._host.robot.simulation.stamp

    @property
    def _over(self) -> bool:
        return self._last_stamp is not None and self._stamp >= self._last_stamp

    async def _step(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        ticks = int(request["ticks"])
        if self._owner not in (None, client):
            owner = self._host.server.name(self._owner or 0)
            raise ServiceError(f"{owner} owns the stepping; wait until it leaves")
        if not 1 <= ticks <= self.MAX_TICKS:
            raise ServiceError(f"ticks must be 1 to {self.MAX_TICKS}, got {ticks}")
        if self._busy or self.error is not None:
            raise ServiceError(str(self.error or "the last step is not done yet"))
        self._owner = client
        self._host.server.protocol.lossless(client)
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

    def _tick(self) -> TickRecord:
        try:
            tick = self._host.tick(self._stamp)
        except Exception as error:
            self.error = error
            raise ServiceError(str(error)) from error
        self._host.server.tick(tick.stamp)
        return tick

    def _leave(self, client: int, name: str) -> None:
        """When the owner leaves, the robot brakes to rest and waits for the next."""
        if client != self._owner:
            return
        self._owner = None
        for _ in range(self._MAX_BRAKING_TICKS):
            if self.error is not None or self._over or _resting(self._tick()):
                return


def _resting(tick: TickRecord) -> bool:
    twist = tick.truth.twist
    return bool(np.abs(twist.linear).max() < 0.002 and np.abs(twist.angular).max() < 0.002)


def _time(stamp: int) -> dict[str, int]:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return {"sec": sec, "nanosec": nanosec}
