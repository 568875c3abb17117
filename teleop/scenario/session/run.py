"""Runs a scenario: with an operator of the library, or with a client that is not ours; and repeats a run."""

from __future__ import annotations

import asyncio
import shlex
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal

from localization.types import SECOND
from teleop.clock import wall_seconds
from teleop.console.page_files import offer_page
from teleop.ctrl_c import left_to_event_loops
from teleop.errors import SettingError
from teleop.robot.drive import Stages
from teleop.robot.inbox import InboxMessage
from teleop.robot.serving.server_setup import offer_map
from teleop.robot.stepped_robot import TickObserver
from teleop.rosbridge.protocol.observers import Observer
from teleop.rosbridge.server.dated_loop import DatedEventLoop
from teleop.scenario.files.errors import ScenarioError
from teleop.scenario.files.operator_settings import OUTSIDE, Client, Station
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.operators.building import operator_of
from teleop.scenario.operators.operator import Operator
from teleop.scenario.referee.outcome import ExitStatus, Outcome
from teleop.scenario.session import station
from teleop.scenario.session.briefing import briefing_of
from teleop.scenario.session.client_access import access_with, environment_of
from teleop.scenario.session.client_process import ClientProcess
from teleop.scenario.session.client_watch import ClientWatch
from teleop.scenario.session.in_memory import Progress, run_in_memory
from teleop.scenario.session.links import link_of
from teleop.scenario.session.over_socket import (
    end_client,
    run_over_socket,
    run_stepped,
)
from teleop.scenario.session.recorded_run import RecordedRun, read_run
from teleop.scenario.session.referee_notes import Ending
from teleop.scenario.session.run_folder import CLIENT_LOG, RunFolder
from teleop.scenario.session.scene import Scene, checked_scene_of, scene_of
from teleop.scenario.session.session import Session

_REPLAY: Final = ("farsteer", "scenario", "replay")

Pace = Literal["lockstep", "real"]
"""Whether robot time goes as fast as it can, or as the client steps it; or as the clock goes."""


class RunInterrupted(KeyboardInterrupt):
    """Ctrl-C ended a run; what was recorded is kept, and was judged."""

    def __init__(self, outcome: Outcome) -> None:
        super().__init__("interrupted")
        self.outcome = outcome
        """What came of it; it cannot have passed."""


