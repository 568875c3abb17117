"""Relocalisation: when to search for the robot, where, and what to conclude from the places found."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from localization.config import LocalizerConfig
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.monitoring.health import horizontal_sigma
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.hint_search import HintSearch, SearchResult, SearchState
from localization.relocalization.hypotheses import Hypotheses
from localization.relocalization.search_window import Window
from localization.relocalization.verification import same_place
from localization.types import Hint, HintVerdict, Mounts, Pose, Sweep, Verdict

_HORIZONTAL = 0.9
"""A scanner whose z axis is this near to the robot's (cosine) counts as horizontal."""
_DEFAULT_HEIGHT = 0.3
"""Height of the floor plan for a robot without a horizontal scanner [m]."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A pose at which the search found the robot, as of now."""

    map_from_base: Pose
    """The pose."""
    reason: str
    """Why it is believed."""


@dataclass(frozen=True, slots=True, eq=False)
class RelocalizerState:
    """What is being searched for at one moment; a value."""

    search: SearchState = field(default_factory=SearchState)
    """The search under way."""
    hypotheses: Hypotheses = field(default_factory=Hypotheses)
    """Places between which it is not decided yet."""
    checking: bool = False
    """Whether the pose stands, but other places may explain what is seen."""
    map_requested: bool = False
    """Whether the whole map is to be searched with the next sweep."""
    paused: bool = False
    """Whether a lost robot is left alone until it is placed, or a search is requested."""
    window_due: int = 0
    """Earliest stamp of the next search around a lost estimate [ns]."""
    map_due: int = 0
    """Earliest stamp of the next search of the whole map [ns]."""

    def with_map_requested(self) -> RelocalizerState:
        """Return the state with a search of the whole map due at the next sweep."""
        return replace(
            self, map_requested=True, checking=True, paused=False, hypotheses=Hypotheses()
        )

    def with_pause(self) -> RelocalizerState:
        """Return the state that searches no more until the robot is placed, or a search is requested."""
        return replace(
            self, map_requested=False, checking=False, paused=True, hypotheses=Hypotheses()
        )


class Relocalizer:
    """Steps of the search for the robot; what is being searched for is in ``RelocalizerState``."""

    def __init__(
        self, world: PreparedMap, mounts: Mounts, config: LocalizerConfig, *, search_when_lost: bool
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            mounts: ``base_from_scanner`` by the scanner's frame.
            config: all settings.
            search_when_lost: whether to search without a hint when the robot is lost.
        """
        self._search_when_lost, self._period = search_when_lost, config.lost_search_period
        self._world, self._config, self._hypotheses = world, config.search, config.hypotheses
        horizontal = [p.position[2] for p in mounts.values() if p.rotation[2, 2] > _HORIZONTAL]
        height = float(horizontal[0]) if horizontal else _DEFAULT_HEIGHT
        c = config.search
        plan = FloorPlan(world, height, cell=c.cell, sigma=c.field_sigma)
        same = config.late_readings.same
        self._search = HintSearch(world, plan, c, config.map_search, same=same)

    def receive(
        self, state: RelocalizerState, hint: Hint, now: int, odom_then: Pose
    ) -> tuple[RelocalizerState, tuple[HintVerdict, ...]]:
        """Accept a hint.

        Args:
            state: the search so far.
            hint: where the operator believes the robot to be.
            now: stamp of an answer that is given at once [ns].
            odom_then: ``odom_from_base`` at the hint's stamp.

        Returns:
            The search with the hint, and the answers.
        """
        search, answers = self._search.receive(state.search, hint, now, odom_then)
        return replace(state, search=search), answers

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
        search = self._search.begin(state.search, sweep, odom, level)
        map_requested, window_due = state.map_requested, state.window_due
        undecided = bool(state.hypotheses.places)
        if map_requested and now >= state.map_due and not search.busy and not undecided:
            map_requested = False
            search = self._search.search_window(search, None, sweep, odom, level)
        lost = current.placed and current.lost
        paused = state.paused and (lost or not current.placed)
        if self._search_when_lost and lost and not paused and not undecided and now >= window_due:
            window_due = now + self._period
            search = self._search.search_window(search, _around(current), sweep, odom, level)
        return replace(
            state, search=search, map_requested=map_requested, paused=paused, window_due=window_due
        )

    def advance(
        self, state: RelocalizerState, now: int, odom: Pose, current: CurrentPose
    ) -> tuple[RelocalizerState, Placement | None, tuple[HintVerdict, ...]]:
        """Compute one tick's share of the search under way.

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
        search, result = self._search.advance(state.search, odom, compared)
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
        if result.verdict is Verdict.ACCEPTED and not result.whole_map:
            # The place near where the robot was lost may not be the only one that explains the sweep.
            state = _found(state, unsure=result.hint is None)
            placement = Placement(result.candidates[0].map_from_base, result.reason)
        elif result.whole_map or (result.verdict is Verdict.AMBIGUOUS and unsure):
            places = Hypotheses.of(result.candidates, odom, self._hypotheses)
            state = replace(state, hypotheses=places)
            if result.whole_map and not result.candidates:
                # Nothing to lay over the map, as in the open or behind a crowd: search again farther on.
                state = replace(state, map_requested=True, map_due=now + self._period)
        elif result.hint is None:
            # Not near where it was lost: it may be anywhere.
            state = replace(state, map_requested=True)
        if result.hint is None:
            return state, placement, ()
        answer = HintVerdict(now, result.hint, result.verdict, result.reason, result.candidates)
        return state, placement, (answer,)

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
        dropped = replace(state, hypotheses=Hypotheses())
        if current.placed and not current.lost and not state.checking:
            return dropped, None
        left, place = state.hypotheses.compared(
            sweep, odom, self._world, self._config, self._hypotheses
        )
        if place is not None:
            if current.placed and same_place(place.map_from_base, current.map_from_base):
                return replace(dropped, checking=False), None
            reason = f"explains {place.score:.0%} of the sweeps on the way here"
            return _found(state, unsure=False), Placement(place.map_from_base, reason)
        if left.exhausted(self._hypotheses):
            return replace(dropped, map_requested=True), None
        return replace(state, hypotheses=left), None


def _found(state: RelocalizerState, *, unsure: bool) -> RelocalizerState:
    """Return the state after the robot was found, perhaps not at the only place that explains the sweep."""
    return replace(
        state, hypotheses=Hypotheses(), map_requested=unsure, checking=unsure, paused=False
    )


def _around(current: CurrentPose) -> Window:
    """Return the window in which to search for a robot that was lost a moment ago."""
    p, covariance = current.map_from_base, current.covariance
    half = float(np.clip(3.0 * horizontal_sigma(covariance), 1.0, 3.0))
    half_yaw = float(np.clip(3.0 * np.sqrt(covariance[5, 5]), np.deg2rad(20.0), np.pi))
    return Window(float(p.position[0]), float(p.position[1]), p.yaw, half, half_yaw)
