"""The judge of trials in which something fails while a robot is driven."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.common.sheet import Sheet
from benchmarks.failures.command import main
from benchmarks.failures.judgement import BRAKING, REQUEST, Wheels
from benchmarks.failures.trials import DRIVERS, FAILURES, planned
from localization.logs.mcap_writer import ReadingsWriter
from localization.types import SECOND, Pose, WheelSpeeds

MOUNTS = {"laser_horizontal": Pose.identity(), "laser_vertical": Pose.identity()}
FAILED = 2.0


def driven(path: Path, brakes_at: float, again: float = np.inf) -> Wheels:
    """Log a robot that drives at 0.5 m/s, brakes at a time, and drives again at another [s]."""
    with ReadingsWriter(path, MOUNTS) as log:
        for number in range(300):
            time = 0.02 * (number + 1)
            speed = 0.5 - BRAKING * max(0.0, time - brakes_at)
            speed = 0.3 if time > again else max(0.0, speed)
            stamp = round(time * SECOND)
            log.write(WheelSpeeds(stamp, float(np.float32(speed)), float(np.float32(speed))), stamp)
    return Wheels([path])


@pytest.mark.parametrize(
    ("brakes_after", "again", "wrong"),
    [
        (0.0, np.inf, ""),
        (REQUEST, np.inf, ""),
        (REQUEST + 0.1, np.inf, "braked after 0.6"),
        (0.1, FAILED + 1.8, "drove on at 0.30"),
    ],
)
def test_late_stop_and_driving_on_are_failures_and_a_stop_in_time_passes(
    tmp_path: Path, brakes_after: float, again: float, wrong: str
) -> None:
    stop = driven(tmp_path / "log.mcap", FAILED + brakes_after, again).stop(FAILED, FAILED + 2.2)
    assert stop is not None
    assert stop.failed.startswith(wrong)
    assert bool(stop.failed) is bool(wrong)
    if not wrong:
        assert stop.braked_after == pytest.approx(brakes_after, abs=0.002)
        assert stop.way == pytest.approx(0.5 * brakes_after + 0.125, abs=0.02)


def test_robot_that_stood_at_the_failure_is_no_trial(tmp_path: Path) -> None:
    assert driven(tmp_path / "log.mcap", 0.0).stop(FAILED, FAILED + 2.2) is None


def test_a_thousand_seeds_have_every_failure_with_every_driver_that_can_have_it() -> None:
    plans = [planned(seed) for seed in range(1000)]
    met = {(plan.driver, plan.failure) for plan in plans}
    talk = {"nan", "garbage", "clock", "silence"}
    assert met == {
        (driver, failure)
        for driver in DRIVERS
        for failure in FAILURES
        if driver != "page" or failure not in talk
    }
    assert sum(plan.driver == "page" for plan in plans) >= 50


def test_trials_are_counted_by_driver_and_by_what_failed_and_a_late_stop_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trial = {"driver": "page", "failure": "killed", "braked_after": 0.4, "failed": ""}
    late = {"driver": "roslib", "braked_after": 0.9, "failed": "braked after 0.900 s"}
    lines = [{"seed": 0, **trial}, {"seed": 1, **trial, **late}, {"seed": 2, **trial, "void": "x"}]
    (tmp_path / "trials.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    out = tmp_path / "failures.json"
    assert main([str(tmp_path), "3"], out) == 1
    figures = {(f.method, f.quantity): f for f in Sheet(out).parts["failures"]}
    assert figures["all", "trials"].value == 2
    assert figures["all", "not in time, or too far"].verdict == "missed"
    assert figures["page", "trials"].value == 1
    assert figures["killed", "braked after, most"].value == 0.9
    assert "FAILED seed 1, roslib, killed: braked after 0.900 s" in capsys.readouterr().out
    assert main([str(tmp_path), "many"]) == 2
