"""A recorded run, as it is read from its folder to be repeated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from localization.evaluation.trajectory import EmptyTrajectoryError, Trajectory, TrajectoryError
from localization.evaluation.tum_file import read_tum
from teleop.errors import SettingError
from teleop.robot.inbox import InboxMessage
from teleop.scenario.files.errors import dotted
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.session.inbox_file import read_inboxes
from teleop.scenario.session.referee_notes import Ending, Note, read_notes
from teleop.scenario.session.run_folder import INBOX, NOTES, SCENARIO, TRUTH


@dataclass(frozen=True, slots=True, eq=False)
class RecordedRun:
    """What repeats a run to the bit."""

    scenario: Scenario
    """The scenario as it was run."""
    inboxes: Mapping[int, Sequence[InboxMessage]]
    """Messages of each tick that had any, by its number from 0."""
    notes: Sequence[Note]
    """What the referee noted of clients, in order."""
    ending: Ending | None
    """How it ended; None if its process ended first, such as by SIGKILL."""
    truth: Trajectory
    """True poses, one a tick."""

    @property
    def ticks(self) -> int:
        """Number of ticks."""
        return len(self.truth)


def read_run(run: Path) -> RecordedRun:
    """Read the folder of a run.

    Raises:
        SettingError: If the folder holds no run of a scenario.
        InboxFileError: If its messages are damaged.
        NotesFileError: If its notes are damaged.
    """
    try:
        scenario: Scenario = SCHEMA.validate_json((run / SCENARIO).read_bytes())
        inboxes, noted = read_inboxes(run / INBOX), read_notes(run / NOTES)
        truth = _truth(run / TRUTH, has_begun=bool(inboxes) or noted.ending is None)
    except OSError as error:
        name = Path(error.filename or run).name
        raise SettingError(f"{run} is not a run of a scenario: {name}: {error.strerror}") from None
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        field = dotted(problem["loc"])
        text = f"{field}: {problem['msg']}" if field else problem["msg"]
        raise SettingError(f"{run / SCENARIO} is not the scenario of a run: {text}") from None
    except TrajectoryError as error:
        raise SettingError(f"{run} is not a complete run: {error}") from None
    return RecordedRun(scenario, inboxes, noted.notes, noted.ending, truth)


def _truth(file: Path, *, has_begun: bool) -> Trajectory:
    """Return the true poses: none of a run that ended before its first tick, as without a client."""
    try:
        return read_tum(file)
    except EmptyTrajectoryError:
        if has_begun:
            raise
        return Trajectory.from_poses([])
