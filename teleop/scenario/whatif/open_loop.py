"""The fork of a run whose client is not ours: its recorded messages again, later than they came, or never.

The client cannot be asked what it would have done, so nobody reacts to what is different.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.link.timeline import NEVER, LinkSchedule
from teleop.robot.inbox import Disconnected, DriveCommand, InboxMessage
from teleop.robot.stepped_robot import TickObserver
from teleop.scenario.files.faults import Fault, Link, OperatorKilled
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.outcome import EventKind, Outcome
from teleop.scenario.session.fault_schedule import SECOND_OPERATOR
from teleop.scenario.session.in_memory import Progress
from teleop.scenario.session.links import period_of
from teleop.scenario.session.recorded_run import read_run
from teleop.scenario.session.referee_notes import Ending, Note
from teleop.scenario.session.run import run_again
from teleop.scenario.session.scene import scene_of

Inboxes = Mapping[int, Sequence[InboxMessage]]
"""Messages by the number of their tick."""


def run_open_loop(
    run: Path,
    scenario: Scenario,
    faults: Sequence[Fault],
    common: int,
    folder: Path,
    *,
    observers: Sequence[TickObserver] = (),
    progress: Progress = lambda share, text: None,
) -> Outcome:
    """Run a scenario with the recorded messages of a run, as the added faults let them through.

    Args:
        run: Folder of the run.
        scenario: The scenario, with the added faults.
        faults: The added faults.
        common: Number of ticks before them.
        folder: Folder of the new run.
        observers: Called with the record of each tick.
        progress: Called once in a second of robot time.
    """
    was = read_run(run)
    # What a rule says of the frames that were sent holds for the run as it was.
    scenario = replace(scenario, limits=replace(scenario.limits, rules=False))
    inboxes = delivered(was.inboxes, faults, common, seed=scenario.seed)
    notes = _again(was.notes, faults, common)
    forked = replace(was, scenario=scenario, inboxes=inboxes, notes=notes, ending=None)
    last = max([was.ticks, *(number + 1 for number in inboxes)])
    ended = Ending("the recorded messages ended here")
    return run_again(forked, scene_of(scenario, run), folder, last, ended, progress, observers)


def delivered(
    recorded: Inboxes, faults: Sequence[Fault], common: int, *, seed: int
) -> dict[int, list[InboxMessage]]:
    """Return the messages of each tick, with those of clients delayed or lost.

    As on a TCP connection, nothing is overtaken and a blackout holds back what it does not let through. Only the way
    up can be emulated: what a client would have seen later, it cannot react to any more.

    Args:
        recorded: Messages of each tick, as they were.
        faults: Links that get worse, and operators that are killed; others change no messages.
        common: Number of ticks before the faults.
        seed: Seed of the jitter.
    """
    links = [fault for fault in faults if isinstance(fault, Link) and fault.direction != "down"]
    link = LinkSchedule([period_of(each) for each in links])
    killed = next((fault for fault in faults if isinstance(fault, OperatorKilled)), None)
    draws = random.Random(f"what-if {seed}")
    inboxes: dict[int, list[InboxMessage]] = {}
    present: dict[str, None] = {}
    latest = 0
    for number in sorted(recorded):
        for message in recorded[number]:
            if not _is_of_client(message) or number < common:
                inboxes.setdefault(number, []).append(message)
                if isinstance(message, Disconnected):
                    present.pop(message.client, None)
                elif message.client:
                    present[message.client] = None
                continue
            if killed is not None:
                continue
            sent = number * TICK_NS
            delay = link.delay_at(sent) + link.jitter_at(sent) * draws.random()
            latest = max(latest, link.through(sent + round(delay * SECOND)))
            if latest < NEVER:
                tick = -(-latest // TICK_NS)
                inboxes.setdefault(tick, []).append(_later(message, latest - sent))
    if killed is not None and not killed.silent:
        gone = [Disconnected(client) for client in present if _is_of_client(Disconnected(client))]
        inboxes.setdefault(common, []).extend(gone)
    return inboxes


def _again(notes: Sequence[Note], faults: Sequence[Fault], common: int) -> list[Note]:
    """Return the notes that hold for the fork too: no broken rules, and nothing of a client that has been killed."""
    is_killed = any(isinstance(fault, OperatorKilled) for fault in faults)
    end = common * TICK_NS if is_killed else NEVER
    return [n for n in notes if n.kind is not EventKind.RULE and n.stamp <= end]


def _is_of_client(message: InboxMessage) -> bool:
    """Return whether a message came over the wire: not from the scenario itself."""
    return message.client not in ("", SECOND_OPERATOR)


def _later(message: InboxMessage, delay: int) -> InboxMessage:
    """Return a message that arrives later by a delay [ns]; a command is older by that, too."""
    if not delay or not isinstance(message, DriveCommand):
        return message
    arrival = None if message.arrival is None else message.arrival + delay
    return replace(message, arrival=arrival, age=message.age + delay)