def run_scenario(
    scenario: Scenario,
    folder: Path | None = None,
    *,
    beside: Path | None = None,
    pace: Pace | None = None,
    client: str | None = None,
    operator: Operator | None = None,
    tokens: Path | None = None,
    port: int = 0,
    progress: Progress = lambda share, text: None,
    observers: Sequence[TickObserver] = (),
    wire_observers: Sequence[Observer] = (),
    camera: str | None = None,
    stage: Stages = lambda _: nullcontext(),
) -> Outcome:
    """Run a scenario to its end.

    Args:
        scenario: The scenario.
        folder: Folder of the run, which is created; None to keep nothing but the outcome.
        beside: Folder of the scenario's file, for the files that it names.
        pace: By default ``real`` for clients that are not ours, else ``lockstep``; a station steps the robot in any case.
        client: Command line of a client that is not ours; the scenario's operator is not used then.
        operator: An operator of your own, in the place of the scenario's.
        tokens: File of tokens that clients that are not ours must have one of; ``access_with`` says which one the
            client is given.
        port: Port for clients that are not ours; 0 for a free one.
        progress: Called once in a second of robot time.
        observers: Called with the record of each tick.
        wire_observers: Notified of connections and frames.
        camera: Name of the camera that the robot carries, drawn in its ticks; None for none.
        stage: Measures the stages of the run: ``set-up``, ``simulation``, ``localiser``, ``referee`` and ``log``; the
            rest is the wire. Those of the localiser are parts of it.

    Raises:
        ScenarioError: If the scenario cannot be run in its world; the error names the field.
        SettingError: If the settings contradict each other.
        ServerError: If the port or the file of tokens cannot be used.
        RunInterrupted: Upon Ctrl-C.
    """
    foreign = client is not None or (operator is None and isinstance(scenario.operator, OUTSIDE))
    if client is not None and not isinstance(scenario.operator, Client):
        scenario = replace(scenario, operator=Client("client"))
    if is_station := foreign and isinstance(scenario.operator, Station):
        _check_station(pace, tokens)
    if client is not None and operator is not None:
        raise SettingError("client and operator cannot both drive; give one of them")
    if foreign and folder is None:
        raise SettingError("a run with a client needs a folder for what the client prints")
    if tokens is not None and not foreign:
        raise SettingError("tokens: an operator of the library needs none; they are for --client")
    if foreign and scenario.second is not None:
        raise ScenarioError(
            ("second",),
            "drives beside an operator of the library only; start a second client instead",
        )
    if foreign and scenario.roles:
        raise ScenarioError(
            ("roles",), "are those of operators of the library; give a client of your own --tokens"
        )
    access = access_with(tokens)
    pace = pace or ("real" if foreign and not is_station else "lockstep")
    with stage("set-up"):
        scene = checked_scene_of(scenario, beside)
        drivers = [] if foreign else _drivers(scenario, operator, beside)
        session = Session(
            scenario,
            scene,
            link=link_of(scenario),
            authenticator=access.authenticator,
            by_clock=foreign and pace == "real",
            port=port,
            observers=observers,
            stage=stage,
            camera=camera,
        )
        for observer in wire_observers:
            session.server.protocol.observers.add(observer)
        # Nothing that is refused leaves a folder.
        session.folder = kept = None if folder is None else RunFolder(folder, scenario, scene)
    begun = wall_seconds()
    failure, is_interrupted = "", False
    try:
        if foreign:
            assert folder is not None
            with left_to_event_loops(), asyncio.Runner(loop_factory=DatedEventLoop) as runner:
                failure = runner.run(
                    _with_client(session, client, folder, pace, access.of(0) or "", progress)
                )
        else:
            briefing = briefing_of(scenario, scene.world)
            real = pace == "real"
            run_in_memory(session, drivers, briefing, real_time=real, progress=progress)
        if kept is not None:
            kept.end(ending_of(session, failure))
    except KeyboardInterrupt:
        is_interrupted = True
        session.end("interrupted", cut_short=True)
        if kept is not None:
            kept.end(ending_of(session))
    finally:
        factor = session.stamp / SECOND / max(wall_seconds() - begun, 1e-9)
        if session.camera is not None:
            session.camera.close()
        if kept is not None:
            kept.close()
    outcome = outcome_of(session, pace, factor, failure)
    if is_interrupted:
        raise RunInterrupted(outcome)
    return outcome


def _check_station(pace: Pace | None, tokens: Path | None) -> None:
    if pace == "real":
        raise SettingError(
            "pace: a station steps the robot, in lockstep; take a follower for real time"
        )
    if tokens is not None:
        raise SettingError("tokens: a station needs none; they are for --client")


def _drivers(scenario: Scenario, operator: Operator | None, beside: Path | None) -> list[Operator]:
    first = operator or operator_of(scenario.operator, beside=beside)
    second = scenario.second
    return [first] if second is None else [first, operator_of(second, beside=beside)]


async def _with_client(
    session: Session, command: str | None, folder: Path, pace: Pace, token: str, progress: Progress
) -> str:
    settings = session.scenario.operator
    assert isinstance(settings, OUTSIDE)
    watch = ClientWatch(
        session.server.protocol, session.note, over=lambda: session.ending is not None
    )
    offer_map(session.server, session.scene.map_file)
    offer_page(session.server.pages)
    async with session.server:
        progress(0.0, f"waiting for a client at {session.server.url}")
        client = None
        patience = settings.patience if isinstance(settings, Client) else station.PATIENCE
        try:
            told = environment_of(session, pace, token)
            if isinstance(settings, Station):
                command = station.COMMAND
                told |= station.station_environment(session, settings, folder)
            if command is not None:
                client = ClientProcess(command, told, folder / CLIENT_LOG)
            session.faults.operator = client
            run = run_stepped if pace == "lockstep" else run_over_socket
            return await run(session, watch, client, patience=patience, progress=progress)
        finally:
            if client is not None:
                try:
                    await end_client(client)
                finally:
                    client.close()


