"""A desk for hints: each opens a search, is verified against a sweep, and gets an answer."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace

import numpy as np

from localization.maps.prepared_map import PreparedMap
from localization.pipeline.replay_buffer import LateReadingsConfig
from localization.relocalization.branch_and_bound import MapSearchConfig, Pyramid, search_map
from localization.relocalization.window_search import (
    FloorPlan,
    SearchConfig,
    Window,
    distinguishable,
    explain,
    same_place,
    window_of,
)
from localization.types import Candidate, Hint, HintVerdict, Pose, Sweep, Verdict


class Work:
    """The steps of a search, done once however often they are gone through."""

    def __init__(self, steps: Generator[None, None, tuple[Candidate, ...]]) -> None:
        self._steps = steps
        self._done, self._last = 0, 0
        self._found: tuple[Candidate, ...] = ()

    def after(self, steps: int) -> tuple[Candidate, ...] | None:
        """Return what was found after so many steps; None if that is not all of them."""
        while self._done < steps and not self._last:
            self._done += 1
            try:
                next(self._steps)
            except StopIteration as done:
                self._last, self._found = self._done, done.value
        return self._found if self._last and steps >= self._last else None


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """A search under way."""

    hint: Hint | None
    """None when the localiser searches for itself, being lost."""
    window: Window | None
    """None for the whole map."""
    sweep: Sweep
    odom_from_base: Pose
    """At the sweep's stamp."""
    level: Pose
    """Whose height, roll and pitch hold."""
    work: Work

    def like(self, other: Search, same: Callable[[Pose, Pose], bool]) -> bool:
        """Return whether another search looks for the same in the same, for all that matters."""
        return (
            self.hint is other.hint
            and _alike(self.window, other.window, same)
            and np.array_equal(self.sweep.points, other.sweep.points)
            and same(self.level, other.level)
        )


