"""Short runs in the corridor, whose every tick is kept."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from localization.types import Twist
from robot_sim import SkidSteer
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.reading import scenario_from
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.hands import Hands
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Wire
from teleop.scenario.referee.outcome import Outcome
from teleop.scenario.session.in_memory import run_in_memory
from teleop.scenario.session.links import link_of
from teleop.scenario.session.run import outcome_of
from teleop.scenario.session.run_folder import RunFolder
from teleop.scenario.session.scene import scene_of
from teleop.scenario.session.session import Session

TICK: Final = 0.02
"""Duration of a tick [s]."""
NOTHING: Final = Briefing((), 0)


class Forward(Operator):
    """Arms the robot, and keeps the stick forward."""

    def __init__(self, speed: float = 0.5, turn: float = 0.0) -> None:
        super().__init__()
        self._hands, self._twist = Hands(), Twist.planar(speed, turn)

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Need nothing."""

    def act(self, wire: Wire, now: int) -> None:
        """Send a command with each tick."""
        if now == 0:
            self._hands.neutral(wire)
        else:
            self._hands.hold(wire, self._twist)


class Listener(Operator):
    """Subscribes to topics and keeps what comes, with the time at which it was handed on."""

    def __init__(self, **topics: str) -> None:
        super().__init__()
        self._topics = topics
        self.heard: list[tuple[int, dict[str, Any]]] = []
        self._arrived: list[dict[str, Any]] = []

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Subscribe."""
        self.wire = wire
        for topic, kind in self._topics.items():
            wire.subscribe(topic, kind, self._arrived.append)

    def act(self, wire: Wire, now: int) -> None:
        """Keep what has come."""
        self.heard += [(now, message) for message in self._arrived]
        self._arrived.clear()


def scenario(*faults: dict[str, Any], scene: str = "corridor", **fields: Any) -> Scenario:
    """Return a scenario of 1 s in the corridor; ``time`` is its time limit [s]."""
    time = fields.pop("time", 1.0)
    goals = fields.pop("goals", [])
    document = {
        "format": 1,
        "name": "short",
        "world": {"scene": scene, **fields.pop("world", {})},
        "mission": {"time_limit": time, "goals": goals},
        "fault": list(faults),
        **fields,
    }
    return scenario_from(document)


@dataclass(frozen=True, slots=True)
class Run:
    """A session that is over, with its ticks."""

    session: Session
    ticks: list[TickRecord]

    @property
    def sha256(self) -> str:
        """Digest of the trajectory."""
        return self.session.referee.log.sha256

    @property
    def texts(self) -> list[str]:
        """What was noted."""
        return [event.text for event in self.session.referee.events]

    def time_of(self, text: str) -> float:
        """Time at which something that begins so was noted [s]."""
        events = self.session.referee.events
        return next(event.stamp * 1e-9 for event in events if event.text.startswith(text))

    @property
    def x(self) -> list[float]:
        """True x at the end of each tick [m]."""
        return [float(tick.truth.map_from_base.position[0]) for tick in self.ticks]

    @property
    def modes(self) -> list[str]:
        """State of the command path with each tick."""
        return [tick.control.control.value for tick in self.ticks]


def run(
    chosen: Scenario,
    *operators: Operator,
    folder: Path | None = None,
    ticks: int | None = None,
    briefing: Briefing = NOTHING,
) -> Run:
    """Run a scenario to its end, or for some ticks; by default nobody drives."""
    scene = scene_of(chosen)
    kept = None if folder is None else RunFolder(folder, chosen, scene)
    session = Session(chosen, scene, link=link_of(chosen))
    session.folder = kept
    records: list[TickRecord] = []
    session.stepped.observers += (records.append,)
    if ticks is not None:
        session.stepped.observers += (
            lambda tick: session.end("enough") if len(records) == ticks else None,
        )
    run_in_memory(session, operators, briefing)
    if kept is not None:
        kept.close()
    return Run(session, records)


def digests(ticks: Sequence[TickRecord], *, inboxes: bool = True) -> list[str]:
    """Return of each tick a digest of all that went in, was measured, estimated, done and true.

    Args:
        ticks: The ticks.
        inboxes: Whether what clients sent is part of it.
    """
    return [
        hashlib.sha256(
            b"|".join(
                _parts((tick.drive if inboxes else replace(tick.drive, inbox=()), tick.estimation))
            )
        ).hexdigest()
        for tick in ticks
    ]


def _parts(value: object) -> Iterator[bytes]:
    if isinstance(value, np.ndarray):
        yield value.tobytes()
    elif isinstance(value, SkidSteer):
        yield value.name.encode()
    elif is_dataclass(value):
        for field in fields(value):
            yield from _parts(getattr(value, field.name))
    elif isinstance(value, tuple):
        for each in value:
            yield from _parts(each)
    else:
        yield repr(value).encode()


def first_difference(one: Run, other: Run, *, inboxes: bool = True) -> float:
    """Return the time at the beginning of the first tick in which two runs differ [s]; infinity if none does."""
    mine, others = (digests(each.ticks, inboxes=inboxes) for each in (one, other))
    pairs = zip(mine, others, strict=False)
    return next((i * TICK for i, (a, b) in enumerate(pairs) if a != b), math.inf)


def outcome(run: Run) -> Outcome:
    """Return the outcome of a run."""
    return outcome_of(run.session, "lockstep", 1.0, "")
