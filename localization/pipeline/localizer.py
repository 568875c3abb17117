"""Localizer: readings in, estimates out.

How a reading is taken is told in ``course``. Here it is seen to that only what can be true gets there, and
that what comes late takes effect at its own time. Time is the readings' time; the same readings give the
same bits.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

from localization.config import LocalizerConfig as LocalizerConfig
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import MatchSweep
from localization.pipeline.estimator import Course, Order, Snapshot
from localization.pipeline.replay_buffer import Past
from localization.pipeline.sweep_correction import Stage as Stage
from localization.pipeline.validation import ReadingValidator
from localization.types import SECOND, Estimate, Hint, Mounts, Reading


class Localizer:
    """Where is the robot? Feed it every reading in the order of arrival."""

    def __init__(
        self,
        world: PreparedMap,
        mounts: Mounts,
        config: LocalizerConfig = LocalizerConfig(),  # noqa: B008  (frozen)
        *,
        stage: Stage = lambda _: nullcontext(),
        matcher: MatchSweep | None = None,
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            mounts: ``base_from_scanner`` by the scanner's frame.
            config: all settings.
            stage: see ``Stage``.
            matcher: registers sweeps instead of what ``config.matcher`` names.
        """
        self.config = config
        self._course = Course(world, mounts, config, stage=stage, matcher=matcher)
        self._intake = ReadingValidator(mounts, config.sensors.leader, config.late_readings.horizon)
        self._past: Past[Snapshot, Order] = Past(config.late_readings, config.sensors)
        self._last = self._course.estimate()

    @property
    def refused(self) -> int:
        """How many readings were turned away as impossible."""
        return self._intake.refused

    def relocalize(self) -> None:
        """Begin a search of the whole map with the next sweep, as for a robot that was carried away.

        What it finds is told apart by driving on; until that is settled, the estimate stays as it is.
        """
        self._take(Order.LOOK_EVERYWHERE)

    @property
    def undoable(self) -> bool:
        """Whether the last placement can still be taken back."""
        return self._course.undoable

    def undo(self) -> Estimate:
        """Take back the last accepted hint, or the last placement by a search, as if it had not come.

        The estimate is then what it was, carried on by wheels, gyro and KISS-ICP's motion, with what that
        adds to its covariance; from the next sweep on it is corrected by the map again. A robot that was
        lost before is so again, and is not looked for until a hint or ``relocalize`` asks for it.

        Returns:
            The estimate as it now stands; its reasons say what was taken back, or that nothing was.
        """
        if not self.undoable:
            why = f"nothing to take back from the last {self.config.undo_memory / SECOND:.0f} s"
            return replace(self._unchanged(), reasons=(why, *self._last.reasons))
        self._take(Order.UNDO)
        self._last = self._course.estimate(late=True)
        return self._last

    def add(self, reading: Reading) -> Estimate:
        """Take one reading and return the estimate as it now stands.

        A reading that cannot be true changes nothing; the estimate's reasons then say what was refused.
        Time moves on with the inertial readings, or with what stands in for them; the others take effect
        with the one that covers them. One that comes late takes effect at its own time, and what came
        after it is taken again; a sweep is then told with the reading that moves time on next.
        """
        refusal = self._intake.refusal(reading, self._course.stamp)
        if refusal is not None:
            self._course.refuse(refusal)
            return replace(self._unchanged(), reasons=(refusal, *self._last.reasons))
        if isinstance(reading, Hint):
            self._course.expect(reading)
        if self._past.late(reading):
            self._rewind(reading)
            self._last = self._course.estimate(late=True)
            return self._last
        if not self._take(reading):
            return self._unchanged()
        self._last = self._course.estimate()
        return self._last

    def _rewind(self, reading: Reading) -> None:
        """Be again what was before a reading that comes late, and take it and all that came since."""
        state, again = self._past.rewind(reading)
        self._course.restore(state)
        for what in again:
            self._take(what)

    def _take(self, what: Reading | Order) -> bool:
        self._past.note(what, self._course.snapshot)
        return self._course.take(what)

    def _unchanged(self) -> Estimate:
        """The last estimate without its news, which are told once."""
        last = self._last
        if last.sweep is not None or last.verdict is not None:
            self._last = replace(
                last, sweep=None, match=None, nis=None, verdict=None, consistency=None
            )
        return self._last
