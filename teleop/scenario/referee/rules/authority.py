"""Rules of who has the robot: one driver at a time, a neutral stick before driving, an e-stop that stays."""

from __future__ import annotations

from typing import Final

from localization.types import SECOND
from teleop.robot.inbox import EStop
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.command_in_force import (
    TICK,
    WATCHDOG,
    by_hand,
    in_force,
    sources,
)
from teleop.scenario.referee.rules.rights import LatchedEStop
from teleop.scenario.referee.rules.rule import Rule, RunFacts
from teleop.scenario.referee.rules.wire_facts import ClientFacts

_LEASE: Final = 2 * SECOND
"""Silence after which another client may have the robot (docs/teleoperation.md) [ns]."""
_HANDED: Final = frozenset({"/teleop/take_over", "/teleop/give", "/teleop/estop"})
"""Services after which another client may have the robot."""


class OneDriver(Rule):
    """The robot changes hands only in the ways that there are for it."""

    name = "one-driver"
    sentence = (
        "the robot follows the client that it says drives, and another one only after take-over, give, e-stop, or "
        "once the driver has left or was silent for 2 s"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run without a driver."""
        super().__init__(facts)
        self._drivers: list[ClientFacts] = []
        """Who may be driving: more than one, while several ask for the same."""

        self._since = 0

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        forward, turn = by_hand(tick)
        now = tick.stamp - TICK
        self._drivers = [driver for driver in self._drivers if not _was_silent(driver, now)]
        if any(isinstance(message, EStop) for message in tick.inbox):
            self._drivers = []
        if forward == 0.0 and turn == 0.0:
            return None
        found = [client for client, _ in sources(self.facts.wire.clients, forward, turn, now)]
        said = tick.control.controller
        if found and all(client.name != said for client in found):
            return f"it says that {said or 'nobody'} drives, and follows {found[0].name}"
        still = [client for client in found if client in self._drivers]
        if not found or still:
            self._drivers = still or self._drivers
            return None
        before, begun = self._drivers, self._since
        self._drivers, self._since = found, now
        if not before or any(driver.left is not None for driver in before):
            return None
        if any(each.what in _HANDED for each in self.facts.wire.since(begun, now + 1)):
            return None
        return f"{found[0].name} moves the robot while {before[0].name} drives"


def _was_silent(driver: ClientFacts, now: int) -> bool:
    """Return whether a driver is silent for so long, or was until this tick, that others may have the robot."""
    heard = [message.arrived for message in driver.drives if message.arrived <= now]
    if heard and now - heard[-1] >= _LEASE - TICK:
        return True
    return len(heard) > 1 and heard[-1] - heard[-2] >= _LEASE and heard[-1] > now - TICK


class NeutralFirst(Rule):
    """A stick that was interrupted must be at rest before it moves the robot again."""

    name = "neutral-first"
    sentence = "a stick moves the robot only after it was neutral since the last interruption"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run without an e-stop."""
        super().__init__(facts)
        self._estop = -1
        self._moved = False
        self._heard: dict[int, int] = {}
        """When the last drive message of each client arrived that was followed [ns]."""

        self._neutral: dict[int, int] = {}
        """When each client's stick was last at rest since the last gap in its messages [ns]."""

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        if any(isinstance(message, EStop) for message in tick.inbox):
            self._estop = tick.stamp - TICK
        for client in self.facts.wire.clients.values():
            self._follow(client)
        forward, turn = by_hand(tick)
        moves, moved = forward != 0.0 or turn != 0.0, self._moved
        self._moved = moves
        if not moves or moved:
            return None
        now = tick.stamp - TICK
        found = list(sources(self.facts.wire.clients, forward, turn, now))
        if not found or any(not message.stick for _, message in found):
            return None
        if any(self._rested(client) for client, _ in found):
            return None
        return f"{found[0][0].name} moves the robot without a neutral stick before"

    def _follow(self, client: ClientFacts) -> None:
        """Note when a stick was at rest: what a client said long ago is not kept, but may hold still."""
        last = begin = self._heard.get(client.number, -1)
        for message in client.drives:
            if message.arrived <= begin:
                continue
            if message.arrived - last > WATCHDOG + TICK:
                self._neutral.pop(client.number, None)
            if not message.moves:
                self._neutral[client.number] = message.arrived
            last = message.arrived
        self._heard[client.number] = last

    def _rested(self, client: ClientFacts) -> bool:
        """Return whether a client's stick was at rest since the last gap in its messages, and the last e-stop."""
        return self._neutral.get(client.number, -2) >= self._estop


class EStopStays(Rule):
    """An e-stop holds until it is released."""

    name = "e-stop"
    sentence = "nothing moves the robot from an e-stop until somebody releases it who may"

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run without an e-stop."""
        super().__init__(facts)
        self._estop = LatchedEStop(facts.wire)

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        self._estop.take(tick)
        latched = self._estop.owner is not None
        forward, turn = in_force(tick)
        if latched and (forward != 0.0 or turn != 0.0):
            return "a command is in force though the e-stop is latched"
        if latched and tick.control.control != "estop":
            return f"the e-stop is latched, and the robot says {tick.control.control}"
        return None