@dataclass(frozen=True, slots=True, eq=False)
class DeskSnapshot:
    """What is being looked for at one moment."""

    waiting: tuple[Hint, Pose] | None
    search: Search | None
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a search ended with."""

    verdict: Verdict
    reason: str
    hint: Hint | None
    candidates: tuple[Candidate, ...]
    """Brought forward to now by odometry, best first."""
    everywhere: bool = False
    """Whether the whole map was searched."""


class HintSearch:
    """Owns the search under way and the answers not yet handed out."""

    def __init__(
        self,
        world: PreparedMap,
        plan: FloorPlan,
        config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
        map_config: MapSearchConfig = MapSearchConfig(),  # noqa: B008  (frozen)
        rewind: LateReadingsConfig = LateReadingsConfig(),  # noqa: B008  (frozen)
    ) -> None:
        self.config = config
        self._same = rewind.same
        self._world, self._plan = world, plan
        self._map_config = map_config
        self._pyramid: Pyramid | None = None
        self._waiting: tuple[Hint, Pose] | None = None
        self._search: Search | None = None
        self._steps = 0
        self._begun: deque[Search] = deque(maxlen=4)
        self._answers: deque[HintVerdict] = deque()
        self._told: deque[HintVerdict] = deque(maxlen=16)

    @property
    def busy(self) -> bool:
        """Whether a search is under way or about to begin."""
        return self._search is not None or self._waiting is not None

    def expect(self, hint: Hint) -> None:
        """Make ready to answer a hint that just came, though it may have been given before."""
        told = (t for t in self._told if t.hint is not hint)
        self._told = deque(told, maxlen=self._told.maxlen)

    def receive(self, hint: Hint, now: int, odom_from_base: Pose) -> None:
        """Take a hint; one outside the map is answered at once, an unfinished one gives way.

        Args:
            hint: what the operator believes.
            now: stamp of the answer, should there be one at once [ns].
            odom_from_base: at the hint's stamp.
        """
        x, y = float(hint.map_from_base.position[0]), float(hint.map_from_base.position[1])
        reach = window_of(hint.map_from_base, hint.covariance, self.config).half_width
        if not self._world.contains(x, y, margin=reach):
            low, high = self._world.cloud.bounds
            reason = (
                f"({x:.1f}, {y:.1f}) lies outside the map, which spans x {low[0]:.1f} to {high[0]:.1f} "
                f"and y {low[1]:.1f} to {high[1]:.1f} m"
            )
            self.answer(hint, now, Verdict.REJECTED, reason)
            return
        old = self._search.hint if self._search else None
        if self._waiting is not None:
            old = self._waiting[0]
        if old is not None:
            self.answer(old, now, Verdict.REJECTED, "a newer hint took its place")
        self._waiting, self._search = (hint, odom_from_base), None

    def begin(self, sweep: Sweep, odom_from_base: Pose, level: Pose) -> None:
        """Start searching for the hint that waits, if one does.

        Args:
            sweep: the newest one.
            odom_from_base: at its stamp.
            level: whose height, roll and pitch hold.
        """
        if self._waiting is None:
            return
        (hint, odom_then), self._waiting = self._waiting, None
        moved = odom_then.inverse() @ odom_from_base
        window = window_of(hint.map_from_base @ moved, hint.covariance, self.config)
        self._start(hint, window, sweep, odom_from_base, level)

    def search_around(
        self, window: Window, sweep: Sweep, odom_from_base: Pose, level: Pose
    ) -> None:
        """Search without a hint, unless a search is under way."""
        if not self.busy:
            self._start(None, window, sweep, odom_from_base, level)

    def search_everywhere(self, sweep: Sweep, odom_from_base: Pose, level: Pose) -> None:
        """Search the whole map, unless a search is under way."""
        if not self.busy:
            self._start(None, None, sweep, odom_from_base, level)

    def _start(
        self,
        hint: Hint | None,
        window: Window | None,
        sweep: Sweep,
        odom_from_base: Pose,
        level: Pose,
    ) -> None:
        if self._pyramid is None:
            self._pyramid = Pyramid(self._plan, self._map_config)
        work = search_map(sweep, self._world, self._pyramid, level, self.config, window)
        search = Search(hint, window, sweep, odom_from_base, level, Work(work))
        # Gone through again, as after a reading that came late, it need not be done again.
        same = next((s for s in self._begun if s.like(search, self._same)), None)
        self._search = search if same is None else replace(search, work=same.work)
        self._steps = 0
        self._begun.append(self._search)

    def advance(self, odom_from_base: Pose, current: Pose | None) -> Found | None:
        """Do one tick's share of the search; return what was found when it ends.

        Args:
            odom_from_base: now.
            current: the present estimate if it deserves a comparison, else None.
        """
        if self._search is None:
            return None
        task = self._search
        self._steps += 1
        candidates = task.work.after(self._steps)
        if candidates is None:
            return None
        self._search = None
        moved = task.odom_from_base.inverse() @ odom_from_base
        verdict, reason = self._judge(task, candidates, current, moved)
        brought = tuple(Candidate(c.map_from_base @ moved, c.score) for c in candidates)
        return Found(verdict, reason, task.hint, brought, everywhere=task.window is None)

    def _judge(
        self, task: Search, candidates: tuple[Candidate, ...], current: Pose | None, moved: Pose
    ) -> tuple[Verdict, str]:
        c, window = self.config, task.window
        if not candidates or candidates[0].score < c.min_inlier_ratio:
            reached = f"{candidates[0].score:.0%}" if candidates else "nothing"
            where = "in the whole map"
            if window is not None:
                turn = np.rad2deg(window.half_yaw)
                where = f"within {window.half_width:.1f} m and {turn:.0f} degrees"
            return Verdict.REJECTED, (
                f"no pose {where} explains the sweep (best: {reached}, needed: {c.min_inlier_ratio:.0%})"
            )
        best = candidates[0]
        if current is not None:
            own = explain(task.sweep, self._world, current @ moved.inverse())
            if same_place(own.map_from_base, best.map_from_base, c):
                return (
                    Verdict.KEPT,
                    f"the estimate is the best pose there ({own.score:.0%} explained)",
                )
            if own.score >= best.score - c.least_margin:
                return Verdict.KEPT, (
                    f"the estimate explains {own.score:.0%} of the sweep, the best pose near the hint "
                    f"{best.score:.0%}"
                )
        if len(candidates) > 1 and not distinguishable(best.score, candidates[1].score, c):
            return Verdict.AMBIGUOUS, (
                f"two places explain {best.score:.0%} and {candidates[1].score:.0%} of the sweep; "
                "a narrower hint would tell them apart"
            )
        return Verdict.ACCEPTED, f"explains {best.score:.0%} of the sweep"

    def answer(
        self,
        hint: Hint,
        now: int,
        verdict: Verdict,
        reason: str,
        candidates: tuple[Candidate, ...] = (),
    ) -> None:
        """Put an answer in the tray, unless the hint was answered so before."""
        answer = HintVerdict(now, hint, verdict, reason, candidates)
        if not any(t.hint is hint and t.verdict is verdict for t in self._told):
            self._answers.append(answer)
            self._told.append(answer)

    def next_answer(self) -> HintVerdict | None:
        """Take the oldest answer from the tray."""
        return self._answers.popleft() if self._answers else None

    def snapshot(self) -> DeskSnapshot:
        """Return what is being looked for, for ``restore``; answers are told once and never taken back."""
        return DeskSnapshot(self._waiting, self._search, self._steps)

    def restore(self, snapshot: DeskSnapshot) -> None:
        """Look for what was being looked for at a snapshot."""
        self._waiting, self._search, self._steps = snapshot.waiting, snapshot.search, snapshot.steps


def _alike(a: Window | None, b: Window | None, same: Callable[[Pose, Pose], bool]) -> bool:
    """Return whether two windows are one."""
    if a is None or b is None:
        return a is b
    middles = same(Pose.planar(a.x, a.y, a.yaw), Pose.planar(b.x, b.y, b.yaw))
    return middles and (a.half_width, a.half_yaw) == (b.half_width, b.half_yaw)
