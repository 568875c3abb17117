"""Trials of steps: time alone falls short by the ramps, the robot's own steps do not; files and table."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest

from teleop.__main__ import main
from teleop.scenario.operators.step_plan import ANGLES, DISTANCES, drawn_steps


def test_drawn_steps_are_half_turns_and_go_there_and_back() -> None:
    steps = drawn_steps(100, 5)
    assert len(steps) == 100
    assert steps == drawn_steps(100, 5) != drawn_steps(100, 6)
    assert sum(step.distance != 0.0 for step in steps) == 50
    for there, back in zip(steps[::2], steps[1::2], strict=True):
        assert (back.distance, back.angle) == (-there.distance, -there.angle)
        if there.distance:
            assert abs(there.distance) in DISTANCES
        else:
            assert round(math.degrees(abs(there.angle))) in ANGLES


@pytest.mark.slow
def test_command_drives_each_way_and_writes_each_step(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "trial"
    words = ["precision", "--surface", "carpet", "--steps", "4", "--seed", "3", "--out", str(out)]
    assert main(words) == 0
    table = capsys.readouterr().out
    assert table.startswith("| surface | driven by |")
    assert "4 of 4" in table
    assert (out / "precision.md").read_text(encoding="utf-8") in table
    assert (out / "precision.png").stat().st_size > 10_000
    with (out / "steps.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["driven_by"] for row in rows] == ["time"] * 4 + ["odometry"] * 4 + [
        "localization"
    ] * 4
    errors = {"time": 0.0, "odometry": 0.0, "localization": 0.0}
    for row in rows:
        if wanted := float(row["commanded_distance_m"]):
            error = abs(float(row["true_distance_m"]) - wanted)
            errors[row["driven_by"]] = max(errors[row["driven_by"]], error)
    # The ramps of the drive, which the client does not see, cost more than 3 cm each time.
    assert errors["time"] > 0.03
    assert errors["odometry"] < 0.01
    assert errors["localization"] < 0.02


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--steps", "1"], "--steps must be at least 2, got 1"),
        (["--surface", "lava"], "no surface named 'lava'; available: asphalt, carpet"),
    ],
)
def test_invalid_trial_is_refused_in_one_line(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["precision", *words]) == 2
    assert complaint in capsys.readouterr().err
