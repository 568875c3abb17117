"""Relocalisation: when to search for the robot, where, and what to conclude from the places found."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from localization.filter.covariance import horizontal_sigma
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.matching.scan_consistency import BeamClassifier
from localization.monitoring.belief import Belief, BeliefConfig
from localization.motion.late_readings import LateReadingsConfig
from localization.relocalization.branch_and_bound import FEWEST_POINTS, MapSearchConfig
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.hint_search import HintSearch, SearchResult, SearchState
from localization.relocalization.hypotheses import Hypotheses
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_schedule import (
    SearchCause,
    SearchSchedule,
    SearchScheduleConfig,
)
from localization.relocalization.search_window import Window
from localization.relocalization.verification import Weighing, same_place
from localization.types import SECOND, Hint, HintVerdict, Mounts, Pose, Sweep, Verdict

_DEFAULT_HEIGHT = 0.3
"""Height of the floor plan for a robot without a horizontal scanner [m]."""

ALMOST_ALL = 0.9
"""A place near a hint that explains a smaller share of the sweep is suspect until the whole map has been searched:
another room, much like the one that an operator mistook for it, may explain more."""


class RelocalizerSettings(Protocol):
    """What ``LocalizerConfig`` says of the search; the names are explained there."""

    @property
    def search(self) -> SearchConfig:
        """How places are searched."""

    @property
    def map_search(self) -> MapSearchConfig:
        """How the whole map is searched."""

    @property
    def belief(self) -> BeliefConfig:
        """What decides between places."""

    @property
    def search_schedule(self) -> SearchScheduleConfig:
        """When a search begins."""

    @property
    def registration(self) -> RegistrationConfig:
        """How sweeps are registered."""

    @property
    def late_readings(self) -> LateReadingsConfig:
        """How readings are replayed."""


@dataclass(frozen=True, slots=True, eq=False)
class CurrentPose:
    """The estimate as the search needs it."""

    map_from_base: Pose
    """The pose; only height and tilt are meaningful unless ``placed``."""
    covariance: FloatArray
    """(6, 6) covariance of it."""
    placed: bool
    """Whether it is a pose in the map."""
    lost: bool
    """Whether it must not be relied on."""
    doubtful: bool
    """Whether the last sweep left doubt."""
    odds: float = 0.0
    """Logarithm of the odds that the pose is right."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A pose at which the search found the robot, as of now."""

    map_from_base: Pose
    """The pose."""
    reason: str
    """Why it is believed."""
    unseen: FloatArray | None = None
    """(6, 6) covariance of what the sweep leaves open, as in ``Estimate``; None if it shows the whole pose."""


