"""Rules of who may do what: who only watches moves nothing, and who may drive gets a robot that nobody has."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

from localization.types import SECOND
from teleop.robot.inbox import Disconnected, EStop, EStopReset
from teleop.robot.step_results import NO_STEPS
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import ClockStep, Link
from teleop.scenario.referee.rules.command_in_force import TICK
from teleop.scenario.referee.rules.rule import Rule, RunFacts
from teleop.scenario.referee.rules.wire_facts import ClientFacts, WireFacts

_SILENT: Final = 3 * SECOND
"""Silence of all others after which nobody else has the robot: its lease ends after 2 s [ns]."""
_AT_REST: Final = SECOND // 2
"""Time for which a stick is at rest by the end of which it has armed the robot [ns]."""
_FREED: Final = _AT_REST + 2 * TICK
"""Time after a client has left by which another one's stick, at rest since then, has armed the robot [ns]."""
_LATE: Final = SECOND // 10
"""Delay of commands from which on it is another rule's matter whether they are followed [ns]."""


class LatchedEStop:
    """Owns who has latched the e-stop, as far as clients and faults may latch and release it."""

    def __init__(self, wire: WireFacts) -> None:
        self._wire = wire
        self.owner: str | None = None
        """Holder of the token by which it was latched, empty without one; None while it is not latched."""

    def take(self, tick: TickRecord) -> None:
        """Follow what was pressed and released until a tick."""
        now = tick.stamp - TICK
        clients = {client.name for client in self._wire.clients.values()}
        others = [
            message for message in tick.inbox if getattr(message, "client", "") not in clients
        ]
        said = list(self._wire.since(now - TICK + 1, now + 1))
        pressed = [
            self._wire.clients[each.client].holder for each in said if each.what == "/teleop/estop"
        ]
        pressed += [message.holder for message in tick.inbox if isinstance(message, EStop)]
        if pressed and self.owner is None:
            self.owner = pressed[-1]
        released = any(isinstance(message, EStopReset) for message in others) or any(
            each.what == "/teleop/estop_reset" and self._may(self._wire.clients[each.client])
            for each in said
        )
        if released:
            self.owner = None

    def _may(self, client: ClientFacts) -> bool:
        """Return whether a client may release it (docs/security.md)."""
        return client.role == "admin" or self.owner in ("", client.holder)


class ViewersWatch(Rule):
    """A client with a token of the role ``view`` sees the robot, and can stop it."""

    name = "viewer"
    sentence = (
        "nothing of a client of the role `view` reaches the robot but its e-stop; it never drives"
    )

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        viewers = {c.name for c in self.facts.wire.clients.values() if c.role == "view"}
        for message in tick.inbox:
            if message.client in viewers and not isinstance(message, EStop | Disconnected):
                return f"{message.client} may only watch, and sends a {type(message).__name__}"
        if tick.control.controller in viewers:
            return f"{tick.control.controller} may only watch, and drives"
        return None


class FreeRobotIsHad(Rule):
    """Who may drive gets a robot that nobody has."""

    name = "free"
    sentence = (
        "who has left or sent nothing for 3 s does not have the robot; a client that may drive has it where nobody "
        "else asked for it for 3 s and no e-stop holds it, once its stick has been at rest with the deadman held for "
        "0.5 s over a link without faults"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._estop = LatchedEStop(facts.wire)
        self._stepped = -_SILENT
        # What a bad link or a clock that jumps does to commands is judged by other rules.
        self._until = min(
            (f.at * SECOND for f in facts.scenario.fault if isinstance(f, Link | ClockStep)),
            default=float("inf"),
        )

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        now = tick.stamp - TICK
        self._estop.take(tick)
        said = list(self.facts.wire.since(now - _SILENT, now + 1))
        arm = tick.drive.arm
        if tick.drive.steps != NO_STEPS or (arm is not None and arm.goals.moving):
            self._stepped = tick.stamp
        elif now - self._stepped > _SILENT and not any(_hands(each.what) for each in said):
            for client in self.facts.wire.clients.values():
                if client.name == tick.control.controller and not _sends(client, now):
                    return f"{client.name} has the robot, and has been silent for more than 3 s"
        stopped = self._estop.owner is not None or tick.control.control == "estop"
        if now >= self._until or stopped or any(_hands(each.what) for each in said):
            return None
        for client in self.facts.wire.clients.values():
            others = [c for c in self.facts.wire.clients.values() if c is not client]
            if not _asks(client, now) or any(_sends(other, now) for other in others):
                continue
            control = tick.control
            if control.controller != client.name or control.control != "armed":
                return f"{client.name} asks for the robot, which nobody has: {control.reason}"
        return None


def _hands(service: str) -> bool:
    return service.startswith("/teleop/") and service not in ("/teleop/session", "/teleop/link")


def _sends(client: ClientFacts, now: int) -> bool:
    """Return whether a client may still have the robot, or have asked for it."""
    if client.left is not None and now - client.left > _FREED:
        return False
    if client.arm_at is not None and now - client.arm_at < _SILENT:
        return True
    return any(now - message.arrived < _SILENT for message in client.drives)


def _asks(client: ClientFacts, now: int) -> bool:
    """Return whether a client's stick has been at rest with the deadman held, for long enough and without gaps."""
    if client.role == "view" or client.left is not None:
        return False
    # What arrives now is taken by the next tick.
    heard = [message for message in client.drives if message.arrived <= now - TICK]
    recent = [message for message in heard if message.arrived >= now - TICK - _AT_REST]
    times = [now - TICK - _AT_REST, *(message.arrived for message in recent), now]
    if max(b - a for a, b in pairwise(times)) > _AT_REST // 2:
        return False
    offsets = [message.arrived - message.stamped for message in heard if message.stamped]
    steady = bool(offsets) and max(offsets) - min(offsets) < _LATE
    return steady and all(
        message.enabled and message.stick and not message.moves for message in recent
    )
