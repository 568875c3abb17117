"""Search for the pose to which a hint points: a window is opened, searched, verified, and the hint is answered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.monitoring.belief import Belief, probabilities
from localization.relocalization.branch_and_bound import MapSearchConfig, Pyramid, search_map
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import Window, window_of
from localization.relocalization.search_work import ResumableSearch
from localization.relocalization.verification import (
    SETTLING_REACH,
    SETTLING_SIGMA,
    Weighing,
    outside_map,
    same_place,
    settled,
    settled_estimate,
    standing,
    unseen_within,
)
from localization.types import SECOND, Candidate, Hint, HintVerdict, Pose, Sweep, Verdict

TICK = SECOND // 50
"""Time in which a search may do ``MapSearchConfig.work_per_tick`` [ns]."""
_REMEMBERED = 4
"""Number of searches whose work is kept for when readings are replayed."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchTask:
    """A search under way."""

    hint: Hint | None
    """The hint that is searched for; None if the whole map is searched."""
    window: Window | None
    """Where to search for a hint."""
    sweep: Sweep
    """The sweep to be explained."""
    odom_from_base: Pose
    """Pose at the sweep's stamp."""
    level: Pose
    """A pose whose height, roll and pitch the robot has."""
    work: ResumableSearch
    """The search itself."""

    def like(self, other: SearchTask, same: Callable[[Pose, Pose], bool]) -> bool:
        """Return whether another task would find the same: same sweep, and windows that hardly differ."""
        return (
            self.hint is other.hint
            and _alike(self.window, other.window, same)
            and np.array_equal(self.sweep.points, other.sweep.points)
            and same(self.level, other.level)
        )


@dataclass(frozen=True, slots=True, eq=False)
class SearchState:
    """The search at one moment; a value."""

    waiting: tuple[Hint, Pose] | None = None
    """A hint that waits for the next sweep, and ``odom_from_base`` at its stamp."""
    task: SearchTask | None = None
    """The search under way."""
    granted: int = 0
    """Amount of work that it may have done so far [points]."""
    stamp: int = 0
    """Time at which it was granted the last of it, or began [ns]."""

    @property
    def busy(self) -> bool:
        """Whether a search is under way or about to begin."""
        return self.task is not None or self.waiting is not None

    @property
    def self_begun(self) -> bool:
        """Whether the search under way is one without a hint."""
        return self.task is not None and self.task.hint is None

    def of_hint(self) -> SearchState:
        """Return the state without a search that no hint began."""
        return SearchState(self.waiting) if self.self_begun else self


@dataclass(frozen=True, slots=True, eq=False)
class SearchResult:
    """The result of a search."""

    candidates: tuple[Candidate, ...]
    """The places found, as of now by odometry, best first."""
    hint: Hint | None = None
    """The hint that was searched for; None if the whole map was searched, of whose places driving decides."""
    verdict: Verdict | None = None
    """What the search says of the hint."""
    reason: str = ""
    """One sentence for the operator."""
    unseen: FloatArray | None = None
    """(6, 6) covariance of what the sweep leaves open within the window; None if it shows the whole pose."""