@dataclass(frozen=True, slots=True, eq=False)
class RelocalizerState:
    """What is being searched for at one moment; a value."""

    search: SearchState = field(default_factory=SearchState)
    """The search under way."""
    hypotheses: Hypotheses = field(default_factory=Hypotheses)
    """Places between which it is not decided yet."""
    schedule: SearchSchedule = field(default_factory=SearchSchedule)
    """The search of the whole map that is due, and the last one."""
    cause: SearchCause = SearchCause.REQUESTED
    """Why the whole map was searched last."""
    checking: bool = False
    """Whether the pose stands, but other places may explain what is seen."""
    paused: bool = False
    """Whether a robot without a pose is left alone until it is placed, or a search is requested."""

    def with_request(self) -> RelocalizerState:
        """Return the state with a search of the whole map due at the next sweep, as an operator requested.

        A search that the robot began by itself gives way to it.
        """
        return replace(
            self,
            search=self.search.of_hint(),
            schedule=self.schedule.with_cause(SearchCause.REQUESTED),
            checking=True,
            paused=False,
            hypotheses=Hypotheses(),
        )

    def with_doubt(self) -> RelocalizerState:
        """Return the state with a search of the whole map due because the pose needs a check."""
        return replace(self, schedule=self.schedule.with_cause(SearchCause.DOUBT))

    def carried_off(self) -> RelocalizerState:
        """Return the state after all that is seen changed at once: odometry does not lead from its places to here."""
        if not self.hypotheses.places and not self.search.self_begun:
            return self
        return replace(
            self,
            search=self.search.of_hint(),
            hypotheses=Hypotheses(),
            schedule=self.schedule.at_once(self.cause),
        )

    def with_pause(self) -> RelocalizerState:
        """Return the state that searches no more until the robot is placed, or a search is requested."""
        return replace(
            self,
            search=self.search.of_hint(),
            schedule=self.schedule.without_cause(),
            checking=False,
            paused=True,
            hypotheses=Hypotheses(),
        )

    @property
    def requested(self) -> bool:
        """Whether a search that was asked for, also by a hint, is under way or begins with the next sweep."""
        if self.schedule.cause is SearchCause.REQUESTED:
            return True
        task = self.search.task
        if task is None or task.hint is not None:
            return self.search.busy
        return self.cause is SearchCause.REQUESTED

    def activity(self, now: int, config: SearchScheduleConfig) -> str:
        """Return what is being searched for, in words for the operator; empty if nothing is.

        Args:
            now: stamp of the last reading that advanced time [ns].
            config: when a search that is due begins.
        """
        task, cause = self.search.task, self.schedule.cause
        if self.search.waiting is not None or (task is not None and task.hint is not None):
            return "searching around the hint"
        if task is not None:
            return f"searching the whole map ({self.cause})"
        due = cause is not None and not self.hypotheses.places
        return (
            f"searching the whole map ({cause})" if due and self.schedule.ready(now, config) else ""
        )

    def outlook(self, config: SearchScheduleConfig) -> str:
        """Return what becomes of a robot without a pose that nobody searches for, in words for the operator."""
        if self.paused:
            return "no pose: give a hint, or request a search of the map"
        if self.schedule.cause is not None and self.schedule.begun is not None:
            return (
                "no place in the map explains what is seen: give a hint, or drive on; the next search begins "
                f"after {config.distance:g} m or {config.period / SECOND:g} s"
            )
        return f"no pose yet: give a hint; without one the whole map is searched after {config.period / SECOND:g} s"


