"""Who looks for the robot: searches for hints and after loss, and what comes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from localization.config import LocalizerConfig
from localization.geometry import FloatArray
from localization.maps.prepared_map import PreparedMap
from localization.monitoring.health import horizontal_sigma
from localization.relocalization.hint_search import DeskSnapshot, Found, HintSearch
from localization.relocalization.hypotheses import Hypotheses
from localization.relocalization.window_search import FloorPlan, Window, same_place
from localization.types import Candidate, Hint, HintVerdict, Mounts, Pose, Sweep, Verdict


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """What the estimate is worth to somebody who looks for the robot."""

    pose: Pose
    """``map_from_base``; of height and tilt only, unless ``placed``."""
    covariance: FloatArray
    """(6, 6) of it."""
    placed: bool
    """Whether there is a pose."""
    lost: bool
    """Whether it must not be relied on."""
    doubtful: bool
    """Whether the last sweep left doubt."""


@dataclass(frozen=True, slots=True, eq=False)
class SeekerSnapshot:
    """What is being looked for at one moment."""

    asked: bool
    everywhere: bool
    resting: bool
    due: int
    everywhere_due: int
    desk: DeskSnapshot
    hypotheses: Mapping[str, object]


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where the robot was found, as of now."""

    map_from_base: Pose
    reason: str
    unsure: bool
    """Whether other places are still to be looked for."""


