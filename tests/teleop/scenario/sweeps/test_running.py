from __future__ import annotations

import math

import pytest

from teleop.scenario.files.scenario import SCHEMA
from teleop.scenario.session.run import run_scenario
from teleop.scenario.sweeps.costs import costs_of
from teleop.scenario.sweeps.running import STAGES, RunResult, run_one
from tests.teleop.scenario.sweeps.support import scenario


@pytest.mark.slow
def test_a_worker_runs_what_a_scenario_alone_would_and_says_where_the_time_went() -> None:
    short = scenario(limits={"distance": 0.5})
    answered = RunResult(**run_one(SCHEMA.dump_json(short).decode(), None))
    outcome = run_scenario(short)
    assert answered.sha256 == outcome.sha256
    assert answered.figures == pytest.approx(outcome.figures, nan_ok=True)
    assert (answered.verdict, answered.missed) == ("missed", "distance")
    assert answered.times["robot"] == pytest.approx(1.0)
    assert all(answered.times[stage] > 0.0 for stage in STAGES)
    assert math.isclose(sum(costs_of([answered]).shares.values()), 1.0)


def test_a_run_that_cannot_begin_says_why_and_keeps_no_other_from_running() -> None:
    lost = scenario(start={"at": "atlantis"})
    answered = RunResult(**run_one(SCHEMA.dump_json(lost).decode(), None))
    assert answered.verdict == "bad input"
    assert "atlantis" in answered.ending
    assert not answered.figures
