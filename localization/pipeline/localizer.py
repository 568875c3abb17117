"""Localizer: readings in, estimates out.

A reading is validated, put in order, and processed by ``step``, which is the algorithm. Time is that of the
readings; the same readings give the same bits.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

from localization.config import LocalizerConfig as LocalizerConfig
from localization.filter.covariance import with_map_error
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import MatchSweep
from localization.monitoring.extrinsics_monitor import ExtrinsicsMonitor
from localization.monitoring.silence_detection import silent_sources
from localization.monitoring.status import status_of
from localization.motion.arrival_order import ArrivalOrder
from localization.pipeline.event_queue import EventQueue
from localization.pipeline.events import SweepProcessed
from localization.pipeline.replay_buffer import ReplayBuffer
from localization.pipeline.resources import Resources, Stage as Stage
from localization.pipeline.state import State
from localization.pipeline.step import Command, Input, LeftOut, step
from localization.pipeline.validation import ReadingValidator
from localization.relocalization.preview import PreviewError, explained_share
from localization.relocalization.verification import explain
from localization.types import (
    SECOND,
    Estimate,
    Health,
    Hint,
    Mounts,
    Odometry,
    PointScan,
    Pose,
    Preview,
    Reading,
    Scan,
)


class Localizer:
    """Estimates where the robot is. Feed it every reading in the order of arrival."""

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
            matcher: registers sweeps instead of the one that ``config.matcher`` names.
        """
        self.config = config
        self._resources = Resources(world, mounts, config, stage=stage, matcher=matcher)
        self._state = State.initial(mounts, config)
        self._validator = ReadingValidator(
            mounts, config.sensors.leader, config.late_readings.horizon
        )
        late, poses = config.late_readings, Odometry in config.sensors.leader
        self._order = ArrivalOrder(late.stamp_error if poses and late.horizon else 0)
        self._buffer: ReplayBuffer[State, Input] = ReplayBuffer(
            config.late_readings, config.sensors
        )
        self._events = EventQueue()
        self._extrinsics = ExtrinsicsMonitor(
            self._resources.world, mounts, config.extrinsics_monitor, config.belief
        )
        self._sweep: SweepProcessed | None = None
        """The newest sweep."""
        self._present: tuple[SweepProcessed, Pose, float] | None = None
        """The sweep that was scored last for a preview, the estimate then, and the share that it explains."""
        self._same = config.late_readings.same
        self._last = self._estimate()

    def add(self, reading: Reading) -> Estimate:
        """Process one reading and return the estimate as it now stands.

        An invalid reading changes nothing; the estimate's reasons then say what was refused. Time advances
        with the inertial readings, or with their substitute; the others take effect with the one that covers
        them. A late reading takes effect at its own time: the readings since then are replayed, and a sweep
        among them is reported with the next reading that advances time.
        """
        estimate = self._last
        for due in self._order.arranged(reading):
            estimate = self._add(due)
        return estimate

    def _add(self, reading: Reading) -> Estimate:
        """Process a reading at its place."""
        if self._validator.repeats(reading):
            return self._last
        refusal = self._validator.refusal(reading, self._state.stamp)
        if refusal is not None:
            self._events.refuse(refusal)
            return replace(self._last, reasons=(refusal, *self._last.reasons))
        if isinstance(reading, Hint):
            self._events.expect(reading)
        if self._buffer.is_late(reading):
            self._state, items = self._buffer.rewind(reading)
            for item in items:
                self._take(item)
            return self._estimate(late=True)
        self._take(reading)
        advanced = isinstance(reading, self.config.sensors.leader)
        return self._estimate() if advanced else self._last

    def leave_out(self, scan: Scan | PointScan) -> None:
        """Note a scan that came, but is not processed, since the localiser could not keep up with its robot."""
        self._take(LeftOut(scan))

    def relocalize(self) -> None:
        """Begin a search of the whole map with the next sweep, as for a robot that was carried away.

        The places found are disambiguated by driving on; until that is decided, the estimate stays as it is.
        A robot without a pose, or one that is lost, searches by itself; such a search gives way to this one.
        """
        self._take(Command.SEARCH_MAP)

    @property
    def searching(self) -> bool:
        """Whether a search that was asked for, also by a hint, is under way or begins with the next sweep."""
        return self._state.search.requested

    @property
    def undoable(self) -> bool:
        """Whether the last placement can still be undone."""
        return self._state.replaced is not None

    def undo(self) -> Estimate:
        """Undo the last accepted hint, or the last placement by a search, as if it had not happened.

        The estimate is then what it was, carried on by wheels, gyro and KISS-ICP's motion, with the
        uncertainty that this adds; from the next sweep on it is corrected by the map again. A robot that was
        lost before is lost again, and is not searched for until a hint or ``relocalize`` requests it.

        Returns:
            The estimate as it now stands; its reasons say what was undone, or that nothing was.
        """
        if not self.undoable:
            why = f"nothing to undo from the last {self.config.undo_memory / SECOND:.0f} s"
            return replace(self._last, reasons=(why, *self._last.reasons))
        self._take(Command.UNDO)
        return self._estimate(late=True)

    def preview(self, map_from_base: Pose) -> Preview:
        """Return what the last sweep says of a pose at which the robot may be now; changes nothing.

        Args:
            map_from_base: The proposed pose; only its position and heading count.

        Raises:
            PreviewError: If there is no sweep yet, or the pose is outside the map.
        """
        last, state, world = self._sweep, self._state, self._resources.world
        if last is None:
            raise PreviewError("no sweep yet: no scanner has delivered a whole scan")
        back = state.odom_from_base.inverse() @ last.odom_from_base
        current, config = state.filter.pose, self.config.search
        then, registration = map_from_base @ back, self.config.registration
        explained = explained_share(then, last.sweep, world, current, config, registration)
        present = self._present_share(last, current @ back) if state.placed else None
        return Preview(last.sweep.stamp, explained, present)

    def _present_share(self, last: SweepProcessed, map_from_base: Pose) -> float:
        """Return the share of a sweep that the estimate explains; it is the same for all previews of a sweep."""
        known = self._present
        if known is None or known[0] is not last or not self._same(known[1], map_from_base):
            world, registration = self._resources.world, self.config.registration
            share = explain(last.sweep, world, map_from_base, registration).score
            known = self._present = (last, map_from_base, share)
        return known[2]

    @property
    def refused(self) -> int:
        """Number of readings that were rejected as invalid."""
        return self._validator.refused

    def _take(self, item: Input) -> None:
        """Make the step that an input causes."""
        self._buffer.append(item, self._state)
        self._state, events = step(self._state, item, self._resources)
        for event in events:
            self._events.add(event)
            if isinstance(event, SweepProcessed):
                self._sweep = event
                with self._resources.stage("mounts"):
                    self._extrinsics.take(
                        event.scans,
                        event.track,
                        event.sweep.stamp,
                        event.map_from_base,
                        event.odom_from_base,
                        trusted=event.trusted,
                    )

    def _estimate(self, *, late: bool = False) -> Estimate:
        """Put the estimate together; sweeps and answers wait for the next one if a reading came late."""
        state, sweep = self._state, None if late else self._events.sweep
        odom = state.odom_from_base
        health, reasons = self._status()
        estimate = Estimate(
            stamp=state.stamp,
            map_from_base=state.filter.pose if state.placed else None,
            odom_from_base=odom,
            covariance=self._covariance(state),
            twist=state.filter.twist,
            health=health,
            reasons=(*self._events.reasons, *reasons),
            match=sweep.match if sweep else None,
            sweep=sweep.sweep_at(odom, state.stamp) if sweep else None,
            verdict=None if late else self._events.next_answer(),
            nis=sweep.nis if sweep else None,
            hypotheses=state.search.hypotheses.candidates(odom),
            consistency=sweep.consistency if sweep else None,
        )
        self._last = estimate
        if not late:
            self._events.clear()
        if sweep is not None or estimate.verdict is not None:
            self._last = replace(
                estimate, sweep=None, match=None, nis=None, verdict=None, consistency=None
            )
        return estimate

    def _covariance(self, state: State) -> FloatArray:
        """Return the covariance of the estimate: the filter's, and what the map says of its own error.

        The map's error is the same at each visit of a place. In the filter it would be taken for one that more
        sweeps reduce, or would loosen the hold of the sweeps; so it is added to what is reported only.
        """
        cloud, own = self._resources.world.cloud, state.filter.covariance
        if not state.placed or not (cloud.position_noise or cloud.heading_noise):
            return own
        rotation = state.filter.pose.rotation
        return with_map_error(own, rotation, cloud.position_noise, cloud.heading_noise)

    def _status(self) -> tuple[Health, tuple[str, ...]]:
        """Return the state of the estimate, and why."""
        state, config, mounts = self._state, self.config, self._resources.mounts
        sources = (*sorted(mounts), *config.sensors.expected)
        silent = silent_sources(
            state.received,
            sources,
            state.stamp,
            state.listening.total,
            config.health.silence,
        )
        return status_of(
            state.health,
            placed=state.placed,
            slipping=state.wheels.shows,
            silent=silent,
            no_scanner=mounts.keys() <= set(silent),
            left_out=state.left_out if state.blind(config.health.silence) else 0,
            mounts=self._extrinsics.doubts,
            searching=state.search.activity(state.stamp, config.search_schedule),
            outlook=state.search.outlook(config.search_schedule),
            checking=state.search.checking,
            candidates=state.search.hypotheses.candidates(state.odom_from_base),
        )
