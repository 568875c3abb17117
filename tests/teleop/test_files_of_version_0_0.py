"""Files that version 0.0 wrote are read by today's teleoperation."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from teleop.joystick import JoystickLayout, read_joy
from teleop.robot.serving.server_setup import ROLES
from teleop.rosbridge import Role, read_credentials
from teleop.scenario.tour.report import summary_table
from teleop.scenario.tour.summary import read_summary

WRITTEN = Path(__file__).parents[1] / "data/written_by_0_0"
RUN = WRITTEN / "run"


def test_run_is_evaluated_with_the_same_results() -> None:
    before = json.loads((RUN / "summary.json").read_text(encoding="utf-8"))
    summary = read_summary(RUN)
    assert summary.facts.scene == before["facts"]["scene"] == "office"
    assert summary.passed is before["passed"]
    assert summary.distance == pytest.approx(before["distance"])
    assert [(c.name, c.met) for c in summary.checks] == [
        (c["name"], c["met"]) for c in before["checks"]
    ]
    assert "position" in summary_table(summary)


def test_joystick_layout_is_read() -> None:
    values = json.loads((WRITTEN / "joystick.json").read_text(encoding="utf-8"))
    layout = JoystickLayout(**values)
    request = read_joy([0, 0, 0, 0, 1.0], [0, 0, 0, 0, 0, 0, 1, 1], layout)
    assert request.enabled
    assert request.twist.linear[0] == layout.turbo_speed == 0.6


def test_token_file_is_read(tmp_path: Path) -> None:
    tokens = tmp_path / "tokens.toml"
    tokens.touch(mode=0o600)
    tokens.write_bytes((WRITTEN / "tokens.toml").read_bytes())
    keyring = read_credentials(tokens, ROLES)
    access = keyring.find("test")
    assert access is not None
    assert (access.holder, access.role) == ("unity", Role.OPERATE)
    assert access.rules.publish == ("/joy", "/cmd_vel", "/initialpose")
