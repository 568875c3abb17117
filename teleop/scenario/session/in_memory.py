"""A run with an operator of the library: both in one process, joined by frames in memory."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import repeat

from teleop.clock import beats
from teleop.scenario.operators.command_file import COMMANDS_FILE, CommandRecorder
from teleop.scenario.operators.memory_transport import MemoryTransport
from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Wire
from teleop.scenario.referee.rules.published_messages import TYPES
from teleop.scenario.referee.rules.wire_facts import SentCommands
from teleop.scenario.session.operator_tokens import WITNESS
from teleop.scenario.session.session import SECOND, Session

Progress = Callable[[float, str], None]
"""Called now and then with the completed share, in [0, 1], and a line of text."""


class LibraryOperator:
    """An operator on its wire, as faults reach it."""

    def __init__(self, operator: Operator, wire: Wire) -> None:
        self._operator, self._wire = operator, wire
        self._dead = False

    def begin(self, briefing: Briefing) -> None:
        """Let the operator begin."""
        self._operator.begin(self._wire, briefing)

    def act(self, now: int) -> None:
        """Hand on what has arrived, and let the operator act, unless it is dead."""
        if not self._dead:
            self._wire.deliver()
            self._operator.act(self._wire, now)

    def kill(self, *, silent: bool) -> None:
        """End the operator: its connection ends too, unless it is silent."""
        self._dead = True
        if silent:
            self._wire.hang()
        else:
            self._wire.close("killed")

    def step_clock(self, seconds: float) -> None:
        """Have the operator's clock jump [s]."""
        self._wire.clock_offset += round(seconds * SECOND)


def run_in_memory(
    session: Session,
    operators: Sequence[Operator],
    briefing: Briefing,
    *,
    real_time: bool = False,
    progress: Progress = lambda share, text: None,
) -> None:
    """Tick a session until it is over.

    Args:
        session: The session.
        operators: Who drives; faults strike the first one, whose commands are recorded.
        briefing: What each knows.
        real_time: Whether a tick takes 20 ms of the clock; else it goes as fast as it can.
        progress: Called once in a second of robot time.
    """
    session.server.protocol.round_trips.attach(None)
    transport = MemoryTransport(session.server.protocol, lambda: session.stamp)
    recorder = None if session.folder is None else CommandRecorder()
    try:
        hands = []
        for number, operator in enumerate(operators):
            sent = SentCommands(None if number else recorder)
            wire = transport.connect(token=session.tokens.of(number), recorder=sent)
            if session.rules is not None:
                session.rules.wire.clients[wire.client].sent = sent
            sent.seen = _seen_by(wire)
            hands.append(LibraryOperator(operator, wire))
        if session.rules is not None:
            session.rules.published.witness = _witness(transport)
        if session.second_arm is not None:
            session.second_arm.join(transport.connect())
        session.faults.operator = hands[0] if hands else None
        for number, each in enumerate(hands):
            # Two that draw from one seed would do the same.
            each.begin(replace(briefing, seed=briefing.seed + number))
        for _ in _pace(real_time):
            for each in hands:
                each.act(session.stamp)
            if any(operator.done and operator.ends_run for operator in operators):
                session.end("the operator is done")
                break
            tick = session.tick()
            if tick is None or session.ending is not None:
                break
            if tick.stamp % SECOND == 0:
                health = tick.estimate.health.value
                share = tick.stamp / session.time_limit
                progress(share, f"{tick.stamp // SECOND} s, {health}")
    finally:
        if recorder is not None and session.folder is not None:
            recorder.save(session.folder.path / COMMANDS_FILE)


def _seen_by(wire: Wire) -> Callable[[], int | None]:
    return lambda: wire.seen


def _witness(transport: MemoryTransport) -> int:
    """Connect a client that asks for all that rules judge, and reads nothing itself; return its number."""
    wire = transport.connect(access=WITNESS)
    for topic, type in TYPES.items():
        wire.subscribe(topic, type, lambda message: None)
    wire.hang()
    return wire.client


def _pace(real_time: bool) -> Iterator[object]:
    pace: Iterable[object] = beats(threading.Event()) if real_time else repeat(None)
    yield from pace
