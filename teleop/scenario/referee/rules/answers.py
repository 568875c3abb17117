"""Rules of what the robot says: every hint is answered, and what is published is what it believes."""

from __future__ import annotations

import json
import math
from typing import Final

from localization.types import SECOND
from teleop.robot.inbox import PoseHint
from teleop.robot.tick_record import TickRecord
from teleop.rosbridge.framing.outgoing_frames import OutgoingFrame, Output
from teleop.rosbridge.protocol.connection import Connection
from teleop.rosbridge.protocol.observers import Observer
from teleop.scenario.files.faults import ScannerDead
from teleop.scenario.referee.rules.rule import Rule, RunFacts

_PATIENCE: Final = 5 * SECOND
"""Time within which a hint is answered [ns]: one looks for it in at most a few sweeps."""
_PERIOD: Final = SECOND
"""Hints of a client that follow each other faster are refused (docs/teleoperation.md) [ns]."""
_POSE: Final = "/amcl_pose"


class HintsAreAnswered(Rule):
    """An operator who gives a hint gets an answer."""

    name = "hint-answered"
    sentence = (
        "every hint that arrives is answered by a verdict within 5 s, or replaced by another hint"
    )

    def __init__(self, facts: RunFacts) -> None:
        """Begin a run without hints."""
        super().__init__(facts)
        self._read = 0
        self._waiting: int | None = None
        self._heard: dict[int, int] = {}
        # Without a scanner there is nothing to compare a hint with.
        self._blind = any(isinstance(fault, ScannerDead) for fault in facts.scenario.fault)

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        if self._blind:
            return None
        said = self.facts.wire.said
        for each in said[self._read :]:
            if each.what != "/initialpose":
                continue
            last = self._heard.get(each.client)
            if last is None or each.arrived - last >= _PERIOD:
                self._heard[each.client] = self._waiting = each.arrived
        self._read = len(said)
        if any(isinstance(message, PoseHint) for message in tick.inbox):
            self._waiting = tick.stamp
        if any(estimate.verdict is not None for estimate in tick.estimates):
            self._waiting = None
        if self._waiting is not None and tick.stamp - self._waiting > _PATIENCE:
            since, self._waiting = (tick.stamp - self._waiting) / SECOND, None
            return f"a hint has had no answer for {since:.1f} s"
        return None


class Published(Observer):
    """Reads the poses that are sent to clients; owns the newest."""

    def __init__(self) -> None:
        self.newest: dict[str, float] | None = None
        """Position of the newest pose that was sent [m]; None if it has been taken."""

    def sent(self, connection: Connection, output: Output) -> None:
        """Read a frame that is sent."""
        if not isinstance(output, OutgoingFrame) or output.topic != _POSE or output.binary:
            return
        message = json.loads(output.payload)["msg"]
        self.newest = message["pose"]["pose"]["position"]

    def take(self) -> dict[str, float] | None:
        """Return the newest position, once."""
        newest, self.newest = self.newest, None
        return newest


class PublishedIsBelieved(Rule):
    """Clients receive the robot's own estimate."""

    name = "published"
    sentence = "the published pose is the robot's estimate of that tick"

    def __init__(self, facts: RunFacts, published: Published) -> None:
        """Begin a run; ``published`` reads what is sent."""
        super().__init__(facts)
        self._published = published

    def take(self, tick: TickRecord) -> str | None:
        """See ``Rule.take``."""
        sent = self._published.take()
        if sent is None:
            return None
        for estimate in tick.estimates:
            if estimate.map_from_base is None:
                continue
            x, y = estimate.map_from_base.position[:2].tolist()
            if math.hypot(sent["x"] - x, sent["y"] - y) < 1e-6:
                return None
        return f"the pose {sent['x']:.3f}, {sent['y']:.3f} was published, which is no estimate of this tick"
