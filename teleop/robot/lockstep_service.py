"""The service ``/sim/step``: simulated time advances only when a client requests it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any, Final

from localization.logs.ros_stamps import stamp_to_dict
from teleop.robot.stepped_robot import SteppedRobot
from teleop.robot.tick_record import TickRecord, resting
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer

_UNREAD: Final = 0.05
"""Time for which deferred work waits until the response of a step has been sent [s]."""


class LockstepService(Observer):
    """Advances the robot on request.

    The first caller owns the stepping until it disconnects. No message to it is dropped, and each
    response is queued behind all messages of its ticks.
    """

    MAX_TICKS: Final = 500
    """Largest number of ticks in one call: ten seconds of robot time."""
    MAX_BRAKING_TICKS: Final = 150
    """Number of ticks within which the robot reaches standstill from any speed."""

    def __init__(
        self,
        stepped: SteppedRobot,
        *,
        over: Callable[[], str] = lambda: "",
        deferred: Callable[[], None] = lambda: None,
    ) -> None:
        """Offer the service on the server of a robot.

        Args:
            stepped: The robot and its server.
            over: Returns why no further tick may begin; nothing while it may.
            deferred: Called after each step, while the client decides on the next one; for work that
                no response waits for, such as recording.
        """
        self.stepped, self.adapter = stepped, stepped.adapter
        self._over, self._deferred = over, deferred
        self._owner: int | None = None
        self._busy = False
        self._deferring: asyncio.Future[None] | None = None
        self.error: Exception | None = None
        """The error that ended the simulation, if one did."""
        server = self.adapter.server
        step = server.async_handlers.wrap(self._step)
        server.protocol.services.serve("/sim/step", "farsteer_msgs/srv/Step", step)
        server.protocol.observers.add(self)

    @property
    def _stamp(self) -> int:
        return self.stepped.stamp

    async def _step(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        ticks = int(request["ticks"])
        self._check(client, ticks)
        self._owner = client
        self.adapter.server.protocol.connections.set_lossless(client)
        self._busy = True
        try:
            for _ in range(ticks):
                if self._owner != client:
                    raise ServiceError("the caller has disconnected")
                if reason := self._over():
                    return self._response(reason)
                self._tick()
                # Yield to the sockets, so that a long step does not pile up its messages.
                await asyncio.sleep(0)
        finally:
            self._busy = False
            self._deferring = asyncio.ensure_future(self._do_deferred(client))
        return self._response("")

    async def _do_deferred(self, client: int) -> None:
        """Do what nobody waits for, as soon as the response of a step has been sent."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_UNREAD):
                await self.adapter.server.flush(client)
        try:
            self._deferred()
        except Exception as error:
            self.error = error

    def _check(self, client: int, ticks: int) -> None:
        if self._owner not in (None, client):
            owner = self.adapter.server.protocol.connections.name(self._owner or 0)
            raise ServiceError(f"{owner} owns the stepping; wait until it disconnects")
        if not 1 <= ticks <= self.MAX_TICKS:
            raise ServiceError(f"ticks must be 1 to {self.MAX_TICKS}, got {ticks}")
        if self._busy or self.error is not None:
            raise ServiceError(str(self.error or "the last step has not ended yet"))

    def _response(self, failure: str) -> dict[str, Any]:
        stamp = stamp_to_dict(self._stamp)
        return {"success": not failure, "message": failure, "stamp": stamp}

    def _tick(self) -> TickRecord:
        try:
            return self.stepped.tick()
        except Exception as error:
            self.error = error
            raise ServiceError(str(error)) from error

    def disconnected(self, connection: Connection, now: int) -> None:
        """Brake the robot to rest when the owner disconnects, and free the stepping."""
        if connection.id != self._owner:
            return
        self._owner = None
        for _ in range(self.MAX_BRAKING_TICKS):
            if self.error is not None or self._over() or resting(self._tick()):
                return
