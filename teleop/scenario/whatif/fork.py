"""A recorded run forked at a time: the run as it was, and another one with a fault from that time on."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

from localization.types import SECOND
from robot_sim import TICK_NS
from teleop.errors import SettingError
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.faults import Fault
from teleop.scenario.files.operator_settings import Client, Replay
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.operator import Operator
from teleop.scenario.referee.outcome import Outcome
from teleop.scenario.referee.run_log import RunLog
from teleop.scenario.session.in_memory import Progress
from teleop.scenario.session.recorded_run import read_run
from teleop.scenario.session.run import replay_run, run_scenario
from teleop.scenario.whatif.open_loop import run_open_loop


@dataclass(frozen=True, slots=True, eq=False)
class Futures:
    """A run and its fork."""

    actual: Outcome
    """The run as it was."""
    forked: Outcome
    """The run with the faults."""
    at: int
    """Time of the fork [ns]: all ticks that end by then are common to both."""
    faults: tuple[Fault, ...]
    """What the fork adds."""
    common: str
    """Digest of the common ticks: true poses, estimates and commands, the same in both to the bit."""
    open_loop: str
    """Why the fork's messages are the recorded ones, so that nobody reacted to what is different; empty if the
    operator drove anew."""

    @property
    def is_closed_loop(self) -> bool:
        """Whether the operator drove anew."""
        return not self.open_loop


class CommonDigest:
    """Observes the ticks of a run up to the fork."""

    def __init__(self, ticks: int) -> None:
        self._log, self._ticks = RunLog(), ticks

    def __call__(self, tick: TickRecord) -> None:
        """Take a tick."""
        if len(self._log) < self._ticks:
            self._log.take(tick)

    @property
    def sha256(self) -> str:
        """Digest of what was taken."""
        return self._log.sha256


def fork(
    run: Path,
    at: float,
    faults: tuple[Fault, ...],
    folder: Path,
    *,
    operator: Operator | None = None,
    progress: Progress = lambda share, text: None,
) -> Futures:
    """Repeat a run, and run it again with further faults.

    Args:
        run: Folder of the run.
        at: Time of the fork [s]; the end of the tick that holds it.
        faults: What happens in the fork alone; none of it before ``at``.
        folder: Folder of the fork, which is a run of its own.
        operator: The operator of one's own that drove, if there was one.
        progress: Called now and then.

    Raises:
        SettingError: If the folder holds no run, or the run was over by then.
        ForkError: If the run does not repeat to the bit on this machine, so that no fork of it means anything.
    """
    was = read_run(run)
    scenario, end = was.scenario, was.ticks * TICK_NS / SECOND
    if not 0.0 <= at < end:
        raise SettingError(
            f"--at {at:g} must be a time of the run: 0 to {end - TICK_NS / SECOND:g} s"
        )
    common = math.ceil(round(at * SECOND) / TICK_NS)
    # Some faults begin in the middle of a tick, if they are asked to.
    faults = tuple(replace(fault, at=common * TICK_NS / SECOND) for fault in faults)
    first = CommonDigest(common)
    actual = replay_run(
        run,
        observers=(first,),
        progress=lambda share, text: progress(0.5 * share, f"as it was: {text}"),
    )
    _check_repeats(run, actual)
    added = replace(scenario, fault=(*scenario.fault, *faults))

    def half(share: float, text: str) -> None:
        progress(0.5 + 0.5 * share, f"with the fault: {text}")

    reason = "a client of one's own drove it" if isinstance(scenario.operator, Client) else ""
    if operator is not None or not reason:
        second = CommonDigest(common)
        forked = run_scenario(
            added,
            folder,
            beside=_beside(scenario, run),
            operator=operator,
            pace="lockstep",
            observers=(second,),
            progress=half,
        )
        if second.sha256 == first.sha256:
            return Futures(actual, forked, common * TICK_NS, faults, first.sha256, "")
        (folder / "commands.jsonl").unlink(missing_ok=True)
        reason = (
            "its operator does not do again what was recorded (--operator names one of your own)"
        )
    second = CommonDigest(common)
    forked = run_open_loop(run, added, faults, common, folder, observers=(second,), progress=half)
    if second.sha256 != first.sha256:
        raise ForkError(f"{run}: the fork differs before {at:g} s; this is a defect of farsteer")
    return Futures(actual, forked, common * TICK_NS, faults, first.sha256, reason)


class ForkError(SettingError):
    """A run that cannot be forked; the message says why."""


def _check_repeats(run: Path, actual: Outcome) -> None:
    """Compare a repeated run with the recorded one, where its digest is known."""
    try:
        recorded = json.loads((run / "outcome.json").read_text(encoding="utf-8"))["sha256"]
    except (OSError, ValueError, KeyError, TypeError):
        return
    if recorded != actual.sha256:
        raise ForkError(
            f"{run} does not repeat to the bit here: it was recorded by another version of farsteer, or on another"
            " kind of machine"
        )


def _beside(scenario: Scenario, run: Path) -> Path:
    """Return the folder in which the files of a scenario are."""
    operator = scenario.operator
    return Path(operator.file).parent if isinstance(operator, Replay) else run
