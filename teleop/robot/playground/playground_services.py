"""The services ``/playground/...``: passed on to the simulated world, but for that of the link."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from functools import partial
from typing import Any

from teleop.errors import SettingError
from teleop.link.emulation import LinkConfig, LinkEmulation
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.robot_services import NOT_LISTENING
from teleop.robot.clients.wishes import Wishes
from teleop.robot.inbox import WorldCall
from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.topic_table import PLAYGROUND_SERVICES
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.protocol.protocol import Protocol

_MOST_OPEN = 100
"""Calls that may wait for their answers; each takes a tick."""
_LINK = "/playground/link"
_CHANGES = ("Set", "Spawn", "Delete", "Reset", "Playground")
"""How the types of services begin that change something."""


class PlaygroundServices:
    """Serves them; owns the calls that wait for their answers. Who may call them is a rule of the roles."""

    def __init__(self, protocol: Protocol, wishes: Wishes, audit: AuditLog | None) -> None:
        """Offer the services.

        Args:
            protocol: The protocol of the robot's server.
            wishes: Takes what clients want.
            audit: Log of what clients do to the robot.
        """
        self._protocol, self._wishes, self._audit = protocol, wishes, audit
        self._numbers = itertools.count(1)
        self._open: dict[int, DeferredResponse] = {}
        handlers: dict[str, Callable[..., Any]] = {"PlaygroundLink": self._link}
        for service in PLAYGROUND_SERVICES:
            kind = service.type.rpartition("/")[2]
            handler = handlers.get(kind) or partial(self._pass_on, kind)
            protocol.services.serve(service.name, service.type, handler)

    def driven(self, tick: DriveRecord) -> None:
        """Answer what the world has done."""
        for answer in tick.world_answers:
            if (response := self._open.pop(answer.number, None)) is not None:
                response.complete(answer.response)

    def _pass_on(
        self, kind: str, client: int, request: dict[str, Any], now: int
    ) -> DeferredResponse:
        name, number = self._protocol.connections.name(client), next(self._numbers)
        text = json.dumps(request)
        call = WorldCall(name, number, kind, text)
        if len(self._open) >= _MOST_OPEN or not self._wishes.post(call):
            raise ServiceError(NOT_LISTENING)
        if kind.startswith(_CHANGES) and self._audit is not None:
            self._audit.played(name, kind, text)
        response = self._open[number] = DeferredResponse()
        return response

    def _link(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        words = tuple(request["settings"])
        try:
            config = LinkConfig.parse(words)
        except SettingError as error:
            return {"success": False, "message": str(error)}
        # The call that mends the link does not take it.
        link = LinkEmulation(config, clock_service=_LINK)
        self._protocol.observers.add(link)
        self._protocol.emulate(link)
        if self._audit is not None:
            name = self._protocol.connections.name(client)
            self._audit.played(name, "PlaygroundLink", json.dumps(words))
        return {"success": True, "message": " ".join(words) or "the link is as good as it is"}