class HintSearch:
    """Steps of the search; what is being searched for is in ``SearchState``.

    It keeps the floor plan's pyramid and the work of the last searches: both save time and change no result.
    """

    def __init__(
        self,
        world: PreparedMap,
        plan: FloorPlan,
        config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
        map_config: MapSearchConfig = MapSearchConfig(),  # noqa: B008  (frozen)
        registration: RegistrationConfig = RegistrationConfig(),  # noqa: B008  (frozen)
        *,
        weighing: Weighing,
        same: Callable[[Pose, Pose], bool] = lambda a, b: a is b,
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            plan: its floor plan at the horizontal scanner's height.
            config: how a window is searched, and what counts as found.
            map_config: how the whole map is searched.
            registration: how places are registered.
            weighing: what weighs places.
            same: whether two poses are so near to each other that a search from one serves for the other.
        """
        self.config, self._registration = config, registration
        self._weighing, self._same = weighing, same
        self._world, self._map_config = world, map_config
        self._pyramid = Pyramid(plan, map_config)
        self._begun: deque[SearchTask] = deque(maxlen=_REMEMBERED)

    def receive(
        self, state: SearchState, hint: Hint, now: int, odom_from_base: Pose
    ) -> tuple[SearchState, tuple[HintVerdict, ...]]:
        """Accept a hint; one outside the map is answered at once, and it replaces an unfinished one.

        Args:
            state: the search so far.
            hint: where the operator believes the robot to be.
            now: stamp of an answer that is given at once [ns].
            odom_from_base: at the hint's stamp.

        Returns:
            The search with the hint, and the answers.
        """
        x, y = float(hint.map_from_base.position[0]), float(hint.map_from_base.position[1])
        reach = window_of(hint.map_from_base, hint.covariance, self.config).half_width
        if (reason := outside_map(self._world, x, y, margin=reach)) is not None:
            return state, (HintVerdict(now, hint, Verdict.REJECTED, reason),)
        old = state.task.hint if state.task else None
        if state.waiting is not None:
            old = state.waiting[0]
        answers: tuple[HintVerdict, ...] = ()
        if old is not None:
            answers = (HintVerdict(now, old, Verdict.REJECTED, "a newer hint took its place"),)
        return SearchState(waiting=(hint, odom_from_base)), answers

    def begin(
        self, state: SearchState, sweep: Sweep, odom_from_base: Pose, level: Pose
    ) -> SearchState:
        """Begin to search for the hint that waits, if one does.

        Args:
            state: the search so far.
            sweep: the newest one.
            odom_from_base: at its stamp.
            level: a pose whose height, roll and pitch the robot has.
        """
        if state.waiting is None:
            return state
        hint, odom_then = state.waiting
        moved = odom_then.inverse() @ odom_from_base
        window = window_of(hint.map_from_base @ moved, hint.covariance, self.config)
        return self._begin(hint, window, sweep, odom_from_base, level)

    def search_map(
        self, state: SearchState, sweep: Sweep, odom_from_base: Pose, level: Pose
    ) -> SearchState:
        """Search the whole map, unless a search is under way."""
        return state if state.busy else self._begin(None, None, sweep, odom_from_base, level)

    def _begin(
        self,
        hint: Hint | None,
        window: Window | None,
        sweep: Sweep,
        odom_from_base: Pose,
        level: Pose,
    ) -> SearchState:
        work = search_map(
            sweep,
            self._world,
            self._pyramid,
            level,
            self.config,
            window,
            self._registration,
            weighing=self._weighing,
        )
        task = SearchTask(hint, window, sweep, odom_from_base, level, ResumableSearch(work))
        # When readings are replayed, the search has been computed before.
        same = next((t for t in self._begun if t.like(task, self._same)), None)
        task = task if same is None else replace(task, work=same.work)
        self._begun.append(task)
        return SearchState(task=task, stamp=sweep.stamp)

    def advance(
        self, state: SearchState, odom_from_base: Pose, current: Pose | None, *, now: int
    ) -> tuple[SearchState, SearchResult | None]:
        """Do as much of the search as the time since the last reading allows.

        Args:
            state: the search so far.
            odom_from_base: now.
            current: the present estimate if it deserves a comparison, else None.
            now: stamp of the reading that advanced time [ns].

        Returns:
            The search after it, and its result if it has ended.
        """
        task = state.task
        if task is None:
            return state, None
        limits = self._map_config
        share = max(now - state.stamp, 0) * limits.work_per_tick // TICK
        granted = state.granted + min(share, limits.max_work)
        candidates = task.work.after(granted)
        if candidates is None:
            return SearchState(state.waiting, task, granted, max(now, state.stamp)), None
        moved = task.odom_from_base.inverse() @ odom_from_base
        if task.window is None:
            return SearchState(state.waiting), SearchResult(_moved(candidates, moved))
        window, claim = task.window, self._claimed(task)
        if claim is not None and self._as_good(claim, candidates):
            window, candidates = _claimed_window(task, self.config) or window, (claim,)
        verdict, reason = self._judged(task, window, candidates, current, moved)
        unseen = None
        if verdict is Verdict.ACCEPTED:
            found = candidates[0].map_from_base
            _, match = settled(task.sweep, self._world, found, self._registration)
            unseen = unseen_within(match, window)
        places = _moved(candidates, moved)
        return SearchState(state.waiting), SearchResult(places, task.hint, verdict, reason, unseen)

    def _claimed(self, task: SearchTask) -> Candidate | None:
        """Return the very place of a hint that is surer than any search is; None of others.

        The window is wider than that hint, since people are wrong by more than they say. Other places in it, as
        along a corridor or behind glass, would hide a place that is known.
        """
        window = _claimed_window(task, self.config)
        if window is None:
            return None
        at = standing(self._world, window.x, window.y, window.yaw, task.level)
        seen, match = settled(task.sweep, self._world, at, self._registration)
        return self._weighing.of(task.sweep, seen, match)[0]

    def _as_good(self, claimed: Candidate, candidates: tuple[Candidate, ...]) -> bool:
        """Return whether a place explains a sweep, and no other surely does so better."""
        best = max((c.evidence for c in candidates), default=0.0)
        return self._fits([claimed]) and not self._sure(best - claimed.evidence)

    def _fits(self, places: Sequence[Candidate]) -> bool:
        """Return whether one of some places is more probable than none, or the best, near a hint, mostly fits.

        Behind much that has changed, as glass that the map has as walls, sweeps speak against the right place too.
        """
        probable = sum(probabilities([place.evidence for place in places])) >= 0.5
        return probable or any(place.score > self._weighing.belief.mostly for place in places[:1])

    def _sure(self, odds: float) -> bool:
        return Belief(odds).sure(self._weighing.belief)

    def _judged(
        self,
        task: SearchTask,
        window: Window,
        candidates: tuple[Candidate, ...],
        current: Pose | None,
        moved: Pose,
    ) -> tuple[Verdict, str]:
        c = self.config
        if not self._fits(candidates):
            return Verdict.REJECTED, _nothing_there(window, candidates)
        best, others = candidates[0], list(candidates[1:])
        if current is not None:
            then = current @ moved.inverse()
            seen, match = settled_estimate(
                task.sweep, self._world, then, self._registration, partial(_settled_there, then)
            )
            own, _ = self._weighing.of(task.sweep, seen, match)
            there = same_place(own.map_from_base, best.map_from_base, c)
            if best.evidence <= own.evidence or (
                there and not self._sure(best.evidence - own.evidence)
            ):
                return Verdict.KEPT, (
                    f"the estimate is the best pose there ({own.score:.0%} explained)"
                    if there
                    else f"the estimate explains {own.score:.0%} of the sweep, the best pose near the hint "
                    f"{best.score:.0%}"
                )
            others.append(own)
        if others and not self._sure(best.evidence - _together(others)):
            other = max(others, key=lambda one: one.evidence)
            apart = float(
                np.hypot(*(other.map_from_base.position - best.map_from_base.position)[:2])
            )
            near = same_place(other.map_from_base, best.map_from_base, c)
            return Verdict.AMBIGUOUS, (
                f"two places {apart:.1f} m apart explain {best.score:.0%} and {other.score:.0%} of the sweep; "
                + ("drive on" if near else "drive on, or give a narrower hint")
            )
        return Verdict.ACCEPTED, f"explains {best.score:.0%} of the sweep"


def _together(places: Sequence[Candidate]) -> float:
    """Return the logarithm of the odds that one of several places is right."""
    return float(np.logaddexp.reduce([place.evidence for place in places]))


def _moved(candidates: Sequence[Candidate], moved: Pose) -> tuple[Candidate, ...]:
    """Return places after the robot has moved."""
    return tuple(replace(c, map_from_base=c.map_from_base @ moved) for c in candidates)


def _nothing_there(window: Window, candidates: Sequence[Candidate]) -> str:
    """Return that no place was found, in words for the operator."""
    turn = np.rad2deg(window.half_yaw)
    where = f"within {window.half_width:.1f} m and {turn:.0f} degrees"
    reached = f"{candidates[0].score:.0%}" if candidates else "nothing"
    return f"no pose {where} fits the sweep (the best explains {reached})"


def _settled_there(claimed: Pose, settled_at: Pose) -> bool:
    """Return whether a pose settled where it claims to be."""
    return bool(np.hypot(*(settled_at.position - claimed.position)[:2]) < SETTLING_REACH)


def _claimed_window(task: SearchTask, config: SearchConfig) -> Window | None:
    """Return what a hint says itself where the window that is searched is wider; else None."""
    if task.hint is None or task.window is None or not task.hint.covariance.any():
        return None
    sigma = float(np.sqrt(max(task.hint.covariance[0, 0], task.hint.covariance[1, 1])))
    narrow = 3.0 * max(sigma, SETTLING_SIGMA[0])
    return replace(task.window, half_width=narrow) if narrow < config.default_sigma else None


def _alike(a: Window | None, b: Window | None, same: Callable[[Pose, Pose], bool]) -> bool:
    """Return whether two windows hardly differ."""
    if a is None or b is None:
        return a is b
    middles = same(Pose.planar(a.x, a.y, a.yaw), Pose.planar(b.x, b.y, b.yaw))
    return middles and (a.half_width, a.half_yaw) == (b.half_width, b.half_yaw)
