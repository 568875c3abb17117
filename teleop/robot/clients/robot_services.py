"""The services that the robot offers: e-stop, taking turns, undo, search."""

from __future__ import annotations

from typing import Any, Final

from localization.types import SECOND
from teleop.robot.audit.audit_log import AuditLog
from teleop.robot.clients.whoami_service import may_drive
from teleop.robot.clients.wishes import Wishes
from teleop.robot.guard.verdict import GuardState
from teleop.robot.inbox import (
    Ask,
    EStop,
    EStopReset,
    Give,
    GuardSwitch,
    InboxMessage,
    Refuse,
    Relocalize,
    TakeOver,
    Undo,
)
from teleop.robot.safety.estop import estop_after, reset_rejection
from teleop.robot.safety.guard_switch import switch_rejection
from teleop.robot.safety.turns import Turn
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.rosbridge.auth.permissions import Role
from teleop.rosbridge.errors import ServiceError
from teleop.rosbridge.protocol.protocol import Protocol

_TRIGGER: Final = "std_srvs/srv/Trigger"

_SEARCH_PERIOD: Final = SECOND
"""Each client may request a search once in this time [ns]."""

NOT_LISTENING: Final = "the robot takes no messages at the moment; try again"
"""Answer to what could not be passed on."""


class RobotServices:
    """Serves the robot's services by what is known of it; owns the times of the last searches."""

    def __init__(
        self, protocol: Protocol, wishes: Wishes, undo_memory: int, audit: AuditLog | None
    ) -> None:
        """Offer the services.

        Args:
            protocol: The protocol of the robot's server.
            wishes: Takes what clients want.
            undo_memory: Time for which a placement can be undone [ns], for people.
            audit: Log of what clients do to the robot.
        """
        self._connections, self._wishes, self._audit = protocol.connections, wishes, audit
        self._undo_memory = undo_memory
        self._search_requests: dict[int, int] = {}
        self._estop: EStop | None = None
        self._turn = Turn()
        self._undoable = self._searching = self._guarded = False
        protocol.services.serve("/teleop/estop", _TRIGGER, self._stop)
        protocol.services.serve("/teleop/estop_reset", _TRIGGER, self._reset)
        protocol.services.serve("/teleop/take_over", _TRIGGER, self._take_over)
        protocol.services.serve("/teleop/ask", _TRIGGER, self._ask)
        protocol.services.serve("/teleop/give", _TRIGGER, self._give)
        protocol.services.serve("/teleop/refuse", _TRIGGER, self._refuse)
        protocol.services.serve("/teleop/guard_switch", "std_srvs/srv/SetBool", self._guard)
        protocol.services.serve("/localization/undo", _TRIGGER, self._undo)
        protocol.services.serve("/localization/relocalize", _TRIGGER, self._relocalize)

    def driven(self, tick: DriveRecord) -> None:
        """Note the state of the command path."""
        self._estop, self._turn = tick.control.estop, tick.control.turn
        self._guarded = tick.guard.state is not GuardState.OFF

    def estimated(self, tick: EstimateRecord) -> None:
        """Note what the localiser can do."""
        self._undoable, self._searching = tick.undoable, tick.searching

    def forget(self, client: int) -> None:
        """Note that a client has left."""
        self._search_requests.pop(client, None)

    def _stop(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name = self._connections.name(client)
        self._record(name, "e-stop")
        access = self._connections.access(client)
        # Everybody who may drive resets that of a viewer, who cannot, with or without a token.
        mine = access is not None and access.role is not Role.VIEW
        self._post(EStop(name, self._holder(client) if mine else ""))
        return {"success": True, "message": "stopped"}

    def _reset(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name, access = self._connections.name(client), self._connections.access(client)
        reset = EStopReset(
            name,
            self._holder(client),
            admin=access is not None and access.role is Role.ADMIN,
            operator=access is not None and access.role.rank >= Role.OPERATE.rank,
        )
        # The rule is the robot's; it is asked here for what holds once it has taken all messages.
        rejection = reset_rejection(estop_after(self._estop, self._wishes.outstanding()), reset)
        self._record(name, "e-stop reset", rejection)
        if rejection is not None:
            raise ServiceError(rejection)
        self._post(reset)
        return {"success": True, "message": "reset; send a neutral stick to drive"}

    def _take_over(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        name = self._connections.name(client)
        self._record(name, "take-over")
        self._post(TakeOver(name))
        return {"success": True, "message": "you hold the lease; send a neutral stick to drive"}

    def _ask(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        message = Ask(self._connections.name(client), client)
        rejection, turn = None, self._turn.after(self._wishes.outstanding())
        access = self._connections.access(client)
        if access is None or not may_drive(access):
            role = f"role {access.role}" if access else "the caller"
            rejection = f"{role} may not drive; connect with a token that may"
        answer = f"asked; {turn.controller} gives the robot, or refuses"
        return self._pass_on("ask", message, rejection or turn.rejection(message), answer)

    def _give(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        message = Give(self._connections.name(client))
        turn = self._turn.after(self._wishes.outstanding())
        who = turn.asking.client if turn.asking else ""
        answer = f"{who} has the robot, and drives after a neutral stick"
        return self._pass_on("give", message, turn.rejection(message), answer)

    def _refuse(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        message = Refuse(self._connections.name(client))
        turn = self._turn.after(self._wishes.outstanding())
        answer = "refused; you go on driving"
        return self._pass_on("refuse", message, turn.rejection(message), answer)

    def _guard(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        message = GuardSwitch(self._connections.name(client), request["data"])
        driver = self._turn.after(self._wishes.outstanding()).controller
        rejection = switch_rejection(message, driver)
        if not self._guarded:
            rejection = "this robot has no guard"
        elif not may_drive(self._connections.access(client)):
            rejection = "the caller may not drive; connect with a token that may"
        what, answer = "off", "the guard is off until your lease ends; everybody sees it"
        if message.on:
            what, answer = "on", "the guard is on"
        return self._pass_on(f"guard {what}", message, rejection, answer)

    def _undo(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        rejection = None
        if not self._undoable:
            seconds = self._undo_memory / SECOND
            rejection = f"no hint or search has set the pose within the last {seconds:.0f} s"
        message = Undo(self._connections.name(client))
        return self._pass_on("undo", message, rejection, "undone with the next tick")

    def _relocalize(self, client: int, request: dict[str, Any], now: int) -> dict[str, Any]:
        rejection = self._search_rejection(client, now)
        if rejection is None:
            self._search_requests[client] = now
        message = Relocalize(self._connections.name(client))
        answer = "searching the whole map; drive on if several places fit"
        return self._pass_on("relocalize", message, rejection, answer)

    def _search_rejection(self, client: int, now: int) -> str | None:
        """Return why a client may not request a search now [ns]; None if it may."""
        if (last := self._search_requests.get(client)) is not None and now - last < _SEARCH_PERIOD:
            wait = (last + _SEARCH_PERIOD - now) / SECOND
            return f"one request a second: wait for {wait:.2f} s"
        waiting = any(isinstance(message, Relocalize) for message in self._wishes.outstanding())
        if waiting or self._searching:
            return "a search is under way already; its result is on /localization/status"
        return None

    def _pass_on(
        self, action: str, message: InboxMessage, rejection: str | None, answer: str
    ) -> dict[str, Any]:
        """Pass a request on, unless it is rejected; return the response."""
        self._record(message.client, action, rejection)
        if rejection is not None:
            return {"success": False, "message": rejection}
        self._post(message)
        return {"success": True, "message": answer}

    def _post(self, message: InboxMessage) -> None:
        if not self._wishes.post(message):
            raise ServiceError(NOT_LISTENING)

    def _holder(self, client: int) -> str:
        access = self._connections.access(client)
        return access.holder if access else ""

    def _record(self, client: str, action: str, rejection: str | None = None) -> None:
        if self._audit is not None:
            self._audit.action(client, action, rejection)
