"""Rules of what may move the robot: who, how old, how fast."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import Final

from localization.types import GRAVITY, SECOND
from teleop.robot.step_results import StepProgress
from teleop.robot.tick_record import TickRecord
from teleop.scenario.referee.rules.rule import Rule, RunFacts
from teleop.scenario.referee.rules.wire_facts import ClientFacts, DriveMessage

TICK: Final = 20_000_000
"""Duration of a tick [ns]."""
WATCHDOG: Final = SECOND // 2
"""Time for which a command may stay in force (docs/teleoperation.md) [ns]."""
_OLDEST: Final = SECOND
"""Age at which a command is refused (docs/teleoperation.md) [ns]."""
_AGE_TOLERANCE: Final = SECOND // 4
"""By so much the robot may take a command for younger than it is [ns]: it pings four times a second."""
_OLDEST_SIGHT: Final = _OLDEST + SECOND // 2
"""Age at which what a driver saw may no longer move the robot [ns]: the above, a ping a quarter of a second, and as
long again between two messages of what it watches and until its hand moves."""
_EPS: Final = 1e-5
"""Tolerance of comparisons: messages carry a stick in single precision."""
_PUSHED: Final = SECOND // 2
"""Time for which a push is seen after the last touch [ns]."""


def in_force(tick: TickRecord) -> tuple[float, float]:
    """Return the command in force during a tick: forward speed [m/s], turn rate [rad/s]."""
    twist = tick.control.twist
    return float(twist.linear[0]), float(twist.angular[2])


def by_hand(tick: TickRecord) -> tuple[float, float]:
    """Return the command in force as far as a client's stick or velocity causes it: zeros while a step is driven."""
    return in_force(tick) if tick.drive.steps.moving is None else (0.0, 0.0)


_NOTHING: Final = 1e-3
"""Speed of a command that moves nothing [m/s, rad/s]; of a smaller one, single precision in ``/joy`` leaves little."""


def sources(
    clients: dict[int, ClientFacts], forward: float, turn: float, now: int
) -> Iterator[tuple[ClientFacts, DriveMessage]]:
    """Yield whose newest message may have put a command in force, and which message it is.

    A command in force has the request's signs and is not larger. A message that arrived within the tick before
    ``now`` [ns] may have come too late for it, so that the one before it counts as well.
    """
    for client in clients.values():
        for message in reversed(client.drives):
            if _may_cause(message, forward, turn):
                yield client, message
                break
            if message.arrived < now - TICK:
                break


def _may_cause(message: DriveMessage, forward: float, turn: float) -> bool:
    """Return whether a command is a message's request, or a share of it: both speeds are scaled alike."""
    if not message.enabled:
        return False
    if message.forward == 0.0 and message.turn == 0.0:
        return False
    # Whatever is asked for, 1e300 m/s as well.
    if abs(message.forward) >= abs(message.turn):
        share = forward / message.forward
    else:
        share = turn / message.turn
    return (
        0.0 < share <= 1.0 + _EPS
        and abs(forward - share * message.forward) < _EPS
        and abs(turn - share * message.turn) < _EPS
    )


class CommandHasASource(Rule):
    """Nothing moves the robot but what a client asks for now."""

    name = "source"
    sentence = (
        "the command in force is what a client asked for with the deadman held, at most 0.5 s ago, "
        "or less of it; or a step of the client that drives"
    )

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        forward, turn = in_force(tick)
        if max(abs(forward), abs(turn)) < _NOTHING:
            return None
        now = tick.stamp - TICK
        if (step := tick.drive.steps.moving) is not None:
            return self._of_step(step, tick.control.controller, now)
        found = list(sources(self.facts.wire.clients, forward, turn, now))
        if not found:
            return f"forward {forward:.3f} m/s, turn {turn:.3f} rad/s, which no client asks for"
        newest = max(message.arrived for _, message in found)
        if now - newest > WATCHDOG:
            return f"a command that arrived {(now - newest) / SECOND:.2f} s ago is in force"
        if all(client.left is not None and client.left < now for client, _ in found):
            return "a command of a client that has left is in force"
        return None

    def _of_step(self, step: StepProgress, driver: str, now: int) -> str | None:
        """Return what is wrong with a step that moves the robot: its client must drive, and be there."""
        clients = [c for c in self.facts.wire.clients.values() if c.name == step.client]
        if step.client != driver:
            return f"a step of {step.client} moves the robot while {driver or 'nobody'} drives"
        if all(client.left is not None and client.left < now for client in clients):
            return "a step of a client that has left moves the robot"
        return None


class CommandIsLimited(Rule):
    """No command and no motion beyond the platform's speeds."""

    name = "speed"
    sentence = (
        "neither the command in force nor the driven speed is beyond the robot's limits; a descent may make it "
        "faster by what it fell in the last second, and so may what touches it, such as a door that closes upon it"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run."""
        super().__init__(facts)
        self._touched = -_PUSHED
        self._heights: deque[float] = deque(maxlen=SECOND // TICK)

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        facts = self.facts
        forward, turn = in_force(tick)
        if abs(forward) > facts.max_speed + _EPS or abs(turn) > facts.max_turn + _EPS:
            return f"the command in force is {forward:.3f} m/s, {turn:.3f} rad/s"
        if tick.condition.touching:
            self._touched = tick.stamp
        driven = abs(float(tick.truth.twist.linear[0]))
        height = float(tick.truth.map_from_base.position[2])
        self._heights.append(height)
        # Downhill, and as a tyre lets go, the wheels' servos give way a little. Where the robot drops off a bank
        # its wheels hold nothing, and what it falls becomes speed: v^2 = v0^2 + 2 g h.
        fallen = max(self._heights) - height
        fastest = math.sqrt((1.25 * facts.max_speed) ** 2 + 2.0 * GRAVITY * fallen)
        if tick.stamp - self._touched > _PUSHED and driven > fastest:
            return f"it drives at {driven:.2f} m/s"
        return None


class CommandIsNew(Rule):
    """No command is obeyed that set out too long ago, or for what was seen too long ago, whatever its stamps say."""

    name = "stale"
    sentence = (
        "no command is obeyed that was on its way for more than 1.25 s, or whose driver had last been shown the robot of "
        "1.5 s before it arrived"
    )

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        forward, turn = by_hand(tick)
        if forward == 0.0 and turn == 0.0:
            return None
        now = tick.stamp - TICK
        causes = [message for _, message in sources(self.facts.wire.clients, forward, turn, now)]
        ages = [message.arrived - message.sent for message in causes if message.sent is not None]
        if ages and min(ages) > _OLDEST + _AGE_TOLERANCE:
            return f"a command is in force that was on its way for {min(ages) / SECOND:.2f} s"
        sights = [message.arrived - message.seen for message in causes if message.seen is not None]
        if sights and min(sights) > _OLDEST_SIGHT:
            return f"a command is in force for what its driver saw {min(sights) / SECOND:.2f} s before it arrived"
        return None
