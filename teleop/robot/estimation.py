"""The estimator: the localiser, fed with what control recorded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from localization.errors import LocalizationError
from localization.pipeline.localizer import Localizer
from localization.types import SECOND, Estimate, Inertial
from teleop.robot.inbox import Relocalize, Undo
from teleop.robot.preview import PreviewAnswer, PreviewRequest
from teleop.robot.tick_record import DriveRecord, EstimateRecord

_LEAN_PERIOD: Final = SECOND // 2
"""Time of which the first sweep is published on ``/local_cloud/lean`` [ns]."""


class Estimation:
    """Owns the localiser of a robot; takes the records of its ticks in order."""

    def __init__(self, localizer: Localizer) -> None:
        self.localizer = localizer
        self._fit: float | None = None
        self._nis: float | None = None
        self._half_second = -1

    def take(self, tick: DriveRecord) -> EstimateRecord:
        """Process the hints, requests and readings of one tick."""
        for message in tick.inbox:
            if isinstance(message, Undo):
                self.localizer.undo()
            elif isinstance(message, Relocalize):
                self.localizer.relocalize()
        answers = [(reading, self.localizer.add(reading)) for reading in tick.readings]
        estimates = tuple(e for reading, e in answers if isinstance(reading, Inertial))
        for estimate in estimates:
            if estimate.match is not None:
                self._fit, self._nis = estimate.match.inlier_ratio, estimate.nis
        return EstimateRecord(
            stamp=tick.stamp,
            estimates=estimates,
            fit=self._fit,
            nis=self._nis,
            undoable=self.localizer.undoable,
            searching=self.localizer.searching,
            lean=self._begins_half_second(estimates),
        )

    def _begins_half_second(self, estimates: Sequence[Estimate]) -> bool:
        sweep = estimates[-1].sweep if estimates else None
        if sweep is None or sweep.stamp // _LEAN_PERIOD == self._half_second:
            return False
        self._half_second = sweep.stamp // _LEAN_PERIOD
        return True

    def preview(self, request: PreviewRequest) -> PreviewAnswer:
        """Return what the last sweep says of a pose; changes nothing."""
        try:
            return PreviewAnswer(request.number, self.localizer.preview(request.pose))
        # What a client asks about must never end the process that knows where the robot is.
        except (LocalizationError, ArithmeticError, ValueError) as error:
            return PreviewAnswer(request.number, problem=str(error))