class Relocalizer:
    """Steps of the search for the robot; what is being searched for is in ``RelocalizerState``."""

    def __init__(
        self,
        world: PreparedMap,
        mounts: Mounts,
        config: RelocalizerSettings,
        beams: BeamClassifier,
        *,
        by_itself: bool,
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            mounts: ``base_from_scanner`` by the scanner's frame.
            config: all settings.
            beams: classifies the beams that a place does not explain.
            by_itself: whether a robot that does not know where it is searches without being asked to.
        """
        self._by_itself, self._schedule = by_itself, config.search_schedule
        self._world, self._config = world, config.search
        horizontal = [p.position[2] for p in mounts.values() if p.is_level]
        height = float(horizontal[0]) if horizontal else _DEFAULT_HEIGHT
        c = config.search
        plan = FloorPlan(world, height, cell=c.cell, sigma=c.field_sigma)
        same, self._registration = config.late_readings.same, config.registration
        self._weighing = Weighing(beams, config.belief)
        self._search = HintSearch(
            world,
            plan,
            c,
            config.map_search,
            config.registration,
            weighing=self._weighing,
            same=same,
        )

    def receive(
        self, state: RelocalizerState, hint: Hint, now: int, odom_then: Pose, current: CurrentPose
    ) -> tuple[RelocalizerState, tuple[HintVerdict, ...]]:
        """Accept a hint; a search of the whole map gives way to it.

        Args:
            state: the search so far.
            hint: where the operator believes the robot to be.
            now: stamp of an answer that is given at once [ns].
            odom_then: ``odom_from_base`` at the hint's stamp.
            current: the estimate.

        Returns:
            The search with the hint, and the answers.
        """
        task, schedule = state.search.task, replace(state.schedule, waiting_since=None)
        search, answers = self._search.receive(state.search, hint, now, odom_then)
        if search is state.search:
            state = self._after_rejection(state, current)
            answers = tuple(_with_outlook(answer, state) for answer in answers)
            return state, answers
        if task is not None and task.hint is None:
            schedule = schedule.at_once(state.cause)
        return replace(state, search=search, schedule=schedule), answers

    def begin(
        self, state: RelocalizerState, sweep: Sweep, odom: Pose, current: CurrentPose
    ) -> RelocalizerState:
        """Begin the search that is due, if one is.

        Args:
            state: the search so far.
            sweep: the newest one.
            odom: ``odom_from_base`` at its stamp.
            current: the estimate.
        """
        now, level = sweep.stamp, current.map_from_base
        lost = current.placed and current.lost
        search = self._search.begin(state.search, sweep, odom, level)
        state = replace(
            state,
            search=search,
            schedule=_revised(state.schedule.moved(odom), current),
            paused=state.paused and (lost or not current.placed),
        )
        enough = np.count_nonzero(sweep.horizontal) >= FEWEST_POINTS
        if search.busy or state.hypotheses.places or not enough:
            return state
        schedule = state.schedule
        if self._by_itself and not state.paused:
            if not current.placed:
                schedule = schedule.waited(now, self._schedule)
            elif lost and schedule.cause is None:
                schedule = schedule.with_cause(SearchCause.LOST)
        state = replace(state, schedule=schedule)
        if schedule.cause is None or not schedule.ready(now, self._schedule):
            return state
        return replace(
            state,
            search=self._search.search_map(search, sweep, odom, level),
            schedule=schedule.started(now),
            cause=schedule.cause,
            checking=True,
        )

    def advance(
        self, state: RelocalizerState, now: int, odom: Pose, current: CurrentPose
    ) -> tuple[RelocalizerState, Placement | None, tuple[HintVerdict, ...]]:
        """Do as much of the search under way as the time since the last reading allows.

        Args:
            state: the search so far.
            now: stamp of the tick [ns].
            odom: ``odom_from_base`` now.
            current: the estimate now.

        Returns:
            The search after it, where it found the robot if it did, and the answers to hints.
        """
        if state.search.task is None:
            return state, None, ()
        trusted = current.placed and not current.lost and not current.doubtful
        compared = current.map_from_base if trusted else None
        search, result = self._search.advance(state.search, odom, compared, now=now)
        state = replace(state, search=search)
        return (
            (state, None, ())
            if result is None
            else self._concluded(state, result, now, odom, current)
        )

    def _concluded(
        self,
        state: RelocalizerState,
        result: SearchResult,
        now: int,
        odom: Pose,
        current: CurrentPose,
    ) -> tuple[RelocalizerState, Placement | None, tuple[HintVerdict, ...]]:
        placement = None
        unsure = not current.placed or current.lost
        if result.hint is None or result.verdict is None:
            return self._proposed(state, result, odom, current, unsure=unsure), None, ()
        if result.verdict is Verdict.ACCEPTED:
            state = _found(state)
            best = result.candidates[0]
            placement = Placement(best.map_from_base, result.reason, result.unseen)
            if best.score < ALMOST_ALL and self._by_itself:
                state = _to_check(state)
        elif result.verdict is Verdict.AMBIGUOUS:
            # A pose that stands explains clearly less, or is in doubt: else the hint would have been answered by it.
            present = None if unsure else current.map_from_base
            places = Hypotheses.of(
                result.candidates, odom, self._config, near=True, present=present
            )
            state = replace(state, hypotheses=places, checking=state.checking or not unsure)
        elif result.verdict is Verdict.REJECTED:
            state = self._after_rejection(state, current)
        answer = HintVerdict(now, result.hint, result.verdict, result.reason, result.candidates)
        return state, placement, (_with_outlook(answer, state),)

    def _after_rejection(self, state: RelocalizerState, current: CurrentPose) -> RelocalizerState:
        """Return the state after a rejected hint: a robot that does not know where it is searches by itself."""
        if not self._by_itself or (current.placed and not current.lost) or state.hypotheses.places:
            return state
        schedule = state.schedule.with_cause(SearchCause.REJECTED_HINT)
        return replace(state, schedule=schedule, paused=False)

    def _proposed(
        self,
        state: RelocalizerState,
        result: SearchResult,
        odom: Pose,
        current: CurrentPose,
        *,
        unsure: bool,
    ) -> RelocalizerState:
        """Return the state after a search without a hint: what it found is proposed, and driving decides."""
        # An operator who asks for a search doubts the pose, whatever the sweeps say.
        asked = state.cause is SearchCause.REQUESTED
        most = Belief.of_found(self._weighing.belief).odds
        prior = most if current.lost else min(max(0.0, current.odds), most)
        places = Hypotheses.of(
            result.candidates,
            odom,
            self._config,
            present=None if unsure else current.map_from_base,
            around=_around(current) if current.placed and current.lost else None,
            prior=0.0 if asked else prior,
        )
        if places.places:
            return replace(state, hypotheses=places)
        return self._unsettled(state, unsure=unsure)

    def _unsettled(self, state: RelocalizerState, *, unsure: bool) -> RelocalizerState:
        """Return the state after none of the places found was the right one."""
        state = replace(state, hypotheses=Hypotheses())
        if not unsure:
            # No other place explains what is seen: the pose stands.
            return replace(state, checking=False, schedule=state.schedule.without_cause())
        kept = state.cause in (
            SearchCause.NO_POSE,
            SearchCause.REJECTED_HINT,
            SearchCause.REQUESTED,
        )
        cause = SearchCause.NO_POSE if kept else SearchCause.LOST
        return replace(state, schedule=state.schedule.with_cause(cause))

    def disambiguate(
        self, state: RelocalizerState, sweep: Sweep, odom: Pose, current: CurrentPose
    ) -> tuple[RelocalizerState, Placement | None]:
        """Compare the hypotheses by the newest sweep.

        Args:
            state: the search so far.
            sweep: the newest one.
            odom: ``odom_from_base`` at its stamp.
            current: the estimate.

        Returns:
            The search after it, and the place that is left to believe, if one is.
        """
        if current.placed and not current.lost and not state.checking:
            return replace(state, hypotheses=Hypotheses()), None
        stands = current.placed and not current.lost
        left, place = state.hypotheses.compared(
            sweep,
            odom,
            self._world,
            self._weighing,
            self._config,
            self._registration,
            present=current.map_from_base if stands else None,
        )
        if place is not None:
            same = same_place(place.map_from_base, current.map_from_base, self._config)
            # A pose that sweeps contradict may be decimetres off its own place, farther than its filter lets them move it.
            if stands and same and not current.doubtful:
                return self._unsettled(state, unsure=False), None
            reason = f"explains {place.score:.0%} of the sweeps on the way here"
            placement = Placement(place.map_from_base, reason)
            # Near is not the only place in the map that may explain the sweeps.
            return (_to_check(_found(state)) if left.near else _found(state)), placement
        if left.nowhere(self._weighing.belief):
            return self._unsettled(state, unsure=not stands), None
        return replace(state, hypotheses=left), None


def _revised(schedule: SearchSchedule, current: CurrentPose) -> SearchSchedule:
    """Return the schedule without a cause that no longer holds."""
    if not current.placed:
        return schedule
    schedule = replace(schedule, waiting_since=None)
    doubt = schedule.cause is SearchCause.DOUBT
    if current.lost:
        return schedule.with_cause(SearchCause.LOST) if doubt else schedule
    return (
        schedule if doubt or schedule.cause is SearchCause.REQUESTED else schedule.without_cause()
    )


def _with_outlook(answer: HintVerdict, state: RelocalizerState) -> HintVerdict:
    """Return the answer to a hint, with what the robot does now if that is to search by itself."""
    due = state.schedule.cause is SearchCause.REJECTED_HINT
    if answer.verdict is not Verdict.REJECTED or not due:
        return answer
    return replace(answer, reason=f"{answer.reason}; the whole map is searched")


def _found(state: RelocalizerState) -> RelocalizerState:
    """Return the state after the robot was found."""
    return replace(
        state,
        hypotheses=Hypotheses(),
        schedule=state.schedule.without_cause(),
        checking=False,
        paused=False,
    )


def _to_check(state: RelocalizerState) -> RelocalizerState:
    """Return the state with a search of the whole map due at once, for places that explain more."""
    return replace(state, checking=True, schedule=state.schedule.at_once(SearchCause.DOUBT))


def _around(current: CurrentPose) -> Window:
    """Return the surroundings of a pose that was lost, where the robot is rather than anywhere else."""
    p, covariance = current.map_from_base, current.covariance
    half = float(np.clip(3.0 * horizontal_sigma(covariance), 1.0, 3.0))
    half_yaw = float(np.clip(3.0 * np.sqrt(covariance[5, 5]), np.deg2rad(20.0), np.pi))
    return Window(float(p.position[0]), float(p.position[1]), p.yaw, half, half_yaw)
