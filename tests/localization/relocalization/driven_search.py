"""A hint search that is driven call by call: it keeps the newest state and the answers."""

from __future__ import annotations

from collections import deque

from localization.maps.prepared_map import PreparedMap
from localization.matching.scan_consistency import BeamClassifier
from localization.relocalization.floor_plan import FloorPlan
from localization.relocalization.hint_search import TICK, HintSearch, SearchResult, SearchState
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.verification import Weighing
from localization.types import Hint, HintVerdict, Pose, Sweep


class DrivenSearch:
    """Keeps the newest state of a search; its methods are those of ``HintSearch``."""

    def __init__(
        self, world: PreparedMap, plan: FloorPlan, config: SearchConfig | None = None
    ) -> None:
        weighing = Weighing(BeamClassifier(world))
        self.steps = HintSearch(world, plan, config or SearchConfig(), weighing=weighing)
        self.state = SearchState()
        self.answers: deque[HintVerdict] = deque()
        self.now = 0

    @property
    def busy(self) -> bool:
        return self.state.busy

    def receive(self, hint: Hint, now: int, odom_from_base: Pose) -> None:
        self.state, answers = self.steps.receive(self.state, hint, now, odom_from_base)
        self.answers += answers

    def begin(self, sweep: Sweep, odom_from_base: Pose, level: Pose) -> None:
        self.state = self.steps.begin(self.state, sweep, odom_from_base, level)

    def search_map(self, sweep: Sweep, odom_from_base: Pose, level: Pose) -> None:
        self.state = self.steps.search_map(self.state, sweep, odom_from_base, level)

    def advance(self, odom_from_base: Pose, current: Pose | None) -> SearchResult | None:
        """Do a tick's share of the search."""
        self.now += TICK
        self.state, result = self.steps.advance(self.state, odom_from_base, current, now=self.now)
        return result

    def next_answer(self) -> HintVerdict | None:
        return self.answers.popleft() if self.answers else None