def replay_run(
    run: Path,
    folder: Path | None = None,
    *,
    progress: Progress = lambda share, text: None,
    observers: Sequence[TickObserver] = (),
) -> Outcome:
    """Repeat a run from its recorded messages, to the bit, and judge it again.

    What clients tried and may not do, and how they failed, is not in these messages; the notes of it count again. A
    run whose process was killed is repeated as far as it went, and cannot have passed.

    Args:
        run: Folder of the run.
        folder: Folder for the repeated run; None to keep nothing but the outcome.
        progress: Called once in a second of robot time.
        observers: Called with the record of each tick.

    Raises:
        SettingError: If the folder holds no complete run, or the repeated run would replace it.
        InboxFileError: If its recorded messages are damaged.
        NotesFileError: If its notes are damaged.
    """
    if folder is not None and folder.resolve() == run.resolve():
        raise SettingError(f"{run} holds the run that is repeated; take another folder")
    was = read_run(run)
    broken_off = Ending("the recorded run broke off here", cut_short=True)
    return run_again(
        was, scene_of(was.scenario, run), folder, was.ticks, broken_off, progress, observers
    )


def run_again(
    was: RecordedRun,
    scene: Scene,
    folder: Path | None,
    ticks: int,
    unended: Ending,
    progress: Progress,
    observers: Sequence[TickObserver],
) -> Outcome:
    """Run a scenario with recorded messages and notes, and judge it.

    Args:
        was: What repeats the run.
        scene: Its world and map.
        folder: Folder of the run; None to keep nothing but the outcome.
        ticks: Number of ticks after which it is over at the latest.
        unended: How it has ended then if that is not recorded; the time is added.
        progress: Called once in a second of robot time.
        observers: Called with the record of each tick.
    """
    empty: list[InboxMessage] = []
    session = Session(
        was.scenario,
        scene,
        recorded=lambda number: was.inboxes.get(number, empty),
        notes=was.notes,
        observers=observers,
    )
    session.folder = kept = None if folder is None else RunFolder(folder, was.scenario, scene)
    begun = wall_seconds()
    try:
        while session.ending is None and session.ticks < ticks:
            session.tick()
            if session.stamp % SECOND == 0:
                progress(session.ticks / ticks, f"{session.stamp // SECOND} s")
        here = f"{unended.ending}, at {session.stamp / SECOND:g} s"
        ending = was.ending or replace(unended, ending=here)
        session.end(ending.ending, cut_short=ending.cut_short)
        if kept is not None:
            kept.end(ending_of(session, ending.failure))
    finally:
        if kept is not None:
            kept.close()
    factor = session.stamp / SECOND / max(wall_seconds() - begun, 1e-9)
    return outcome_of(session, "lockstep", factor, ending.failure)


def ending_of(session: Session, failure: str = "") -> Ending:
    """Return how a session ended that is over; ``failure`` says why the client failed, if it did."""
    return Ending(session.ending or "", failure, session.cut_short)


def outcome_of(session: Session, pace: str, factor: float, failure: str) -> Outcome:
    """Return the outcome of a session that is over.

    Args:
        session: The session.
        pace: ``lockstep`` or ``real``.
        factor: Robot time over real time.
        failure: Why the client failed; empty if it did not.
    """
    import numpy as np

    lines, figures, checks = session.referee.judged()
    met = all(check.met for check in checks) and not session.cut_short
    status = ExitStatus.PASSED if met else ExitStatus.MISSED
    folder = session.folder.path if session.folder is not None else None
    return Outcome(
        scenario=session.scenario,
        status=ExitStatus.CLIENT_FAILED if failure else status,
        ending=failure or session.ending or "",
        checks=checks,
        events=tuple(session.referee.events),
        lines=lines,
        command_ages=np.array(session.referee.command_ages),
        figures=figures,
        sha256=session.referee.log.sha256,
        pace=pace,
        factor=factor,
        replay="" if folder is None else shlex.join([*_REPLAY, str(folder)]),
        cut_short=session.cut_short,
    )