class Seeker:
    """Owns searches, the places that might be, and when to look again."""

    def __init__(
        self, world: PreparedMap, mounts: Mounts, config: LocalizerConfig, *, keen: bool
    ) -> None:
        """Build.

        Args:
            world: the prepared cloud.
            mounts: ``base_from_scanner`` by the scanner's frame.
            config: all settings.
            keen: whether to look for the robot by itself when it is lost.
        """
        self._keen, self._period = keen, config.lost_search_period
        search = config.search
        heights = [p.position[2] for p in mounts.values() if p.rotation[2, 2] > 0.9] or [0.3]
        plan = FloorPlan(world, float(heights[0]), cell=search.cell, sigma=search.field_sigma)
        self._desk = HintSearch(world, plan, search, config.map_search, config.late_readings)
        self._hypotheses = Hypotheses(world, search, config.hypotheses)
        self.asked = False
        """Whether the pose stands, but other places may explain what is seen."""
        self._everywhere = False
        self._resting = False
        self._due, self._everywhere_due = 0, 0

    @property
    def busy(self) -> bool:
        """Whether a search is under way or about to begin."""
        return self._desk.busy

    @property
    def undecided(self) -> bool:
        """Whether there are places to tell apart."""
        return self._hypotheses.open

    def candidates(self, odom: Pose) -> tuple[Candidate, ...]:
        """Return the places to tell apart, best first, brought forward to ``odom_from_base``."""
        return self._hypotheses.candidates(odom)

    def next_answer(self) -> HintVerdict | None:
        """Take the oldest answer to a hint."""
        return self._desk.next_answer()

    def look_everywhere(self) -> None:
        """Begin a search of the whole map with the next sweep."""
        self._everywhere = self.asked = True
        self._resting = False
        self._hypotheses.drop()

    def expect(self, hint: Hint) -> None:
        """Make ready to answer a hint that just came, though it may have been given before."""
        self._desk.expect(hint)

    def rest(self) -> None:
        """Look for the robot no more by itself, until it is known where it is or somebody asks."""
        self._hypotheses.drop()
        self._everywhere = self.asked = False
        self._resting = True

    def receive(self, hint: Hint, now: int, odom_then: Pose) -> None:
        """Take a hint.

        Args:
            hint: what the operator believes.
            now: [ns].
            odom_then: ``odom_from_base`` at the hint's stamp.
        """
        self._desk.receive(hint, now, odom_then)

    def open(self, sweep: Sweep, odom: Pose, belief: Belief) -> None:
        """Begin the search that is due, if one is.

        Args:
            sweep: the newest one.
            odom: ``odom_from_base`` at its stamp.
            belief: the estimate.
        """
        now = sweep.stamp
        self._desk.begin(sweep, odom, belief.pose)
        everywhere = self._everywhere and now >= self._everywhere_due
        if everywhere and not self._desk.busy and not self._hypotheses.open:
            self._everywhere = False
            self._desk.search_everywhere(sweep, odom, belief.pose)
        if belief.placed and not belief.lost:
            self._resting = False
        if self._hypotheses.open or self._resting or not self._keen:
            return
        if belief.placed and belief.lost and now >= self._due:
            self._due = now + self._period
            self._desk.search_around(_around(belief), sweep, odom, belief.pose)

    def advance(self, now: int, odom: Pose, belief: Belief) -> Placement | None:
        """Do one tick's share of the search under way; return where it found the robot.

        Args:
            now: [ns].
            odom: ``odom_from_base`` now.
            belief: the estimate now.
        """
        trusted = belief.placed and not belief.lost and not belief.doubtful
        found = self._desk.advance(odom, belief.pose if trusted else None)
        return self._settle(found, now, odom, belief) if found is not None else None

    def _settle(self, found: Found, now: int, odom: Pose, belief: Belief) -> Placement | None:
        place = None
        unsure = not belief.placed or belief.lost
        if found.verdict is Verdict.ACCEPTED and not found.everywhere:
            # What explains the sweep near where the robot was lost may not be the only place that does.
            place = self._found(found.candidates[0], found.reason, unsure=found.hint is None)
        elif found.everywhere or (found.verdict is Verdict.AMBIGUOUS and unsure):
            self._hypotheses.begin(found.candidates, odom)
            if found.everywhere and not found.candidates:
                # Nothing to lay over the map, as in the open or behind a crowd: look again from farther on.
                self._everywhere = True
                self._everywhere_due = now + self._period
        elif found.hint is None:
            # Not around here: it must be somewhere.
            self._everywhere = True
        if found.hint is not None:
            self._desk.answer(found.hint, now, found.verdict, found.reason, found.candidates)
        return place

    def tell_apart(self, sweep: Sweep, odom: Pose, belief: Belief) -> Placement | None:
        """Judge the places that might be by the newest sweep; return the one that is left to believe.

        Args:
            sweep: the newest one.
            odom: ``odom_from_base`` at its stamp.
            belief: the estimate.
        """
        if belief.placed and not belief.lost and not self.asked:
            self._hypotheses.drop()
            return None
        place = self._hypotheses.look(sweep, odom)
        if place is not None and belief.placed and same_place(place.map_from_base, belief.pose):
            self._hypotheses.drop()
            self.asked = False
        elif place is not None:
            reason = f"explains {place.score:.0%} of the sweeps on the way here"
            return self._found(place, reason, unsure=False)
        elif self._hypotheses.exhausted:
            self._hypotheses.drop()
            self._everywhere = True
        return None

    def _found(self, place: Candidate, reason: str, *, unsure: bool) -> Placement:
        self._hypotheses.drop()
        self._everywhere = self.asked = unsure
        self._resting = False
        return Placement(place.map_from_base, reason, unsure)

    def snapshot(self) -> SeekerSnapshot:
        """Return what is being looked for, for ``restore``."""
        return SeekerSnapshot(
            self.asked,
            self._everywhere,
            self._resting,
            self._due,
            self._everywhere_due,
            self._desk.snapshot(),
            dict(vars(self._hypotheses)),
        )

    def restore(self, snapshot: SeekerSnapshot) -> None:
        """Look for what was being looked for at a snapshot."""
        self.asked, self._everywhere = snapshot.asked, snapshot.everywhere
        self._resting = snapshot.resting
        self._due, self._everywhere_due = snapshot.due, snapshot.everywhere_due
        self._desk.restore(snapshot.desk)
        vars(self._hypotheses).update(snapshot.hypotheses)


def _around(belief: Belief) -> Window:
    """Where to look for a robot that was lost but a moment ago."""
    p, covariance = belief.pose, belief.covariance
    half = float(np.clip(3.0 * horizontal_sigma(covariance), 1.0, 3.0))
    half_yaw = float(np.clip(3.0 * np.sqrt(covariance[5, 5]), np.deg2rad(20.0), np.pi))
    return Window(float(p.position[0]), float(p.position[1]), p.yaw, half, half_yaw)
