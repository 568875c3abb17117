"""Places that were being compared when the robot was carried off are given up."""

from __future__ import annotations

from localization.relocalization.hypotheses import Hypotheses, HypothesesConfig
from localization.relocalization.relocalizer import RelocalizerState
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_schedule import SearchCause, SearchScheduleConfig
from localization.types import SECOND, Candidate, Pose

PLACES = (Candidate(Pose.planar(1.0, 2.0, 0.0), 0.97), Candidate(Pose.planar(7.0, 2.0, 0.0), 0.95))


def test_comparing_begins_again_with_a_search_at_once() -> None:
    places = Hypotheses.of(PLACES, Pose.identity(), HypothesesConfig(), SearchConfig())
    state = RelocalizerState(hypotheses=places, cause=SearchCause.REQUESTED).carried_off()
    assert state.hypotheses.places == ()
    assert state.schedule.cause is SearchCause.REQUESTED
    assert state.schedule.ready(SECOND, SearchScheduleConfig())


def test_robot_that_compares_nothing_goes_on_as_before() -> None:
    state = RelocalizerState()
    assert state.carried_off() is state
