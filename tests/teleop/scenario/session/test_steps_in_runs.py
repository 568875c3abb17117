"""Steps in recorded runs: they repeat to the bit, keep the rules, and leave a log of their precision."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from teleop.scenario.operators.operator import Briefing, Operator
from teleop.scenario.operators.wire import Answer, Wire
from teleop.scenario.session.inbox_file import read_inboxes
from teleop.scenario.session.run import replay_run, run_scenario
from tests.teleop.scenario.session.support import scenario

MOVE = "farsteer_msgs/action/Move"


class Stepping(Operator):
    """Sends goals by both measures and commands of the topic, and cancels one."""

    def __init__(self) -> None:
        super().__init__()
        self.results: list[dict[str, Any]] = []
        self._last = ""

    def begin(self, wire: Wire, briefing: Briefing) -> None:
        """Need nothing."""

    def act(self, wire: Wire, now: int) -> None:
        """Send steps now and then."""

        def answered(answer: Answer) -> None:
            self.results.append(dict(answer.values))

        def goal(distance: float, measure_by: str) -> str:
            values = {"distance": distance, "measure_by": measure_by}
            return wire.goal("/move", MOVE, values, answered)

        match round(now / 20e6):
            case 25:
                goal(0.2, "localization")
                goal(-0.1, "odometry")
                self._last = goal(0.1, "odometry")
            case 30:
                wire.cancel("/move", self._last)
                text = '{"angle": 10, "movement": "left"}'
                wire.publish("/turtle_control", "std_msgs/String", {"data": text})
            case 230:
                goal(1.0, "odometry")


@pytest.mark.slow
def test_run_with_steps_repeats_to_the_bit_and_keeps_the_rules(tmp_path: Path) -> None:
    stop = {"kind": "estop", "at": 5.2, "lasting": 0.2}
    operator = Stepping()
    chosen = scenario(stop, time=6.0, seed=2, limits={"rules": True})
    first = run_scenario(chosen, tmp_path / "run", operator=operator)
    assert [r["outcome"] for r in operator.results] == ["done", "done", "cancelled", "e_stop"]
    assert operator.results[0]["distance"] == pytest.approx(0.2, abs=0.01)
    assert not [event for event in first.events if "rule" in event.text]
    kinds = {
        type(m).__name__
        for inbox in read_inboxes(tmp_path / "run/inbox.jsonl").values()
        for m in inbox
    }
    assert {"StepGoal", "StepCancel", "StepAlive", "StepAnswered"} <= kinds

    second = replay_run(tmp_path / "run", tmp_path / "again")
    assert second.sha256 == first.sha256
    for name in ("truth.tum", "estimate.tum", "inbox.jsonl", "steps.csv"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "run" / name).read_bytes()


@pytest.mark.slow
def test_run_keeps_what_was_commanded_and_driven_of_each_begun_step(tmp_path: Path) -> None:
    run_scenario(scenario(time=4.0), tmp_path / "run", operator=Stepping())
    with (tmp_path / "run/steps.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # The one that was cancelled before it began has driven nothing.
    assert [row["outcome"] for row in rows] == ["done", "done"]
    assert [row["measured_by"] for row in rows] == ["localization", "odometry"]
    assert [float(row["commanded_distance"]) for row in rows] == [0.2, -0.1]
    for row in rows:
        for kind, tolerance in (("distance", 0.02), ("angle", 0.02)):
            commanded, true = float(row[f"commanded_{kind}"]), float(row[f"true_{kind}"])
            assert true == pytest.approx(commanded, abs=tolerance)
            for measure in ("wheel", "localizer"):
                assert float(row[f"{measure}_{kind}"]) == pytest.approx(true, abs=tolerance)


def test_run_without_steps_has_no_log_of_them(tmp_path: Path) -> None:
    run_scenario(scenario(time=0.1), tmp_path / "run")
    assert not (tmp_path / "run/steps.csv").exists()
