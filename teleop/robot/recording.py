"""Records of a drive on a disk that may fail: that costs the record, and nothing else."""

from __future__ import annotations

import contextlib
import json
import logging
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from localization.logs.log_interface import LogError
from localization.logs.mcap_writer import ReadingsWriter
from localization.logs.ros_types import build
from localization.types import Reading
from teleop.robot.inbox import InboxMessage, WorldCall
from teleop.robot.steps.precision_log import StepRow, StepsWriter
from teleop.robot.topics.arm_joints import arm_joints_message

if TYPE_CHECKING:  # imported only where there is an arm
    from teleop.robot.arm.arm_state import ArmState

ARM_JOINTS: Final = "/arm/joint_states"
"""Topic of the arm's joints in a log; on the wire they share that of the wheels, which a localiser reads."""

PLAYGROUND: Final = "/playground/calls"
"""Topic of the calls of the playground in a log, as JSON."""

_LOG: Final = logging.getLogger(__name__)


class Recording:
    """The log of the readings and the table of the steps; each ends by itself when its disk fails."""

    def __init__(self, log: ReadingsWriter, path: Path, steps: StepsWriter | None = None) -> None:
        """Take over the writers.

        Args:
            log: Log of the readings.
            path: Its file, for people.
            steps: Table of the steps; None for none.
        """
        self._log: ReadingsWriter | None = log
        self._path, self._steps = path, steps
        self._calls: list[tuple[int, str]] = []

    def readings(
        self, readings: Sequence[Reading], stamp: int, arm: ArmState | None = None
    ) -> None:
        """Log the readings that were received at a time [ns], and how an arm was then."""
        log = self._log
        if log is None:
            return

        def write() -> None:
            self._write_calls(log, stamp)
            for reading in readings:
                log.write(reading, stamp)
            if arm is not None:
                log.write_beside(ARM_JOINTS, arm_joints_message(arm), stamp)

        if not self._survives("log", write):
            self._log = None
            log.abandon()

    def calls(self, inbox: Sequence[InboxMessage], stamp: int) -> None:
        """Note what clients have changed in a simulated world, by a time [ns]; it is logged before later readings.

        Readings may still come that are older: an estimator that is behind has them waiting.
        """
        self._calls += [
            (
                stamp,
                json.dumps(
                    {"client": m.client, "service": m.service, "request": json.loads(m.request)}
                ),
            )
            for m in inbox
            if isinstance(m, WorldCall)
        ]

    def _write_calls(self, log: ReadingsWriter, until: float) -> None:
        while self._calls and self._calls[0][0] <= until:
            stamp, line = self._calls.pop(0)
            log.write_beside(PLAYGROUND, build("std_msgs/msg/String", data=line), stamp)

    def steps(self, rows: Iterable[StepRow]) -> None:
        """Add the rows of steps that have ended."""
        steps = self._steps
        if steps is not None and not self._survives(
            "table of steps beside", lambda: steps.write(rows)
        ):
            self._steps = None
            with contextlib.suppress(OSError):
                steps.close()

    def close(self) -> None:
        """Complete both files."""
        log, steps = self._log, self._steps
        self._log = self._steps = None

        def complete() -> None:
            assert log is not None
            self._write_calls(log, math.inf)
            log.close()

        if log is not None and not self._survives("log", complete):
            log.abandon()
        if steps is not None:
            self._survives("table of steps beside", steps.close)

    def _survives(self, what: str, write: Callable[[], object]) -> bool:
        """Write; return whether the disk took it, and say why if it did not."""
        try:
            write()
        except (OSError, LogError) as error:
            why = getattr(error, "strerror", None) or str(error)
            _LOG.error(
                "the %s %s ends here: %s; the robot goes on, and what was written before can be read",
                what,
                self._path,
                why,
            )
            return False
        return True
